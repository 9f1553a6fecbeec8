//! The views of each point of a cloud, in the file beside it: `fused.ply.vis`.

use super::write_parts;
use crate::error::Result;
use crate::fusion::{CloudSource, PointViews};
use crate::io::files::{FileReader, write_file};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The file with the views of the points of a cloud.
pub(crate) fn visibility_path(cloud: &Path) -> PathBuf {
    let mut path = cloud.as_os_str().to_owned();
    path.push(".vis");
    path.into()
}

/// Writes the views of each point (`fused.ply.vis`): a u64 count, then for each point a u32 count and the
/// views as u32 indices into the images in the order of the model's file.
pub fn write_visibility(path: &Path, views: &PointViews) -> Result<()> {
    write_file(path, |out| {
        out.write_all(&(views.len() as u64).to_le_bytes())?;
        write_lists(out, views)
    })
}

/// The same for a cloud in parts.
pub(super) fn write_visibility_of(path: &Path, source: &dyn CloudSource) -> Result<()> {
    let start = |out: &mut dyn Write| out.write_all(&(source.len() as u64).to_le_bytes());
    write_parts(path, source, start, |out, points| write_lists(out, &points.views))
}

/// Writes the lists of views without their number.
pub(super) fn write_lists(out: &mut (impl Write + ?Sized), views: &PointViews) -> io::Result<()> {
    for point in 0..views.len() {
        let views = views.get(point);
        out.write_all(&(views.len() as u32).to_le_bytes())?;
        for view in views {
            out.write_all(&view.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Reads the views of each point from a file in the layout of [`write_visibility`].
pub fn read_visibility(path: &Path) -> Result<PointViews> {
    let mut file = FileReader::open(path)?;
    let points = file.u64("the number of points")?;
    file.require(points, 4, "points")?;
    let mut all = PointViews::default();
    let mut views = Vec::new();
    for _ in 0..points {
        let count = file.u32("a point's number of views")?;
        file.require(count.into(), 4, "a point's views")?;
        views.clear();
        for _ in 0..count {
            views.push(file.u32("a point's views")?);
        }
        all.push(&views);
    }
    file.finish()?;
    Ok(all)
}
