//! Files of views that are written for the fusion alone: maps that the user did not ask for.

use super::Job;
use crate::io::Workspace;
use crate::options::ViewFiles;
use std::path::PathBuf;

/// The maps of a view that the fusion reads and that were not asked for.
pub(super) fn temporary_files(workspace: &Workspace, name: &str, wanted: &ViewFiles) -> Vec<PathBuf> {
    let kept = workspace.view_files(name, wanted);
    workspace.fused_files(name).into_iter().filter(|file| !kept.contains(file)).collect()
}

impl Job {
    /// Removes what no task needs once the cloud is written.
    pub(super) fn remove_temporaries(&self) {
        self.estimates.remove_all();
        for view in self.scene.views() {
            for file in temporary_files(&self.workspace, &view.name, &self.options.output.write) {
                // What is left takes room, and does no harm.
                let _ = std::fs::remove_file(file);
            }
        }
    }
}
