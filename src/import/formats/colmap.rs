//! COLMAP: a folder with `images/` and models in `sparse/`, or the folder of a model.

use super::photographs;
use crate::error::{Error, Result};
use crate::geometry::Lens;
use crate::import::{SourcePhotograph, SourceScene};
use crate::io::{ColmapModel, FileReader, ModelImage, SceneFolder};
use std::path::{Path, PathBuf};

pub(super) fn is_at(path: &Path) -> bool {
    !find(path).models.is_empty()
}

/// The models of a scene, and where the photographs may be.
struct Found {
    /// The folders of the models; several are the parts that the mapper could not join.
    models: Vec<PathBuf>,
    /// In the order in which they are looked for.
    images: Vec<PathBuf>,
}

/// Looks for a model in `sparse/`, then for models in the folders there, then for those of a path that is
/// `sparse/` itself, or the folder of a model.
fn find(path: &Path) -> Found {
    let sparse = path.join("sparse");
    let images = vec![path.join("images")];
    if ColmapModel::is_in(&sparse) {
        return Found { models: vec![sparse], images };
    }
    let parts = parts(&sparse);
    if !parts.is_empty() {
        return Found { models: parts, images };
    }
    // The model may be in SCENE/sparse/0, the photographs in SCENE/images.
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let images = absolute.ancestors().take(3).map(|folder| folder.join("images")).collect();
    let is_sparse = absolute.file_name().is_some_and(|name| name == "sparse");
    let models = match is_sparse {
        _ if ColmapModel::is_in(path) => vec![path.to_owned()],
        true => self::parts(path),
        // Folders of other programs have models below them too.
        false => Vec::new(),
    };
    Found { models, images }
}

/// The models in the folders of a folder, sorted by name.
fn parts(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut models: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|folder| ColmapModel::is_in(folder)).collect();
    models.sort();
    models
}

/// Reads the model, of several the one of the most images; the photographs must be in `images/` beside it or
/// above it. Poses of models with rigs and frames are those of the images too.
///
/// # Errors
/// No `images/`; a photograph that is missing; the errors of [`ColmapModel::read_with_lenses`].
pub(super) fn read(path: &Path) -> Result<SourceScene> {
    let found = find(path);
    let (sparse, warnings) = largest(&found.models)?;
    let is_folder = |folder: &&PathBuf| folder.is_dir();
    let images = found.images.iter().find(is_folder).ok_or_else(|| {
        let places = found.images.iter().map(|place| place.display().to_string()).collect::<Vec<_>>();
        Error::file(&found.images[0], format!("no such folder; expected the photographs in {}", or(&places)))
    })?;
    let (model, distortions) = ColmapModel::read_with_lenses(&sparse)?;
    let entry = format!("the model in {}", sparse.display());
    let photograph = |(image, distortion): (ModelImage, _)| {
        let path = photographs::find(images.join(&image.name), &entry)?;
        Ok(SourcePhotograph::new(image.name, path, Lens { camera: image.camera, distortion }))
    };
    Ok(SourceScene {
        origin: format!("the COLMAP model in {}", sparse.display()),
        photographs: model.images.into_iter().zip(distortions).map(photograph).collect::<Result<_>>()?,
        points: model.points,
        workspace: Some(SceneFolder { images: images.clone(), sparse }),
        warnings,
    })
}

/// The model of the most images, and what is said about the others.
fn largest(models: &[PathBuf]) -> Result<(PathBuf, Vec<String>)> {
    if let [only] = models {
        return Ok((only.clone(), Vec::new()));
    }
    let counts = models.iter().map(|model| images_of(model)).collect::<Result<Vec<u64>>>()?;
    // The first of several as large.
    let chosen = (0..models.len()).rev().max_by_key(|&index| counts[index]).unwrap_or_default();
    let name = |index: usize| models[index].file_name().unwrap_or_default().to_string_lossy().into_owned();
    let others: Vec<String> = (0..models.len())
        .filter(|&index| index != chosen)
        .map(|index| format!("{} ({})", name(index), counts[index]))
        .collect();
    let warning = format!(
        "there are {} models, each of some of the photographs: {} is read, which has the most images, {}; \
         left out: {}",
        models.len(),
        models[chosen].display(),
        counts[chosen],
        others.join(", ")
    );
    Ok((models[chosen].clone(), vec![warning]))
}

/// The number of images of a model.
fn images_of(model: &Path) -> Result<u64> {
    let (cameras, images) = (model.join("cameras.bin"), model.join("images.bin"));
    if cameras.is_file() && images.is_file() {
        return FileReader::open(&images)?.u64("the number of entries");
    }
    Ok(ColmapModel::read_with_lenses(model)?.0.images.len() as u64)
}

fn or(places: &[String]) -> String {
    match places {
        [places @ .., last] if !places.is_empty() => format!("{} or {last}", places.join(", ")),
        _ => places.concat(),
    }
}
