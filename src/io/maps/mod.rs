//! Maps in formats of other programs: PFM, NPY, TIFF, and OpenMVS' depth maps.

mod dmap;
mod npy;
mod pfm;
#[cfg(feature = "tiff")]
mod tiff;

use super::colmap_maps::check_length;
use crate::error::{Error, Result};
pub use dmap::{DepthMapFile, write_dmap};
use std::path::Path;

/// A format of maps that hold one or three numbers for each pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapFormat {
    /// Portable float map: rows from the bottom to the top.
    Pfm,
    /// NumPy's array file: float32, (height, width) or (height, width, 3).
    Npy,
    /// TIFF of 32-bit floats.
    Tiff,
}

impl MapFormat {
    /// All formats.
    pub const ALL: [MapFormat; 3] = [MapFormat::Pfm, MapFormat::Npy, MapFormat::Tiff];

    /// Its name, the ending of files.
    pub fn name(self) -> &'static str {
        match self {
            MapFormat::Pfm => "pfm",
            MapFormat::Npy => "npy",
            MapFormat::Tiff => "tiff",
        }
    }
}

/// Writes a map of `channels` numbers for each pixel, 1 or 3, row by row from the top.
///
/// # Errors
/// Another number of channels; values that do not fill the size; a format that this build does not have; a
/// file that cannot be written.
///
/// # Examples
/// ```
/// use skep::io::{MapFormat, write_float_map};
///
/// let folder = tempfile::tempdir().unwrap();
/// let path = folder.path().join("depth.pfm");
/// write_float_map(&path, MapFormat::Pfm, (2, 1), 1, &[1.0, 2.0])?;
/// assert!(std::fs::read(&path).unwrap().starts_with(b"Pf\n2 1\n-1.0\n"));
/// # Ok::<(), skep::Error>(())
/// ```
pub fn write_float_map(
    path: &Path,
    format: MapFormat,
    (width, height): (u32, u32),
    channels: usize,
    values: &[f32],
) -> Result<()> {
    if channels != 1 && channels != 3 {
        return Err(Error::argument("channels", channels, "1 or 3"));
    }
    if !values.len().is_multiple_of(channels) {
        return Err(Error::argument(
            "map",
            format!("{} values", values.len()),
            format!("a multiple of {channels}"),
        ));
    }
    check_length("map", width, height, values.len() / channels)?;
    match format {
        MapFormat::Pfm => pfm::write(path, (width, height), channels, values),
        MapFormat::Npy => npy::write(path, (width, height), channels, values),
        #[cfg(feature = "tiff")]
        MapFormat::Tiff => tiff::write(path, (width, height), channels, values),
        #[cfg(not(feature = "tiff"))]
        MapFormat::Tiff => Err(Error::argument("format", "tiff", "a build with the feature `tiff`")),
    }
}
