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
use super::estimate::{AnyEstimate, Checked, Searched, ViewEstimate, is_unit};
use super::stepper::Stepper;
use crate::ambc::Counts;
use crate::error::{Error, Result};
use crate::geometry::{Camera, ViewSets};
use crate::scene::{PixelEstimate, PlaneMap};
use glam::Vec3;

/// The first bytes of every estimate; the last is the version of the layout.
const MAGIC: [u8; 8] = *b"skepst\0\x02";
/// Numbers of the header and the counts.
const HEADER: usize = 9;
/// Numbers of a record.
const RECORD: usize = 6;
/// Bytes of a pixel without its view set.
const PIXEL: usize = 22;
/// The codes of the stages in the header.
const SEARCHED: u64 = 0;
const CHECKED: u64 = 1;

impl ViewEstimate<Searched> {
    /// The estimate as bytes, which [`AnyEstimate::from_bytes`] of the same version of the crate reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        to_bytes(self, SEARCHED, Some(self.view_sets()))
    }

    /// Length of [`ViewEstimate::to_bytes`].
    pub fn byte_len(&self) -> usize {
        byte_len(self.pixels(), self.view_sets().words_per_pixel(), self.cycles.len())
    }
}

impl ViewEstimate<Checked> {
    /// The estimate as bytes, which [`AnyEstimate::from_bytes`] of the same version of the crate reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        to_bytes(self, CHECKED, None)
    }

    /// Length of [`ViewEstimate::to_bytes`].
    pub fn byte_len(&self) -> usize {
        byte_len(self.pixels(), 0, self.cycles.len())
    }
}

fn to_bytes<S>(estimate: &ViewEstimate<S>, stage: u64, view_sets: Option<&ViewSets>) -> Vec<u8> {
    let ViewEstimate { at, map, counts, cycles, .. } = estimate;
    let words = view_sets.map_or(0, ViewSets::words_per_pixel);
    let mut bytes = Vec::with_capacity(byte_len(map.planes.len(), words, cycles.len()));
    let mut put = |part: &[u8]| bytes.extend_from_slice(part);
    put(&MAGIC);
    let sizes = [map.planes.len(), words, cycles.len()].map(|size| size as u64);
    let [pixels, words, records] = sizes;
    for number in [at.view as u64, at.cycle as u64, stage, pixels, words, records] {
        put(&number.to_le_bytes());
    }
    for count in [counts.ncc_evaluations, counts.bilinear_samples, counts.early_terminations] {
        put(&count.to_le_bytes());
    }
    for record in cycles {
        let CycleRecord { downscale, cycle, pixels, changed, validated, median_residual } = *record;
        let median_residual = median_residual.to_bits();
        for number in [u64::from(downscale), u64::from(cycle), pixels, changed, validated, median_residual] {
            put(&number.to_le_bytes());
        }
    }
    for (pixel, plane) in map.planes.iter().enumerate() {
        let PixelEstimate { depth, normal, cost, consistent_views, validated } = *plane;
        for number in [depth, normal.x, normal.y, normal.z, cost.into()] {
            put(&number.to_le_bytes());
        }
        put(&[consistent_views, u8::from(validated)]);
        for word in view_sets.map_or(&[][..], |sets| sets.words_of(pixel)) {
            put(&word.to_le_bytes());
        }
    }
    bytes
}

impl AnyEstimate {
    /// Reads an estimate from its bytes.
    ///
    /// # Errors
    /// Bytes that are not an estimate or are truncated; an estimate of another scene or other options where
    /// this is detectable: a view, cycle or size that does not exist; values that are not valid in an
    /// estimate.
    pub fn from_bytes(stepper: &Stepper, bytes: &[u8]) -> Result<AnyEstimate> {
        let mut reader = Reader { rest: bytes };
        if reader.take::<8>() != Some(MAGIC) {
            return Err(error("not an estimate of this version", "bytes saved by this version"));
        }
        let mut header = [0; HEADER];
        for number in &mut header {
            *number =
                reader.u64().ok_or_else(|| error("truncated in the header", "all bytes of an estimate"))?;
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
        if records > most_records || bytes.len() != byte_len(pixels, words, records) {
            let expected = format!("{} bytes", byte_len(pixels, words, records.min(most_records)));
            return Err(error(format!("{} bytes", bytes.len()), expected));
        }
        // The length was checked: none of the reads below fails.
        let cycles = (0..records).map(|_| reader.record()).collect::<Result<_>>()?;
        let mut view_sets = ViewSets::empty(pixels, sources);
        let mut planes = Vec::with_capacity(pixels);
        for pixel in 0..pixels {
            planes.push(reader.plane(stage == CHECKED).ok_or_else(|| {
                let place = format!("column {}, row {}", pixel % width as usize, pixel / width as usize);
                error(format!("an estimate with an invalid plane at {place}"), "undamaged bytes")
            })?);
            for word in 0..words {
                let bits = u32::from_le_bytes(reader.take().unwrap_or([0; 4]));
                for source in (word * 32..word * 32 + 32).filter(|source| bits >> (source % 32) & 1 != 0) {
                    if source >= sources {
                        let value = format!("a view set with source {source} at pixel {pixel}");
                        return Err(error(value, format!("sources below their number, {sources}")));
                    }
                    view_sets.insert(pixel, source);
                }
            }
        }
        let counts = Counts { ncc_evaluations, bilinear_samples, early_terminations };
        let map = PlaneMap { planes };
        if stage == SEARCHED {
            let stage = Searched { view_sets };
            return Ok(AnyEstimate::Searched(ViewEstimate { at, map, counts, cycles, stage }));
        }
        let surface = map.publish(&stepper.context().scaled(at).camera);
        let stage = Checked { surface };
        Ok(AnyEstimate::Checked(ViewEstimate { at, map, counts, cycles, stage }))
    }
}

fn error(value: impl Into<String>, expected: impl Into<String>) -> Error {
    Error::argument("bytes", value.into(), expected)
}

fn byte_len(pixels: usize, words: usize, records: usize) -> usize {
    let header = MAGIC.len() + 8 * HEADER;
    let records = records.saturating_mul(8 * RECORD);
    header.saturating_add(records).saturating_add(pixels.saturating_mul(PIXEL + 4 * words))
}

/// Reads numbers from the front of a byte slice.
struct Reader<'a> {
    rest: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*taken)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    fn record(&mut self) -> Result<CycleRecord> {
        let record = [(); RECORD - 1].map(|()| self.u64().unwrap_or(0));
        // No scale has more pixels, so that sums of these never overflow.
        let most = u64::from(Camera::MAX_SIDE).pow(2);
        if record.iter().any(|&number| number > most) {
            return Err(error(format!("a cycle of {record:?}"), "numbers of pixels in an image"));
        }
        let median_residual = self.take().map_or(0.0, f64::from_le_bytes);
        if !(median_residual.is_finite() && median_residual >= 0.0) {
            return Err(error(format!("a median residual of {median_residual}"), "a number of at least 0"));
        }
        let [downscale, cycle, pixels, changed, validated] = record;
        let (downscale, cycle) = (downscale as u32, cycle as u32);
        Ok(CycleRecord { downscale, cycle, pixels, changed, validated, median_residual })
    }

    /// A pixel's plane, `None` if its values are invalid. Only a check validates planes.
    fn plane(&mut self, is_checked: bool) -> Option<PixelEstimate> {
        let [depth, x, y, z, cost] = [(); 5].map(|()| self.f32().unwrap_or(0.0));
        let [consistent_views, validated] = self.take::<2>().unwrap_or([0; 2]);
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
}
