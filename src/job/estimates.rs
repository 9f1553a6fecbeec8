//! Estimates between tasks: in files, with those used last in memory.
//!
//! ```text
//! cycle00-00003.searched   run, an estimate as its `to_bytes` gives it, XXH3 of both
//! cycle00-00003.checked    the same
//! cycle00-00003.surface    run, cycle, view, the published planes, XXH3 of all that
//! ```
//!
//! Run, cycle, view and XXH3 take eight bytes each. A surface is a file of its own since most views that read
//! an estimate read nothing else of it.

use super::folder::RunFolder;
use crate::error::{Error, Result};
use crate::io::{cannot_be_read, write_file};
use crate::memory::Cache;
use crate::pipeline::{
    Checked, CheckedEstimates, CheckedPlanes, ReadEstimate, Searched, Stepper, ViewEstimate,
};
use crate::scene::CompactPlane;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3;

/// The estimates of a run.
#[derive(Debug)]
pub(super) struct Estimates {
    folder: RunFolder,
    run: u64,
    kept: Cache<Key, Kept>,
}

/// Bytes in memory for each pixel of the planes of a checked estimate.
pub(super) const PLANE_BYTES: u64 = 20;
/// Bytes in memory for each pixel of a published surface.
pub(super) const SURFACE_BYTES: u64 = 8;

/// A part of the estimate of a view on the scale of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    part: Part,
    cycle: usize,
    view: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Part {
    Searched,
    Planes,
    Surface,
    /// Planes of the scale before, upsampled.
    UpsampledPlanes,
    UpsampledSurface,
}

enum Kept {
    Searched(Arc<ViewEstimate<Searched>>),
    Planes(Arc<ViewEstimate<CheckedPlanes>>),
    Surface(Arc<Vec<CompactPlane>>),
}

impl Estimates {
    /// The estimates of a run, of which up to `limit` bytes are kept in memory.
    pub(super) fn new(folder: &RunFolder, run: u64, limit: usize) -> Estimates {
        Estimates { folder: folder.clone(), run, kept: Cache::new(limit) }
    }

    /// Writes a searched estimate and returns its file.
    pub(super) fn put_searched(&self, found: ViewEstimate<Searched>) -> Result<PathBuf> {
        let key = Key { part: Part::Searched, cycle: found.cycle(), view: found.view() };
        let path = self.write(key, |out| found.write_to(out))?;
        self.keep_searched(key, found);
        Ok(path)
    }

    /// Writes a checked estimate and returns its files.
    pub(super) fn put_checked(&self, found: ViewEstimate<Checked>) -> Result<Vec<PathBuf>> {
        let (cycle, view) = (found.cycle(), found.view());
        let (planes, surface) = found.without_surface();
        let key = |part| Key { part, cycle, view };
        let planes_path = self.write(key(Part::Planes), |out| planes.write_to(out))?;
        let surface_path = self.write(key(Part::Surface), |out| {
            [cycle, view].iter().try_for_each(|&number| out.write_all(&(number as u64).to_le_bytes()))?;
            surface.iter().try_for_each(|plane| out.write_all(&plane.to_bytes()))
        })?;
        self.keep_planes(key(Part::Planes), planes);
        self.keep_surface(key(Part::Surface), surface);
        Ok(vec![planes_path, surface_path])
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
        let key = Key { part: Part::Searched, cycle, view };
        if let Some(Kept::Searched(found)) = self.kept.get(key).as_deref() {
            return Ok(found.clone());
        }
        match self.read_estimate(stepper, key)? {
            ReadEstimate::Searched(found) if (found.cycle(), found.view()) == (cycle, view) => {
                Ok(self.keep_searched(key, found))
            }
            _ => Err(self.misplaced(key)),
        }
    }

    /// The checked planes of a view in a cycle.
    ///
    /// # Errors
    /// A file that is missing, damaged or of another run.
    pub(super) fn planes(
        &self,
        stepper: &Stepper,
        cycle: usize,
        view: usize,
    ) -> Result<Arc<ViewEstimate<CheckedPlanes>>> {
        let key = Key { part: Part::Planes, cycle, view };
        if let Some(found) = self.kept_planes(key) {
            return Ok(found);
        }
        match self.read_estimate(stepper, key)? {
            ReadEstimate::Checked(found) if (found.cycle(), found.view()) == (cycle, view) => {
                Ok(self.keep_planes(key, found))
            }
            _ => Err(self.misplaced(key)),
        }
    }

    /// The surface that a view published in a cycle.
    ///
    /// # Errors
    /// A file that is missing, damaged or of another run.
    pub(super) fn surface(
        &self,
        stepper: &Stepper,
        cycle: usize,
        view: usize,
    ) -> Result<Arc<Vec<CompactPlane>>> {
        let key = Key { part: Part::Surface, cycle, view };
        if let Some(found) = self.kept_surface(key) {
            return Ok(found);
        }
        let mut file = self.open(key)?;
        let (width, height) = stepper.size(cycle, view)?;
        let pixels = width as usize * height as usize;
        if file.remaining != 16 + 8 * pixels as u64 {
            return Err(file.damaged());
        }
        let mut place = [0; 16];
        file.read(&mut place)?;
        if place[..8] != (cycle as u64).to_le_bytes() || place[8..] != (view as u64).to_le_bytes() {
            return Err(self.misplaced(key));
        }
        let mut bytes = vec![0; 8 * pixels];
        file.read(&mut bytes)?;
        file.finish()?;
        let planes = bytes.par_chunks_exact(8).with_min_len(1 << 12);
        let surface = planes.map(|bytes| CompactPlane::from_bytes(bytes.try_into().unwrap_or_default()));
        Ok(self.keep_surface(key, surface.collect()))
    }

    /// The checked estimates of a cycle, on the scale of a later one.
    pub(super) fn checked<'a>(&'a self, stepper: &'a Stepper, cycle: usize, later: usize) -> CheckedAt<'a> {
        let scale = |cycle: usize| stepper.cycles()[cycle].scale_index;
        let upsampled_to = (scale(cycle) != scale(later)).then_some(later);
        CheckedAt { estimates: self, stepper, cycle, upsampled_to }
    }

    /// Removes what no task reads once all views are checked in a cycle: all but its checked estimates.
    pub(super) fn remove_before_check(&self, cycle: usize) {
        let stays = |part| matches!(part, Part::Planes | Part::Surface);
        self.kept.forget(|key| key.cycle < cycle || key.cycle == cycle && !stays(key.part));
        for entry in std::fs::read_dir(self.folder.estimates()).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let Some((of, stage)) = name.to_str().and_then(parse_name) else { continue };
            if of < cycle || of == cycle && stage == "searched" {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Frees the estimates in memory.
    pub(super) fn forget(&self) {
        self.kept.forget(|_| true);
    }

    /// Removes all files.
    pub(super) fn remove_all(&self) {
        self.forget();
        let _ = std::fs::remove_dir_all(self.folder.estimates());
    }

    fn kept_planes(&self, key: Key) -> Option<Arc<ViewEstimate<CheckedPlanes>>> {
        match self.kept.get(key).as_deref() {
            Some(Kept::Planes(found)) => Some(found.clone()),
            _ => None,
        }
    }

    fn kept_surface(&self, key: Key) -> Option<Arc<Vec<CompactPlane>>> {
        match self.kept.get(key).as_deref() {
            Some(Kept::Surface(found)) => Some(found.clone()),
            _ => None,
        }
    }

    fn keep_searched(&self, key: Key, found: ViewEstimate<Searched>) -> Arc<ViewEstimate<Searched>> {
        let bytes = found.pixels() * (PLANE_BYTES as usize + 4 * found.view_sets().words_per_pixel());
        let found = Arc::new(found);
        self.kept.insert(key, Arc::new(Kept::Searched(found.clone())), bytes);
        found
    }

    fn keep_planes(&self, key: Key, found: ViewEstimate<CheckedPlanes>) -> Arc<ViewEstimate<CheckedPlanes>> {
        let bytes = found.pixels() * PLANE_BYTES as usize;
        let found = Arc::new(found);
        self.kept.insert(key, Arc::new(Kept::Planes(found.clone())), bytes);
        found
    }

    fn keep_surface(&self, key: Key, found: Vec<CompactPlane>) -> Arc<Vec<CompactPlane>> {
        let bytes = found.len() * SURFACE_BYTES as usize;
        let found = Arc::new(found);
        self.kept.insert(key, Arc::new(Kept::Surface(found.clone())), bytes);
        found
    }

    fn path(&self, key: Key) -> PathBuf {
        let stage = match key.part {
            Part::Searched => "searched",
            Part::Planes | Part::UpsampledPlanes => "checked",
            Part::Surface | Part::UpsampledSurface => "surface",
        };
        self.folder.estimate(key.cycle, key.view, stage)
    }

    fn misplaced(&self, key: Key) -> Error {
        Error::file(self.path(key), "the estimate of another view, cycle or stage")
    }

    fn write(&self, key: Key, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<PathBuf> {
        let path = self.path(key);
        write_file(&path, |out| {
            let mut out = HashedWriter { out, hash: Xxh3::new() };
            out.write_all(&self.run.to_le_bytes())?;
            content(&mut out)?;
            let hash = out.hash.digest();
            out.out.write_all(&hash.to_le_bytes())
        })?;
        Ok(path)
    }

    fn open(&self, key: Key) -> Result<HashedFile> {
        HashedFile::open(self.path(key), self.run)
    }

    fn read_estimate(&self, stepper: &Stepper, key: Key) -> Result<ReadEstimate> {
        let mut file = self.open(key)?;
        let length = usize::try_from(file.remaining).unwrap_or(usize::MAX);
        // What does not come from the file itself says what is wrong with its content.
        let found = ReadEstimate::read(stepper, length, |buffer| file.read(buffer));
        let found = found.map_err(|error| match error {
            Error::File { .. } => error,
            other => Error::file(&file.path, format!("damaged: not what the run wrote ({other})")),
        })?;
        file.finish()?;
        Ok(found)
    }
}

/// The checked estimates of a cycle, on its own scale or upsampled to that of a later cycle.
pub(super) struct CheckedAt<'a> {
    estimates: &'a Estimates,
    stepper: &'a Stepper,
    cycle: usize,
    /// A cycle of the next finer scale.
    upsampled_to: Option<usize>,
}

impl CheckedEstimates for CheckedAt<'_> {
    fn planes(&self, view: usize) -> Result<Arc<ViewEstimate<CheckedPlanes>>> {
        let own = || self.estimates.planes(self.stepper, self.cycle, view);
        let Some(cycle) = self.upsampled_to else { return own() };
        let key = Key { part: Part::UpsampledPlanes, cycle, view };
        match self.estimates.kept_planes(key) {
            Some(found) => Ok(found),
            None => Ok(self.estimates.keep_planes(key, self.stepper.upsample_planes(cycle, &*own()?))),
        }
    }

    fn surface(&self, view: usize) -> Result<Arc<Vec<CompactPlane>>> {
        let Some(cycle) = self.upsampled_to else {
            return self.estimates.surface(self.stepper, self.cycle, view);
        };
        let key = Key { part: Part::UpsampledSurface, cycle, view };
        if let Some(found) = self.estimates.kept_surface(key) {
            return Ok(found);
        }
        let own = self.estimates.planes(self.stepper, self.cycle, view)?;
        let surface = self.stepper.surface_of(&self.stepper.upsample_planes(cycle, &own));
        Ok(self.estimates.keep_surface(key, surface))
    }
}

/// Hashes what is written.
struct HashedWriter<'a, W> {
    out: &'a mut W,
    hash: Xxh3,
}

impl<W: Write> Write for HashedWriter<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// A file that ends with the hash of its content.
struct HashedFile {
    path: PathBuf,
    file: File,
    hash: Xxh3,
    /// Bytes before the hash that are not read yet.
    remaining: u64,
}

impl HashedFile {
    /// Opens a file and reads the name of its run.
    fn open(path: PathBuf, run: u64) -> Result<HashedFile> {
        let opened = File::open(&path).and_then(|file| Ok((file.metadata()?.len(), file)));
        let (length, file) = opened.map_err(|error| cannot_be_read(&path, error))?;
        let mut opened = HashedFile { path, file, hash: Xxh3::new(), remaining: length };
        opened.remaining = length.checked_sub(8).ok_or_else(|| opened.damaged())?;
        let mut own_run = [0; 8];
        opened.read(&mut own_run)?;
        match own_run == run.to_le_bytes() {
            true => Ok(opened),
            false => Err(Error::file(&opened.path, "of another run")),
        }
    }

    fn read(&mut self, buffer: &mut [u8]) -> Result<()> {
        self.remaining = self.remaining.checked_sub(buffer.len() as u64).ok_or_else(|| self.damaged())?;
        self.file.read_exact(buffer).map_err(|error| cannot_be_read(&self.path, error))?;
        self.hash.update(buffer);
        Ok(())
    }

    /// Compares the hash of the content; all of it must have been read.
    fn finish(mut self) -> Result<()> {
        let mut hash = [0; 8];
        self.file.read_exact(&mut hash).map_err(|error| cannot_be_read(&self.path, error))?;
        let is_whole = self.remaining == 0 && self.hash.digest().to_le_bytes() == hash;
        if is_whole { Ok(()) } else { Err(self.damaged()) }
    }

    fn damaged(&self) -> Error {
        damaged(&self.path)
    }
}

fn damaged(path: &Path) -> Error {
    Error::file(path, "damaged: not what the run wrote")
}

/// The cycle and stage of an estimate's file.
fn parse_name(name: &str) -> Option<(usize, &str)> {
    let (cycle, rest) = name.strip_prefix("cycle")?.split_once('-')?;
    let (_, stage) = rest.split_once('.')?;
    Some((cycle.parse().ok()?, stage))
}
