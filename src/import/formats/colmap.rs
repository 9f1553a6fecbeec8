//! COLMAP: a folder with `images/` and a model in `sparse/` or `sparse/0/`.

use crate::error::{Error, Result};
use crate::geometry::Lens;
use crate::import::{SourcePhotograph, SourceScene};
use crate::io::{ColmapModel, SceneFolder};
use std::path::Path;

pub(super) fn is_at(path: &Path) -> bool {
    SceneFolder::find(path).is_ok()
}

/// Reads the model; the photographs must be in `images/`.
///
/// # Errors
/// No `images/`; the errors of [`ColmapModel::read_with_lenses`].
pub(super) fn read(path: &Path) -> Result<SourceScene> {
    let folder = SceneFolder::find(path)?;
    if !folder.images.is_dir() {
        return Err(Error::file(&folder.images, "no such folder; expected the photographs in it"));
    }
    let (model, distortions) = ColmapModel::read_with_lenses(&folder.sparse)?;
    let photograph = |(image, distortion): (crate::io::ModelImage, _)| SourcePhotograph {
        path: folder.images.join(&image.name),
        name: image.name,
        lens: Lens { camera: image.camera, distortion },
        mask: None,
        depth_range: None,
        sources: None,
    };
    Ok(SourceScene {
        origin: format!("the COLMAP model in {}", folder.sparse.display()),
        photographs: model.images.into_iter().zip(distortions).map(photograph).collect(),
        points: model.points,
        warnings: Vec::new(),
    })
}
