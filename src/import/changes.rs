//! What becomes of the photographs of a scene, each on its way from its file into the run.

use super::photograph::Change;
use super::{SourcePhotograph, SourceScene};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::Picture;
use crate::io::{
    cannot_be_read, deep_picture_from_bytes, largest_value, opaque_pixels, picture_from_bytes,
    picture_header, read_mask,
};
use crate::memory::require_memory;
use crate::options::InputOptions;
use rayon::prelude::*;
use std::path::Path;

/// How the photographs of a scene are changed.
pub(super) struct Changes<'a> {
    source: &'a SourceScene,
    alpha_mask: bool,
    /// The value of white in photographs of 16 bits.
    white: u16,
    changes: Vec<Change>,
}

impl<'a> Changes<'a> {
    /// From the headers of the photographs; calls `before` before the work on each, on several threads.
    ///
    /// # Errors
    /// A photograph that is missing, damaged or not of its camera's size; a lens that cannot be undistorted;
    /// what `before` returns.
    pub(super) fn new(
        source: &'a SourceScene,
        options: &InputOptions,
        before: &(dyn Fn(usize) -> Result<()> + Sync),
    ) -> Result<Changes<'a>> {
        let white = white_level(source, before)?;
        let changes = changes(source, options.max_image_size)?;
        Ok(Changes { source, alpha_mask: options.alpha_mask, white, changes })
    }

    /// The photographs' changes in shape.
    pub(super) fn shapes(&self) -> &[Change] {
        &self.changes
    }

    /// Whether all photographs stay as they are.
    pub(super) fn are_none(&self) -> bool {
        !self.alpha_mask && self.white == u16::MAX && self.changes.iter().all(Change::is_none)
    }

    /// A warning if values of 16 bits are scaled.
    pub(super) fn warning(&self) -> Option<String> {
        let white = self.white;
        (white != u16::MAX).then(|| {
            format!(
                "the photographs have 16 bits a channel, but no value above {white}: {white} is taken as \
                 white"
            )
        })
    }

    /// The results of some work on every photograph, in their order, as many at a time as fit into a memory
    /// while they are changed.
    ///
    /// # Errors
    /// Less memory than the change of one takes.
    pub(super) fn each<T: Send>(&self, memory: u64, work: &(dyn Fn(usize) -> T + Sync)) -> Result<Vec<T>> {
        let largest = self.changes.iter().map(Change::memory).max().unwrap_or(0);
        require_memory(largest, "the change of a photograph")?;
        let at_a_time = (memory / largest.max(1)).clamp(1, rayon::current_num_threads() as u64) as usize;
        let views: Vec<usize> = (0..self.changes.len()).collect();
        let in_turns = views.chunks(views.len().div_ceil(at_a_time).max(1)).collect::<Vec<_>>();
        let one_by_one = |part: &[usize]| part.iter().map(|&view| work(view)).collect::<Vec<T>>();
        Ok(in_turns.into_par_iter().with_max_len(1).flat_map_iter(one_by_one).collect())
    }

    /// Everything that the changed photograph of a view depends on besides the files, as a text.
    pub(super) fn key(&self, view: usize) -> String {
        format!("{:?} {} {}", self.changes[view], self.alpha_mask, self.white)
    }

    /// The changed photograph of a view from the content of its file, and whether the file has it already.
    ///
    /// # Errors
    /// A damaged file.
    pub(super) fn picture(&self, view: usize, bytes: &[u8]) -> Result<(Picture, bool)> {
        let (photograph, change) = (&self.source.photographs[view], &self.changes[view]);
        let is_deep = self.white != u16::MAX && picture_header(&photograph.path)?.is_deep;
        let picture = match is_deep {
            true => deep_picture_from_bytes(bytes, &photograph.path, self.white)?,
            false => picture_from_bytes(bytes, &photograph.path)?,
        };
        match change.is_none() {
            true => Ok((picture, !is_deep)),
            false => Ok((change.apply(&picture)?, false)),
        }
    }

    /// The mask of the changed photograph of a view; `None` where nothing is ignored.
    ///
    /// # Errors
    /// A mask that is missing, damaged or of another size; a damaged photograph.
    pub(super) fn mask(&self, view: usize, bytes: &[u8]) -> Result<Option<Vec<bool>>> {
        let (photograph, change) = (&self.source.photographs[view], &self.changes[view]);
        let Camera { width, height, .. } = photograph.lens.camera;
        let mut own = photograph.mask.as_deref().map(|path| read_mask(path, (width, height))).transpose()?;
        if self.alpha_mask
            && let Some(opaque) = opaque_pixels(bytes, &photograph.path, (width, height))?
        {
            own = Some(match own {
                Some(mask) => mask.iter().zip(&opaque).map(|(&a, &b)| a && b).collect(),
                None => opaque,
            });
        }
        if own.is_none() && photograph.lens.distortion.is_none() {
            return Ok(None);
        }
        let mask = change.mask(own.as_deref());
        Ok((!mask.iter().all(|&is_known| is_known)).then_some(mask))
    }
}

/// The content of a file.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|error| cannot_be_read(path, error))
}

/// How each photograph is changed.
///
/// # Errors
/// A photograph that is not of its camera's size; a lens that cannot be undistorted.
fn changes(source: &SourceScene, max_size: u32) -> Result<Vec<Change>> {
    let change = |photograph: &SourcePhotograph| {
        let size = picture_header(&photograph.path)?.size;
        let Camera { width, height, .. } = photograph.lens.camera;
        if size != (width, height) {
            let expected = format!("{width}x{height}, the size of its camera in {}", source.origin);
            let problem = format!("the picture is {}x{}; expected {expected}", size.0, size.1);
            return Err(Error::file(&photograph.path, problem));
        }
        Change::new(photograph.lens, max_size, &photograph.name)
    };
    source.photographs.par_iter().with_max_len(1).map(change).collect()
}

/// The value of white in photographs of 16 bits: the largest of the usual ones that is needed for all of
/// them, since cameras and converters store 10, 12 or 14 bits in 16.
fn white_level(source: &SourceScene, before: &(dyn Fn(usize) -> Result<()> + Sync)) -> Result<u16> {
    let largest = |(view, photograph): (usize, &SourcePhotograph)| -> Result<Option<u16>> {
        before(view)?;
        if !photograph.path.is_file() {
            return Err(missing(source, photograph));
        }
        if !picture_header(&photograph.path)?.is_deep {
            return Ok(None);
        }
        let bytes = read(&photograph.path)?;
        largest_value(&bytes, &photograph.path).map(Some)
    };
    let all: Vec<Option<u16>> =
        source.photographs.par_iter().enumerate().with_max_len(1).map(largest).collect::<Result<_>>()?;
    let Some(largest) = all.iter().flatten().max() else { return Ok(u16::MAX) };
    let levels = [8, 10, 12, 14].map(|bits| (1u16 << bits) - 1);
    Ok(levels.into_iter().find(|level| largest <= level).unwrap_or(u16::MAX))
}

fn missing(source: &SourceScene, photograph: &SourcePhotograph) -> Error {
    let problem = format!("no such file; {} has a photograph of this name", source.origin);
    Error::file(&photograph.path, problem)
}
