//! Estimates as bytes: what a scheduler sends from machine to machine or keeps across a restart.

use super::estimate::{ViewEstimate, is_unit};
use super::stepper::Stepper;
use crate::ambc::Counts;
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::geometry::ViewSets;
use crate::pipeline::CycleRecord;
use crate::scene::{PixelEstimate, PlaneMap};
use glam::Vec3;

/// The first bytes of every estimate; the last is the version of the layout.
const MAGIC: [u8; 8] = *b"skepst\0\x01";

impl ViewEstimate {
    /// The estimate as bytes, all numbers little-endian. Only [`ViewEstimate::from_bytes`] of the same version of the crate is
    /// meant to read them.
    pub fn to_bytes(&self) -> Vec<u8> {
        let PlaneMap { solutions, sets, .. } = &self.solved;
        let words = sets.words_per_pixel();
        let mut bytes = Vec::with_capacity(self.byte_len());
        let mut put = |part: &[u8]| bytes.extend_from_slice(part);
        put(&MAGIC);
        for number in
            [self.view, self.cycle, usize::from(self.marked), solutions.len(), words, self.cycles.len()]
        {
            put(&(number as u64).to_le_bytes());
        }
        let Counts { ncc_evaluations, bilinear_samples, early_terminations } = self.counts;
        for count in [ncc_evaluations, bilinear_samples, early_terminations] {
            put(&count.to_le_bytes());
        }
        for record in &self.cycles {
            let CycleRecord { downscale, cycle, pixels, changed, validated } = *record;
            for number in [u64::from(downscale), u64::from(cycle), pixels, changed, validated] {
                put(&number.to_le_bytes());
            }
        }
        for (pixel, solution) in solutions.iter().enumerate() {
            let PixelEstimate { depth, normal, cost, .. } = *solution;
            for number in [depth, normal.x, normal.y, normal.z, cost.into()] {
                put(&number.to_le_bytes());
            }
            put(&[solution.consistent, u8::from(solution.validated)]);
            for word in sets.words_of(pixel) {
                put(&word.to_le_bytes());
            }
        }
        bytes
    }

    /// Length of [`ViewEstimate::to_bytes`].
    pub fn byte_len(&self) -> usize {
        byte_len(self.pixels(), self.solved.sets.words_per_pixel(), self.cycles.len())
    }

    /// The estimate that gave these bytes.
    ///
    /// # Errors
    /// Bytes that are no estimate, or were cut; a estimate of another scene or other options as far as that shows: a view, cycle
    /// or size there is not; values that no search can have found.
    pub fn from_bytes(stepper: &Stepper, bytes: &[u8]) -> Result<ViewEstimate> {
        let mut reader = Reader { rest: bytes };
        let error = |value: String, expected: String| Error::argument("bytes", value, expected);
        if reader.take::<8>() != Some(MAGIC) {
            return Err(error(
                "no estimate".into(),
                "bytes that a estimate of this version was saved to".into(),
            ));
        }
        let mut header = [0u64; 9];
        for number in &mut header {
            *number = reader.u64().ok_or_else(|| error("cut in the header".into(), "all bytes".into()))?;
        }
        let [
            view,
            cycle,
            marked,
            pixels,
            words,
            cycles,
            ncc_evaluations,
            bilinear_samples,
            early_terminations,
        ] = header;
        let small = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        let (view, cycle, pixels, words, cycles) =
            (small(view), small(cycle), small(pixels), small(words), small(cycles));
        let (width, height) = stepper.size(cycle, view).map_err(|reason| {
            error(format!("a estimate of view {view} after cycle {cycle}"), format!("another: {reason}"))
        })?;
        let sources = stepper.sources(view).len();
        if pixels != width as usize * height as usize
            || words != ViewSets::empty(0, sources).words_per_pixel()
            || marked > 1
        {
            let expected = format!("a estimate of {width} x {height} pixels over {sources} source views");
            return Err(error(
                format!("a estimate of {pixels} pixels with {words} words of views"),
                expected,
            ));
        }
        if cycles > stepper.all().len() || bytes.len() != byte_len(pixels, words, cycles) {
            let expected = format!("{} bytes", byte_len(pixels, words, cycles.min(stepper.all().len())));
            return Err(error(format!("{} bytes", bytes.len()), expected));
        }
        let mut estimate = ViewEstimate {
            view,
            cycle,
            marked: marked == 1,
            solved: PlaneMap { sets: ViewSets::empty(pixels, sources), ..PlaneMap::default() },
            counts: Counts { ncc_evaluations, bilinear_samples, early_terminations },
            cycles: Vec::with_capacity(cycles),
        };
        // The length was checked: none of what follows can be missing.
        for _ in 0..cycles {
            let record = [(); 5].map(|()| reader.u64().unwrap_or(0));
            // No scale has more pixels, so that sums of these never overflow.
            let most = u64::from(Camera::MAX_SIDE).pow(2);
            if record.iter().any(|&number| number > most) {
                return Err(error(format!("a cycle of {record:?}"), "what a search can report".into()));
            }
            let [downscale, cycle, pixels, changed, validated] = record;
            let (downscale, cycle) = (downscale as u32, cycle as u32);
            estimate.cycles.push(CycleRecord { downscale, cycle, pixels, changed, validated });
        }
        let mut verdicts = Vec::with_capacity(pixels);
        for pixel in 0..pixels {
            let [depth, x, y, z, cost] = [(); 5].map(|()| reader.f32().unwrap_or(0.0));
            let [consistent, validated] = reader.take::<2>().unwrap_or([0; 2]);
            let normal = Vec3::new(x, y, z);
            let usual = depth.is_finite() && depth >= 0.0 && cost >= 0.0 && validated <= 1;
            let fits = match depth > 0.0 {
                true => is_unit(normal),
                false => normal.is_finite() && validated == 0,
            };
            if !(usual && fits) {
                let place = format!("column {}, row {}", pixel % width as usize, pixel / width as usize);
                let value = format!("depth {depth}, normal {normal}, cost {cost} at {place}");
                return Err(error(value, "what a search can find".into()));
            }
            verdicts.push((consistent, validated == 1));
            estimate.solved.solutions.push(PixelEstimate {
                depth,
                normal,
                cost: cost.into(),
                ..PixelEstimate::default()
            });
            for word in 0..words {
                let bits = u32::from_le_bytes(reader.take().unwrap_or([0; 4]));
                for source in (word * 32..sources.min(word * 32 + 32)).filter(|s| bits >> (s % 32) & 1 != 0) {
                    estimate.solved.sets.insert(pixel, source);
                }
            }
        }
        if estimate.marked {
            estimate.solved.mark(&stepper.scaled(cycle, view).camera, &verdicts);
        }
        Ok(estimate)
    }
}

fn byte_len(pixels: usize, words: usize, cycles: usize) -> usize {
    let header = MAGIC.len() + 9 * 8;
    header.saturating_add(cycles.saturating_mul(40)).saturating_add(pixels.saturating_mul(22 + 4 * words))
}

/// Takes numbers off the front of bytes.
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
}
