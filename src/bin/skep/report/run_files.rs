//! The files that the page of a run is made from.

use super::unfinished;
use serde_json::Value;
use skep::io::{ColmapModel, MapKind, SceneFolder, Workspace};
use skep::{Error, Result};
use std::path::{Path, PathBuf};

/// A run's folder, or another workspace with a model and maps.
pub struct RunFiles {
    pub workspace: Workspace,
    pub scene: SceneFolder,
    /// Views with their cameras, and the sparse points.
    pub model: ColmapModel,
    /// What `report.json` says, or of it what is known while the run goes on.
    pub report: Value,
    /// Whether the run is complete; `None` for a folder that no run made.
    pub is_complete: Option<bool>,
}

impl RunFiles {
    /// Finds the files in a folder. The report is that in the folder, or of a run that goes on what its
    /// records tell.
    ///
    /// # Errors
    /// No model in the folder or the one above it; a damaged file.
    pub fn find(folder: &Path) -> Result<RunFiles> {
        let workspace = Workspace::new(folder);
        let scene = workspace.find_scene()?;
        let model = ColmapModel::read(&scene.sparse)?;
        let file = folder.join("report.json");
        let (report, is_complete) = match std::fs::read(&file) {
            Ok(bytes) => {
                // An object: what reads it takes missing keys for null, but not other kinds of values.
                let read = serde_json::from_slice(&bytes).map(Value::Object);
                (read.map_err(|error| Error::file(&file, format!("not a report: {error}")))?, Some(true))
            }
            Err(_) => match skep::job::read_state(folder)? {
                Some(state) => {
                    let is_complete = state.points.is_some();
                    (unfinished::report(&state, &model), Some(is_complete))
                }
                None => (Value::Null, None),
            },
        };
        Ok(RunFiles { workspace, scene, model, report, is_complete })
    }

    /// The files of the run that just ended, with its report.
    ///
    /// # Errors
    /// A model that cannot be read.
    pub fn of_run(folder: &Path, report: Value) -> Result<RunFiles> {
        let workspace = Workspace::new(folder);
        let scene = workspace.find_scene()?;
        let model = ColmapModel::read(&scene.sparse)?;
        Ok(RunFiles { workspace, scene, model, report, is_complete: Some(true) })
    }

    /// Whether the validated depths of a view are there.
    pub fn is_finished(&self, view: usize) -> bool {
        self.workspace.depth_map(&self.model.images[view].name, MapKind::Validated).is_file()
    }

    /// What the report says of a view, by its name.
    pub fn view_report(&self, view: usize) -> Option<&Value> {
        let is_it = |entry: &&Value| entry["name"] == self.model.images[view].name;
        // The order of both files is the same, but for a report of another model.
        let views = self.report["views"].as_array()?;
        views.get(view).filter(is_it).or_else(|| views.iter().find(is_it))
    }

    /// Whether a view was to get maps; else only its photograph was used.
    pub fn is_reference(&self, view: usize) -> bool {
        self.view_report(view).is_none_or(|report| report["reference"] != false)
    }

    /// The clouds that may be there, the fused one of the run's format first.
    pub fn cloud(&self) -> Option<PathBuf> {
        let files = skep::CloudFormat::ALL.map(|format| self.workspace.cloud_as(format));
        files.into_iter().find(|file| file.is_file())
    }

    /// The name of the run for people: that of the scene's folder.
    pub fn title(&self) -> String {
        let folder = self.workspace.folder();
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let own = name(&folder).unwrap_or_default();
        match folder.parent().and_then(name) {
            Some(above) if own == "dense" => above,
            _ => own,
        }
    }
}
