//! Scenes as programs for Gaussian splatting read them: photographs, a COLMAP model, points to start from.

use super::{ply, write_parts};
use crate::error::Result;
use crate::fusion::CloudSource;
use crate::io::colmap_model::{ColmapModel, ModelImage};
use crate::io::files::link_or_copy;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes `images/` (hard links where the file system can), and in `sparse/0/` a binary model whose points
/// are those of the cloud, and `points3D.ply` with the same points, positions as floats. The photographs are
/// taken from the folder `photographs`; one that is not there is left out. Returns the files.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write_splat(
    folder: &Path,
    images: &[ModelImage],
    photographs: &Path,
    cloud: &dyn CloudSource,
) -> Result<Vec<PathBuf>> {
    let sparse = folder.join("sparse").join("0");
    let model = ColmapModel { images: images.to_vec(), points: Vec::new() };
    model.write_binary(&sparse)?;
    let points = sparse.join("points3D.bin");
    write_model_points(&points, cloud)?;
    let ply = sparse.join("points3D.ply");
    ply::write_floats(&ply, cloud)?;
    let mut files = vec![sparse.join("cameras.bin"), sparse.join("images.bin"), points, ply];
    for image in images {
        let (from, to) = (photographs.join(&image.name), folder.join("images").join(&image.name));
        if from.is_file() {
            // It may be of another scene.
            let _ = std::fs::remove_file(&to);
            link_or_copy(&from, &to)?;
            files.push(to);
        }
    }
    Ok(files)
}

/// Writes `points3D.bin`: points without tracks, since the images of the model have no features.
fn write_model_points(path: &Path, cloud: &dyn CloudSource) -> Result<()> {
    let mut id = 0u64;
    let start = |out: &mut dyn Write| out.write_all(&(cloud.len() as u64).to_le_bytes());
    write_parts(path, cloud, start, |out, points| {
        for (position, color) in points.positions.iter().zip(&points.colors) {
            id += 1;
            out.write_all(&id.to_le_bytes())?;
            position.iter().try_for_each(|coordinate| out.write_all(&coordinate.to_le_bytes()))?;
            out.write_all(color)?;
            let (error, track_length) = (0f64, 0u64);
            out.write_all(&error.to_le_bytes())?;
            out.write_all(&track_length.to_le_bytes())?;
        }
        Ok(())
    })
}
