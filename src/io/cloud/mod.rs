//! Fused clouds in files: PLY, LAS and LAZ, the views of the points, and scenes for Gaussian splatting.

mod extent;
#[cfg(feature = "las")]
mod las;
mod ply;
mod splat;
mod spool;
mod visibility;

use crate::error::{Error, Result};
use crate::fusion::{CloudSource, PointCloud};
use crate::io::files::write_file;
use crate::options::CloudFormat;
pub use ply::{read_ply, write_ply};
pub(crate) use splat::write_splat;
pub(crate) use spool::{CloudSpool, StoredCloud};
use std::io::{self, Write};
use std::path::Path;
pub(crate) use visibility::visibility_path;
pub use visibility::{read_visibility, write_visibility};

/// Writes a cloud in a format, and the views of its points beside it (`PATH.vis`).
///
/// # Errors
/// A format that this build does not have; a full disk, for example.
pub(crate) fn write_cloud(path: &Path, format: CloudFormat, cloud: &dyn CloudSource) -> Result<()> {
    write_points(path, format, cloud)?;
    visibility::write_visibility_of(&visibility_path(path), cloud)
}

/// Writes a cloud in a format.
///
/// # Errors
/// A format that this build does not have; a full disk, for example.
pub(crate) fn write_points(path: &Path, format: CloudFormat, cloud: &dyn CloudSource) -> Result<()> {
    match format {
        CloudFormat::Ply => ply::write(path, cloud),
        #[cfg(feature = "las")]
        CloudFormat::Las => las::write(path, cloud, false),
        #[cfg(feature = "las")]
        CloudFormat::Laz => las::write(path, cloud, true),
        #[cfg(not(feature = "las"))]
        CloudFormat::Las | CloudFormat::Laz => format.check(),
    }
}

/// Writes a file of points that are read in parts.
fn write_parts(
    path: &Path,
    source: &dyn CloudSource,
    start: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    mut write: impl FnMut(&mut dyn Write, &PointCloud) -> io::Result<()>,
) -> Result<()> {
    // What fails besides the writing keeps its own error.
    let mut failed = None;
    let written = write_file(path, |out| {
        start(out)?;
        let mut written = Ok(());
        let read = source.each_part(&mut |points| {
            written = write(out, points);
            if written.is_ok() { Ok(()) } else { Err(Error::Cancelled) }
        });
        written?;
        read.map_err(|error| io::Error::other(failed.insert(error).to_string()))
    });
    failed.map_or(written, Err)
}
