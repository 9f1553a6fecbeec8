//! Estimates as bytes, for a scheduler that sends them between machines or saves them across a restart.
//!
//! ```text
//! magic, version   8 bytes
//! header           view, cycle, stage (0 searched, 1 checked), pixels, words of a view set, records: u64
//! counts           ncc_evaluations, bilinear_samples, early_terminations: u64
//! records          downscale, cycle, pixels, changed, validated: u64, median residual: f64, one for each
//!                  cycle so far
//! pixels           depth, normal x y z, cost: f32; consistent views, validated: u8;
//!                  view set: u32 words (searched only)
//! ```
//!
//! All numbers are little-endian. The published surface of a checked estimate is recomputed from its planes.

use super::cycle::{CycleRecord, Place};
use super::estimate::{AnyEstimate, Checked, CheckedPlanes, Searched, ViewEstimate, is_unit};
use super::stepper::Stepper;
use crate::ambc::Counts;
use crate::error::{Error, Result};
use crate::geometry::{Camera, ViewSets};
use crate::scene::{PixelEstimate, PlaneMap};
use glam::Vec3;
use rayon::prelude::*;
use std::io::{self, Write};

/// The first bytes of every estimate; the last is the version of the layout.
const MAGIC: [u8; 8] = *b"skepst\0\x02";
/// Numbers of the header and the counts.
const HEADER: usize = 9;
/// Numbers of a record.
const RECORD: usize = 6;
/// Bytes of a pixel without its view set.
const PIXEL: usize = 22;
/// Pixels that are written and read at once.
const BLOCK: usize = 1 << 16;
/// The codes of the stages in the header.
const SEARCHED: u64 = 0;
const CHECKED: u64 = 1;

impl ViewEstimate<Searched> {
    /// The estimate as bytes, which [`AnyEstimate::from_bytes`] of the same version of the crate reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        in_memory(self.byte_len(), |out| self.write_to(out))
    }

    /// Length of [`ViewEstimate::to_bytes`].
    pub fn byte_len(&self) -> usize {
        byte_len(self.pixels(), self.view_sets().words_per_pixel(), self.cycles.len())
    }

    /// Writes the bytes of [`ViewEstimate::to_bytes`].
    pub(crate) fn write_to(&self, out: &mut dyn Write) -> io::Result<()> {
        write(self, SEARCHED, Some(self.view_sets()), out)
    }
}

impl ViewEstimate<Checked> {
    /// The estimate as bytes, which [`AnyEstimate::from_bytes`] of the same version of the crate reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        in_memory(self.byte_len(), |out| write(self, CHECKED, None, out))
    }

    /// Length of [`ViewEstimate::to_bytes`].
    pub fn byte_len(&self) -> usize {
        byte_len(self.pixels(), 0, self.cycles.len())
    }
}

#[cfg(feature = "io")]
impl ViewEstimate<CheckedPlanes> {
    /// Writes the bytes of the published estimate's [`ViewEstimate::to_bytes`].
    pub(crate) fn write_to(&self, out: &mut dyn Write) -> io::Result<()> {
        write(self, CHECKED, None, out)
    }
}

fn in_memory(length: usize, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(length);
    // Writing into memory does not fail.
    let _ = write(&mut bytes);
    bytes
}

fn write<S>(
    estimate: &ViewEstimate<S>,
    stage: u64,
    view_sets: Option<&ViewSets>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let ViewEstimate { at, map, counts, cycles, .. } = estimate;
    let words = view_sets.map_or(0, ViewSets::words_per_pixel);
    out.write_all(&MAGIC)?;
    let sizes = [map.planes.len(), words, cycles.len()].map(|size| size as u64);
    let [pixels, words, records] = sizes;
    for number in [at.view as u64, at.cycle as u64, stage, pixels, words, records] {
        out.write_all(&number.to_le_bytes())?;
    }
    for count in [counts.ncc_evaluations, counts.bilinear_samples, counts.early_terminations] {
        out.write_all(&count.to_le_bytes())?;
    }
    for record in cycles {
        let CycleRecord { downscale, cycle, pixels, changed, validated, median_residual } = *record;
        let median_residual = median_residual.to_bits();
        for number in [u64::from(downscale), u64::from(cycle), pixels, changed, validated, median_residual] {
            out.write_all(&number.to_le_bytes())?;
        }
    }
    let mut block = Vec::new();
    for (index, planes) in map.planes.chunks(BLOCK).enumerate() {
        block.clear();
        let mut put = |part: &[u8]| block.extend_from_slice(part);
        for (place, plane) in planes.iter().enumerate() {
            let PixelEstimate { depth, normal, cost, consistent_views, validated } = *plane;
            for number in [depth, normal.x, normal.y, normal.z, cost.into()] {
                put(&number.to_le_bytes());
            }
            put(&[consistent_views, u8::from(validated)]);
            for word in view_sets.map_or(&[][..], |sets| sets.words_of(index * BLOCK + place)) {
                put(&word.to_le_bytes());
            }
        }
        out.write_all(&block)?;
    }
    Ok(())
}

/// An estimate as it is read: the surface of a checked one is not published yet.
pub(crate) enum ReadEstimate {
    Searched(ViewEstimate<Searched>),
    Checked(ViewEstimate<CheckedPlanes>),
}

impl AnyEstimate {
    /// Reads an estimate from its bytes.
    ///
    /// # Errors
    /// Bytes that are not an estimate or are truncated; an estimate of another scene or other options where
    /// this is detectable: a view, cycle or size that does not exist; values that are not valid in an
    /// estimate.
    pub fn from_bytes(stepper: &Stepper, bytes: &[u8]) -> Result<AnyEstimate> {
        let mut rest = bytes;
        let read = |buffer: &mut [u8]| match rest.split_at_checked(buffer.len()) {
            Some((taken, after)) => {
                buffer.copy_from_slice(taken);
                rest = after;
                Ok(())
            }
            None => Err(error("truncated", "all bytes of an estimate")),
        };
        Ok(match ReadEstimate::read(stepper, bytes.len(), read)? {
            ReadEstimate::Searched(estimate) => AnyEstimate::Searched(estimate),
            ReadEstimate::Checked(estimate) => AnyEstimate::Checked(stepper.publish(estimate)),
        })
    }
}

impl ReadEstimate {
    /// Reads an estimate of this number of bytes; `read` fills a buffer with the next of them.
    ///
    /// # Errors
    /// The errors of [`AnyEstimate::from_bytes`]; what `read` returns.
    pub(crate) fn read(
        stepper: &Stepper,
        length: usize,
        read: impl FnMut(&mut [u8]) -> Result<()>,
    ) -> Result<ReadEstimate> {
        let mut reader = Reader(read);
        if length < MAGIC.len() || reader.take()? != MAGIC {
            return Err(error("not an estimate of this version", "bytes saved by this version"));
        }
        if length < byte_len(0, 0, 0) {
            return Err(error("truncated in the header", "all bytes of an estimate"));
        }
        let mut header = [0; HEADER];
        for number in &mut header {
            *number = reader.u64()?;
        }
        let [
            view,
            cycle,
            stage,
            pixels,
            words,
            records,
            ncc_evaluations,
            bilinear_samples,
            early_terminations,
        ] = header;
        let [view, cycle, pixels, words, records] =
            [view, cycle, pixels, words, records].map(|number| usize::try_from(number).unwrap_or(usize::MAX));
        let at = Place { cycle, view };
        let (width, height) = stepper.size(cycle, view).map_err(|reason| {
            error(
                format!("an estimate of view {view} in cycle {cycle}"),
                format!("one of this stepper ({reason})"),
            )
        })?;
        let sources = stepper.sources(view).len();
        let expected_words =
            if stage == SEARCHED { ViewSets::empty(0, sources).words_per_pixel() } else { 0 };
        if pixels != width as usize * height as usize || words != expected_words || stage > CHECKED {
            let expected = format!("an estimate of {width} x {height} pixels over {sources} source views");
            return Err(error(format!("stage {stage}, {pixels} pixels, {words} words of views"), expected));
        }
        let most_records = stepper.cycles().len();
        if records > most_records || length != byte_len(pixels, words, records) {
            let expected = format!("{} bytes", byte_len(pixels, words, records.min(most_records)));
            return Err(error(format!("{length} bytes"), expected));
        }
        let cycles = (0..records).map(|_| reader.record()).collect::<Result<_>>()?;
        let mut view_sets = ViewSets::empty(if words > 0 { pixels } else { 0 }, sources);
        let mut planes = vec![PixelEstimate::default(); pixels];
        let mut bytes = vec![0; BLOCK.min(pixels) * (PIXEL + 4 * words)];
        for (index, planes) in planes.chunks_mut(BLOCK).enumerate() {
            let bytes = &mut bytes[..planes.len() * (PIXEL + 4 * words)];
            (reader.0)(bytes)?;
            let sets = &mut view_sets.words_mut()[index * BLOCK * words..];
            let invalid = match words {
                0 => read_planes(bytes, planes, stage == CHECKED),
                _ => read_planes_and_sets(bytes, planes, &mut sets[..planes.len() * words], sources),
            };
            if let Some(place) = invalid {
                let (x, y) =
                    ((index * BLOCK + place) % width as usize, (index * BLOCK + place) / width as usize);
                let value = format!("an estimate with an invalid plane or view set at column {x}, row {y}");
                return Err(error(value, "undamaged bytes"));
            }
        }
        let counts = Counts { ncc_evaluations, bilinear_samples, early_terminations };
        let map = PlaneMap { planes };
        Ok(match stage {
            SEARCHED => {
                let stage = Searched { view_sets };
                ReadEstimate::Searched(ViewEstimate { at, map, counts, cycles, stage })
            }
            _ => ReadEstimate::Checked(ViewEstimate { at, map, counts, cycles, stage: CheckedPlanes }),
        })
    }
}

/// Reads planes; returns the place of one that is invalid, if any.
fn read_planes(bytes: &[u8], planes: &mut [PixelEstimate], is_checked: bool) -> Option<usize> {
    let pixels = planes.par_iter_mut().zip(bytes.par_chunks_exact(PIXEL)).with_min_len(MIN_PIXELS);
    pixels.enumerate().find_map_any(|(place, (plane, bytes))| {
        let Some(found) = parse_plane(bytes, is_checked) else { return Some(place) };
        *plane = found;
        None
    })
}

/// Reads the planes of a search and their view sets, of so many sources.
fn read_planes_and_sets(
    bytes: &[u8],
    planes: &mut [PixelEstimate],
    sets: &mut [u32],
    sources: usize,
) -> Option<usize> {
    let words = sets.len() / planes.len();
    let pixels = (planes.par_iter_mut().zip(sets.par_chunks_exact_mut(words)))
        .zip(bytes.par_chunks_exact(PIXEL + 4 * words))
        .with_min_len(MIN_PIXELS);
    pixels.enumerate().find_map_any(|(place, ((plane, set), bytes))| {
        let (own, rest) = bytes.split_at(PIXEL);
        let Some(found) = parse_plane(own, false) else { return Some(place) };
        *plane = found;
        for (word, bytes) in set.iter_mut().zip(rest.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        // No bit beyond the last source.
        let used = (sources - 32 * (words - 1)) as u32;
        let is_valid = set.last().is_none_or(|last| last.checked_shr(used).unwrap_or(0) == 0);
        (!is_valid).then_some(place)
    })
}

/// Pixels that one thread reads at once, at least.
const MIN_PIXELS: usize = 1 << 12;

/// A pixel's plane, `None` if its values are invalid. Only a check validates planes.
fn parse_plane(bytes: &[u8], is_checked: bool) -> Option<PixelEstimate> {
    let (numbers, rest) = bytes.as_chunks::<4>();
    let &[depth, x, y, z, cost] = numbers else { return None };
    let &[consistent_views, validated] = rest else { return None };
    let [depth, x, y, z, cost] = [depth, x, y, z, cost].map(f32::from_le_bytes);
    let normal = Vec3::new(x, y, z);
    let is_usual = depth.is_finite() && depth >= 0.0 && cost >= 0.0 && validated <= u8::from(is_checked);
    let fits = match depth > 0.0 {
        true => is_unit(normal),
        false => normal.is_finite() && validated == 0,
    };
    let validated = validated == 1;
    (is_usual && fits).then_some(PixelEstimate {
        depth,
        normal,
        cost: cost.into(),
        consistent_views,
        validated,
    })
}

fn error(value: impl Into<String>, expected: impl Into<String>) -> Error {
    Error::argument("bytes", value.into(), expected)
}

fn byte_len(pixels: usize, words: usize, records: usize) -> usize {
    let header = MAGIC.len() + 8 * HEADER;
    let records = records.saturating_mul(8 * RECORD);
    header.saturating_add(records).saturating_add(pixels.saturating_mul(PIXEL + 4 * words))
}

/// Reads numbers.
struct Reader<F>(F);

impl<F: FnMut(&mut [u8]) -> Result<()>> Reader<F> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut taken = [0; N];
        (self.0)(&mut taken)?;
        Ok(taken)
    }

    fn u64(&mut self) -> Result<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn record(&mut self) -> Result<CycleRecord> {
        let mut record = [0; RECORD - 1];
        for number in &mut record {
            *number = self.u64()?;
        }
        // No scale has more pixels, so that sums of these never overflow.
        let most = u64::from(Camera::MAX_SIDE).pow(2);
        if record.iter().any(|&number| number > most) {
            return Err(error(format!("a cycle of {record:?}"), "numbers of pixels in an image"));
        }
        let median_residual = self.take().map(f64::from_le_bytes)?;
        if !(median_residual.is_finite() && median_residual >= 0.0) {
            return Err(error(format!("a median residual of {median_residual}"), "a number of at least 0"));
        }
        let [downscale, cycle, pixels, changed, validated] = record;
        let (downscale, cycle) = (downscale as u32, cycle as u32);
        Ok(CycleRecord { downscale, cycle, pixels, changed, validated, median_residual })
    }
}
