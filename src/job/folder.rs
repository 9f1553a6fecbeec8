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
use crate::io::{NewFolders, cannot_be_written};
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

    /// A file of each kind besides those of the views and the scene.
    pub(super) fn own_files(&self) -> Vec<PathBuf> {
        let fixed = ["fused.ply.vis", "stereo/fusion.cfg", "stereo/patch-match.cfg"];
        let mut files: Vec<PathBuf> = fixed.iter().map(|file| self.0.join(file)).collect();
        files.extend([
            self.report(),
            self.report_page(),
            self.manifest(),
            self.record(Task::Fuse),
            self.estimate(0, 0, "checked"),
        ]);
        files
    }

    pub(super) fn report(&self) -> PathBuf {
        self.0.join("report.json")
    }

    /// The report as a page, which the command line writes.
    pub(super) fn report_page(&self) -> PathBuf {
        self.0.join("report.html")
    }

    /// Returns an error if a file has the name of the folder, or of one above it.
    fn check_is_folder(&self) -> Result<()> {
        match self.0.ancestors().find(|path| path.exists()) {
            Some(found) if !found.is_dir() && found == self.0 => {
                Err(cannot_be_written(&self.0, "it is a file; expected a folder"))
            }
            Some(found) if !found.is_dir() => {
                Err(cannot_be_written(&self.0, format!("{} is a file; expected a folder", found.display())))
            }
            _ => Ok(()),
        }
    }

    /// Locks the run until the lock is dropped; the system unlocks it when the process ends.
    ///
    /// # Errors
    /// A folder that cannot be written; another process that works on the run.
    pub(super) fn lock(&self, access: Access) -> Result<Lock> {
        let path = self.0.join("run").join("lock");
        self.check_is_folder()?;
        // Of the folder: who reads the error has not heard of the file.
        let folders =
            NewFolders::create(&self.0.join("run")).map_err(|error| cannot_be_written(&self.0, error))?;
        loop {
            let is_new = !path.exists();
            // NFS gives a shared lock only on a file that is open for reading, an exclusive one for writing.
            let file = File::options().create(true).truncate(false).read(true).write(true).open(&path);
            let file = file.map_err(|error| cannot_be_written(&self.0, error))?;
            let locked = match access {
                Access::Whole => file.try_lock(),
                Access::Tasks => file.try_lock_shared(),
            };
            match locked {
                Ok(()) => (),
                Err(TryLockError::WouldBlock) => {
                    return Err(Error::file(
                        &self.0,
                        "another process works on the run in this folder; wait for it, or name another folder",
                    ));
                }
                // Some network file systems have no locks: as safe as without one.
                Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => (),
                Err(TryLockError::Error(error)) => return Err(cannot_be_written(&path, error)),
            }
            // Another process may have removed the file after it was opened here: see `Lock`.
            if is_same_file(&file, &path) {
                return Ok(Lock {
                    path,
                    _file: file,
                    is_vain: is_new && access == Access::Whole,
                    _folders: folders,
                });
            }
        }
    }
}

/// A run that is locked. One that begins nothing leaves no trace: the file of the lock and the folders above
/// it are removed again if they were made for it.
#[derive(Debug)]
pub(super) struct Lock {
    path: PathBuf,
    /// Whether the file was made for this lock, and nothing has begun yet.
    is_vain: bool,
    /// Before the folders: fields are dropped in this order.
    _file: File,
    _folders: NewFolders,
}

impl Lock {
    /// Keeps the file: a run begins.
    pub(super) fn keep(&mut self) {
        self.is_vain = false;
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if self.is_vain {
            // While it is locked: who opened it already notices that it is gone.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Whether an open file is the one at a path.
#[cfg(unix)]
fn is_same_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    let at_path = std::fs::metadata(path).map(number);
    matches!((file.metadata().map(number), at_path), (Ok(own), Ok(found)) if own == found)
}

/// Elsewhere open files are not removed.
#[cfg(not(unix))]
fn is_same_file(_: &File, _: &Path) -> bool {
    true
}
