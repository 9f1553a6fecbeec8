//! Whether the maps in a folder belong to a scene, for who reads them without the run.

use super::folder::RunFolder;
use super::manifest::Manifest;
use super::outputs;
use super::task::{Record, Task};
use crate::error::{Error, Result};
use crate::io::{ColmapModel, ModelImage, SceneFolder, Workspace};
use crate::options::Options;
use std::path::Path;

/// What of the maps in a folder does not belong to a scene: nothing if no run made them. For a run, files
/// that are not what it wrote, as sentences.
///
/// # Errors
/// A run that was made from another model.
pub fn check_maps(folder: &Path, scene: &SceneFolder) -> Result<Vec<String>> {
    let folder = RunFolder::new(folder);
    let Some(manifest) = Manifest::read(&folder.manifest())? else { return Ok(Vec::new()) };
    let model = ColmapModel::read(&scene.sparse)?;
    if !manifest.is_of_model(&model) {
        let problem =
            format!("the maps in {} were made with other cameras, poses or points", folder.root().display());
        return Err(Error::file(&scene.sparse, problem));
    }
    let run = manifest.run();
    let (workspace, files) =
        (Workspace::new(folder.root()), manifest.options(&Options::default())?.output.write);
    let damaged = |(view, image): (usize, &ModelImage)| {
        if manifest.photographs.get(view).is_some_and(|photograph| photograph.is_source_only) {
            return None;
        }
        let Some(record) = Record::read(&folder, run, Task::Finish { view }) else {
            return Some(format!("{} is not finished: its maps may be of another run", image.name));
        };
        let gone = outputs::temporary_files(&workspace, &image.name, &files);
        record.verify(&folder, &gone).err().map(|error| error.to_string())
    };
    Ok(model.images.iter().enumerate().filter_map(damaged).collect())
}
