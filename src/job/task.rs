//! The tasks of a run, and the records that they are done.

use super::folder::RunFolder;
use crate::ambc::Counts;
use crate::error::{Error, Result};
use crate::io::{Fingerprint, fingerprint_file, text};
use crate::io::{stays_inside, write_file};
use crate::pipeline::CycleRecord;
use crate::scene::PixelStatus;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// A part of a run. What a task reads is on disk once the tasks it depends on are done.
///
/// | task | reads | writes |
/// |---|---|---|
/// | `Search` | checked estimates of the cycle before: of the view, its sources, and the views whose source it is | the view's searched estimate |
/// | `Check` | searched estimates of the cycle: of the view and its sources | the view's checked estimate |
/// | `Next` | how many pixels changed in each view's search | which cycle follows |
/// | `Finish` | checked estimates of the last cycle: of the view and its sources | the view's maps |
/// | `Fuse` | the maps of all views | the cloud |
///
/// All of them read photographs and the model. Two tasks of the same kind and cycle never depend on each
/// other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Task {
    /// Searches the planes of a view.
    Search {
        /// The cycle, as in [`Stepper::cycles`](crate::Stepper::cycles).
        cycle: usize,
        /// The view.
        view: usize,
    },
    /// Checks the planes of a view against its sources.
    Check {
        /// The cycle.
        cycle: usize,
        /// The view.
        view: usize,
    },
    /// Decides which cycle follows: a scale ends early once few pixels change.
    Next {
        /// The cycle.
        cycle: usize,
    },
    /// Writes the maps of a view.
    Finish {
        /// The view.
        view: usize,
    },
    /// Fuses the maps of all views.
    Fuse,
}

impl Task {
    /// The name of the task's record.
    pub(super) fn file_name(self) -> String {
        match self {
            Task::Search { cycle, view } => format!("cycle{cycle:02}-search-{view:05}.json"),
            Task::Check { cycle, view } => format!("cycle{cycle:02}-check-{view:05}.json"),
            Task::Next { cycle } => format!("cycle{cycle:02}-next.json"),
            Task::Finish { view } => format!("finish-{view:05}.json"),
            Task::Fuse => "fuse.json".to_owned(),
        }
    }
}

/// That a task is done: its files, and what other tasks and the report read of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// The run it belongs to.
    run: String,
    files: Vec<FileEntry>,
    pub content: Content,
}

/// A file of the run's folder, its path relative to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct FileEntry {
    path: String,
    content: Fingerprint,
}

/// What a task found, besides its files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) enum Content {
    Search,
    /// The last record of the view.
    Check(CycleRecord),
    /// The cycle that follows, if any.
    Next(Option<usize>),
    Finish(ViewSummary),
    /// Number of points.
    Fuse(usize),
}

/// The counts of a finished view; empty for one that gets no maps.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ViewSummary {
    /// Number of pixels of each status, in the order of [`PixelStatus::ALL`].
    pub status_counts: [u64; PixelStatus::ALL.len()],
    /// Work done for the view.
    pub counts: Counts,
    /// The cycles in order.
    pub cycles: Vec<CycleRecord>,
}

impl Record {
    /// The record of a task that wrote these files.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub(super) fn new(folder: &RunFolder, run: u64, files: &[&Path], content: Content) -> Result<Record> {
        let entry = |path: &&Path| {
            let relative = path.strip_prefix(folder.root()).unwrap_or(path);
            let path_text = relative.to_str().ok_or_else(|| Error::file(path, "not a name in UTF-8"))?;
            Ok(FileEntry { path: path_text.to_owned(), content: fingerprint_file(path)? })
        };
        let files = files.iter().map(entry).collect::<Result<_>>()?;
        Ok(Record { run: text(run), files, content })
    }

    /// Reads the record of a task; `None` where there is none of this run.
    pub(super) fn read(folder: &RunFolder, run: u64, task: Task) -> Option<Record> {
        let record = Record::parse(&std::fs::read(folder.record(task)).ok()?)?;
        (record.run == text(run)).then_some(record)
    }

    /// The record in the bytes of a file: a line of JSON, and the XXH3 of that line. `None` for anything
    /// else, and where a path leads out of the run's folder: files are removed by these paths.
    pub(super) fn parse(bytes: &[u8]) -> Option<Record> {
        let (line, hash) = std::str::from_utf8(bytes).ok()?.split_once('\n')?;
        let record: Record = serde_json::from_str(line).ok()?;
        let is_whole = hash == text(xxh3_64(line.as_bytes()));
        (is_whole && record.files.iter().all(|file| stays_inside(&file.path))).then_some(record)
    }

    pub(super) fn write(&self, path: &Path) -> Result<()> {
        write_file(path, |out| {
            let line = serde_json::to_string(self)?;
            write!(out, "{line}\n{}", text(xxh3_64(line.as_bytes())))
        })
    }

    /// What is wrong with the files of the task but those that may be gone; reads all of them.
    ///
    /// # Errors
    /// A file that is missing, truncated or otherwise changed, named.
    pub(super) fn verify(&self, folder: &RunFolder, may_be_gone: &[PathBuf]) -> Result<()> {
        self.files.iter().try_for_each(|file| {
            let path = folder.root().join(&file.path);
            if may_be_gone.contains(&path) && !path.exists() {
                return Ok(());
            }
            let found = fingerprint_file(&path)?;
            if found == file.content {
                return Ok(());
            }
            let problem = match found.bytes == file.content.bytes {
                true => "damaged: its content is not what the run wrote".to_owned(),
                false => format!("{} bytes; the run wrote {}", found.bytes, file.content.bytes),
            };
            Err(Error::file(path, problem))
        })
    }

    /// Removes the files of the task.
    pub(super) fn remove_files(&self, folder: &RunFolder) {
        for file in &self.files {
            // What cannot be removed is replaced later.
            let _ = std::fs::remove_file(folder.root().join(&file.path));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::fingerprint;

    fn bytes_of(path: &str) -> Vec<u8> {
        let files = vec![FileEntry { path: path.to_owned(), content: fingerprint(b"content") }];
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("record.json");
        Record { run: text(7), files, content: Content::Next(Some(3)) }.write(&file).unwrap();
        std::fs::read(file).unwrap()
    }

    #[test]
    fn a_record_is_read_as_it_was_written_and_not_if_any_bit_differs() {
        let bytes = bytes_of("stereo/depth_maps/left/1.jpg.geometric.bin");
        assert_eq!(Record::parse(&bytes).unwrap().content, Content::Next(Some(3)));
        for bit in 0..8 * bytes.len() {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Record::parse(&damaged), None, "bit {bit}");
        }
        assert_eq!(Record::parse(&bytes[..bytes.len() - 1]), None);
        assert_eq!(Record::parse(b""), None);
    }

    #[test]
    fn a_record_of_files_outside_of_the_folder_is_none() {
        for path in ["/etc/passwd", "../other/fused.ply", "stereo/../../x", "", "a\0b"] {
            assert_eq!(Record::parse(&bytes_of(path)), None, "{path}");
        }
    }
}
