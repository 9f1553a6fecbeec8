//! The layout of a run's folder.
//!
//! ```text
//! run/manifest.json      what the run is made from
//! run/lock               locked while a process works on the run
//! run/tasks/             a record for each task that is done
//! run/estimates/         estimates of views between tasks
//! images/ sparse/        the scene
//! stereo/ preview/       maps and previews of the views that are finished
//! fused.ply              the cloud
//! ```

use super::task::Task;
use crate::error::{Error, Result};
use crate::io::cannot_be_written;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// A run's folder.
#[derive(Debug, Clone)]
pub(super) struct RunFolder(PathBuf);

/// How a process works on a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Access {
    /// The whole run: no other process may work on it.
    Whole,
    /// Some tasks: other processes may work on others.
    Tasks,
}

impl RunFolder {
    pub(super) fn new(root: &Path) -> RunFolder {
        RunFolder(root.to_owned())
    }

    pub(super) fn root(&self) -> &Path {
        &self.0
    }

    pub(super) fn manifest(&self) -> PathBuf {
        self.0.join("run").join("manifest.json")
    }

    pub(super) fn tasks(&self) -> PathBuf {
        self.0.join("run").join("tasks")
    }

    pub(super) fn record(&self, task: Task) -> PathBuf {
        self.tasks().join(task.file_name())
    }

    pub(super) fn estimates(&self) -> PathBuf {
        self.0.join("run").join("estimates")
    }

    /// The file of a view's estimate after the search or the check of a cycle.
    pub(super) fn estimate(&self, cycle: usize, view: usize, stage: &str) -> PathBuf {
        self.estimates().join(format!("cycle{cycle:02}-{view:05}.{stage}"))
    }

    pub(super) fn report(&self) -> PathBuf {
        self.0.join("report.json")
    }

    /// Locks the run until the file is dropped; the system unlocks it when the process ends.
    ///
    /// # Errors
    /// A folder that cannot be written; another process that works on the run.
    pub(super) fn lock(&self, access: Access) -> Result<File> {
        let path = self.0.join("run").join("lock");
        // NFS gives a shared lock only on a file that is open for reading, an exclusive one for writing.
        let open = std::fs::create_dir_all(self.0.join("run"))
            .and_then(|()| File::options().create(true).truncate(false).read(true).write(true).open(&path));
        let file = open.map_err(|error| cannot_be_written(&path, error))?;
        let locked = match access {
            Access::Whole => file.try_lock(),
            Access::Tasks => file.try_lock_shared(),
        };
        match locked {
            Ok(()) => Ok(file),
            Err(TryLockError::WouldBlock) => Err(Error::file(
                &self.0,
                "another process works on the run in this folder; wait for it, or name another folder",
            )),
            // Some network file systems have no locks: as safe as without one.
            Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => Ok(file),
            Err(TryLockError::Error(error)) => Err(cannot_be_written(&path, error)),
        }
    }
}
