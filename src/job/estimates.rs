//! Estimates between tasks: in files, with those used last in memory.
//!
//! A file is the name of its run (8 bytes), the estimate as [`AnyEstimate::to_bytes`] gives it, and the XXH3
//! of both (8 bytes).

use super::folder::RunFolder;
use crate::error::{Error, Result};
use crate::io::{cannot_be_read, write_file};
use crate::memory::Cache;
use crate::pipeline::{AnyEstimate, Checked, Searched, Stepper, ViewEstimate};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3;

/// The estimates of a run.
#[derive(Debug)]
pub(super) struct Estimates {
    folder: RunFolder,
    run: u64,
    searched: Cache<(usize, usize), ViewEstimate<Searched>>,
    checked: Cache<(usize, usize), ViewEstimate<Checked>>,
    /// Checked estimates on the scale of a cycle, upsampled from the scale before.
    upsampled: Cache<(usize, usize), ViewEstimate<Checked>>,
}

/// Bytes of an estimate in memory for each pixel: planes and the published surface.
pub(super) const BYTES_PER_PIXEL: usize = 28;

impl Estimates {
    /// The estimates of a run, of which up to `limit` bytes are kept in memory.
    pub(super) fn new(folder: &RunFolder, run: u64, limit: usize) -> Estimates {
        // Two kinds are in use at any time.
        let cache = limit / 2;
        Estimates {
            folder: folder.clone(),
            run,
            searched: Cache::new(cache),
            checked: Cache::new(cache),
            upsampled: Cache::new(cache),
        }
    }

    /// Writes a searched estimate and returns its file.
    pub(super) fn put_searched(&self, found: ViewEstimate<Searched>) -> Result<PathBuf> {
        let key = (found.cycle(), found.view());
        let path = self.write(key, "searched", &found.to_bytes())?;
        let bytes = found.pixels() * BYTES_PER_PIXEL;
        self.searched.insert(key, Arc::new(found), bytes);
        Ok(path)
    }

    /// Writes a checked estimate and returns its file.
    pub(super) fn put_checked(&self, found: ViewEstimate<Checked>) -> Result<PathBuf> {
        let key = (found.cycle(), found.view());
        let path = self.write(key, "checked", &found.to_bytes())?;
        let bytes = found.pixels() * BYTES_PER_PIXEL;
        self.checked.insert(key, Arc::new(found), bytes);
        Ok(path)
    }

    /// The searched estimate of a view in a cycle.
    ///
    /// # Errors
    /// A file that is missing, damaged or of another run.
    pub(super) fn searched(
        &self,
        stepper: &Stepper,
        cycle: usize,
        view: usize,
    ) -> Result<Arc<ViewEstimate<Searched>>> {
        if let Some(found) = self.searched.get((cycle, view)) {
            return Ok(found);
        }
        let path = self.folder.estimate(cycle, view, "searched");
        match self.read(stepper, &path)? {
            AnyEstimate::Searched(found) if (found.cycle(), found.view()) == (cycle, view) => {
                let found = Arc::new(found);
                self.searched.insert((cycle, view), found.clone(), found.pixels() * BYTES_PER_PIXEL);
                Ok(found)
            }
            _ => Err(misplaced(&path)),
        }
    }

    /// The checked estimate of a view in a cycle.
    ///
    /// # Errors
    /// A file that is missing, damaged or of another run.
    pub(super) fn checked(
        &self,
        stepper: &Stepper,
        cycle: usize,
        view: usize,
    ) -> Result<Arc<ViewEstimate<Checked>>> {
        if let Some(found) = self.checked.get((cycle, view)) {
            return Ok(found);
        }
        let path = self.folder.estimate(cycle, view, "checked");
        match self.read(stepper, &path)? {
            AnyEstimate::Checked(found) if (found.cycle(), found.view()) == (cycle, view) => {
                let found = Arc::new(found);
                self.checked.insert((cycle, view), found.clone(), found.pixels() * BYTES_PER_PIXEL);
                Ok(found)
            }
            _ => Err(misplaced(&path)),
        }
    }

    /// The checked estimate of a view in a cycle, on the scale of a later one.
    ///
    /// # Errors
    /// A file that is missing, damaged or of another run.
    pub(super) fn checked_for(
        &self,
        stepper: &Stepper,
        (cycle, view): (usize, usize),
        later: usize,
    ) -> Result<Arc<ViewEstimate<Checked>>> {
        let scale = |cycle: usize| stepper.cycles()[cycle].scale_index;
        if scale(cycle) == scale(later) {
            return self.checked(stepper, cycle, view);
        }
        if let Some(found) = self.upsampled.get((later, view)) {
            return Ok(found);
        }
        let found = Arc::new(stepper.upsample(later, &*self.checked(stepper, cycle, view)?)?);
        self.upsampled.insert((later, view), found.clone(), found.pixels() * BYTES_PER_PIXEL);
        Ok(found)
    }

    /// Removes what no task reads once all views are checked in a cycle: all but its checked estimates.
    pub(super) fn remove_before_check(&self, cycle: usize) {
        self.searched.forget(|&(of, _)| of <= cycle);
        self.checked.forget(|&(of, _)| of < cycle);
        self.upsampled.forget(|&(of, _)| of <= cycle);
        for entry in std::fs::read_dir(self.folder.estimates()).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let Some((of, stage)) = name.to_str().and_then(parse_name) else { continue };
            if of < cycle || of == cycle && stage == "searched" {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Removes all files.
    pub(super) fn remove_all(&self) {
        self.searched.forget(|_| true);
        self.checked.forget(|_| true);
        self.upsampled.forget(|_| true);
        let _ = std::fs::remove_dir_all(self.folder.estimates());
    }

    fn write(&self, (cycle, view): (usize, usize), stage: &str, bytes: &[u8]) -> Result<PathBuf> {
        let path = self.folder.estimate(cycle, view, stage);
        let run = self.run.to_le_bytes();
        let mut hash = Xxh3::new();
        hash.update(&run);
        hash.update(bytes);
        write_file(&path, |out| {
            out.write_all(&run)?;
            out.write_all(bytes)?;
            out.write_all(&hash.digest().to_le_bytes())
        })?;
        Ok(path)
    }

    fn read(&self, stepper: &Stepper, path: &Path) -> Result<AnyEstimate> {
        let bytes = std::fs::read(path).map_err(|error| cannot_be_read(path, error))?;
        let damaged = || Error::file(path, "damaged: not what the run wrote");
        let (content, hash) = bytes.split_last_chunk::<8>().ok_or_else(damaged)?;
        let (run, estimate) = content.split_first_chunk::<8>().ok_or_else(damaged)?;
        let mut own = Xxh3::new();
        own.update(content);
        if own.digest().to_le_bytes() != *hash {
            return Err(damaged());
        }
        if *run != self.run.to_le_bytes() {
            return Err(Error::file(path, "of another run"));
        }
        AnyEstimate::from_bytes(stepper, estimate).map_err(|error| Error::file(path, error))
    }
}

fn misplaced(path: &Path) -> Error {
    Error::file(path, "the estimate of another view, cycle or stage")
}

/// The cycle and stage of an estimate's file.
fn parse_name(name: &str) -> Option<(usize, &str)> {
    let (cycle, rest) = name.strip_prefix("cycle")?.split_once('-')?;
    let (_, stage) = rest.split_once('.')?;
    Some((cycle.parse().ok()?, stage))
}
