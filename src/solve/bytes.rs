//! States as bytes: what a scheduler sends from machine to machine or keeps across a restart.

use super::prepare::Steps;
use super::state::{State, is_unit};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::maps::{Counts, CycleRecord};
use crate::state::{Solution, ViewState};
use crate::views::ViewSets;
use glam::Vec3;

/// The first bytes of every state; the last is the version of the layout.
const MAGIC: [u8; 8] = *b"skepst\0\x01";

impl State {
    /// The state as bytes, all numbers little-endian. Only [`State::from_bytes`] of the same version of the crate is
    /// meant to read them.
    pub fn to_bytes(&self) -> Vec<u8> {
        let ViewState { solutions, sets, .. } = &self.solved;
        let words = sets.words_per_pixel();
        let mut bytes = Vec::with_capacity(self.byte_len());
        let mut put = |part: &[u8]| bytes.extend_from_slice(part);
        put(&MAGIC);
        for number in
            [self.view, self.step, usize::from(self.marked), solutions.len(), words, self.cycles.len()]
        {
            put(&(number as u64).to_le_bytes());
        }
        let Counts { ncc_evaluations, samples, early_outs } = self.counts;
        for count in [ncc_evaluations, samples, early_outs] {
            put(&count.to_le_bytes());
        }
        for record in &self.cycles {
            let CycleRecord { reduction, cycle, pixels, changed, validated } = *record;
            for number in [u64::from(reduction), u64::from(cycle), pixels, changed, validated] {
                put(&number.to_le_bytes());
            }
        }
        for (pixel, solution) in solutions.iter().enumerate() {
            let Solution { depth, normal, cost, .. } = *solution;
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

    /// Length of [`State::to_bytes`].
    pub fn byte_len(&self) -> usize {
        byte_len(self.pixels(), self.solved.sets.words_per_pixel(), self.cycles.len())
    }

    /// The state that gave these bytes.
    ///
    /// # Errors
    /// Bytes that are no state, or were cut; a state of another scene or other options as far as that shows: a view, step
    /// or size there is not; values that no search can have found.
    pub fn from_bytes(steps: &Steps, bytes: &[u8]) -> Result<State> {
        let mut reader = Reader { rest: bytes };
        let error = |value: String, expected: String| Error::argument("bytes", value, expected);
        if reader.take::<8>() != Some(MAGIC) {
            return Err(error("no state".into(), "bytes that a state of this version was saved to".into()));
        }
        let mut header = [0u64; 9];
        for number in &mut header {
            *number = reader.u64().ok_or_else(|| error("cut in the header".into(), "all bytes".into()))?;
        }
        let [view, step, marked, pixels, words, cycles, ncc_evaluations, samples, early_outs] = header;
        let small = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        let (view, step, pixels, words, cycles) =
            (small(view), small(step), small(pixels), small(words), small(cycles));
        let (width, height) = steps.size(step, view).map_err(|reason| {
            error(format!("a state of view {view} after step {step}"), format!("another: {reason}"))
        })?;
        let sources = steps.sources(view).len();
        if pixels != width as usize * height as usize
            || words != ViewSets::empty(0, sources).words_per_pixel()
            || marked > 1
        {
            let expected = format!("a state of {width} x {height} pixels over {sources} source views");
            return Err(error(format!("a state of {pixels} pixels with {words} words of views"), expected));
        }
        if cycles > steps.all().len() || bytes.len() != byte_len(pixels, words, cycles) {
            let expected = format!("{} bytes", byte_len(pixels, words, cycles.min(steps.all().len())));
            return Err(error(format!("{} bytes", bytes.len()), expected));
        }
        let mut state = State {
            view,
            step,
            marked: marked == 1,
            solved: ViewState { sets: ViewSets::empty(pixels, sources), ..ViewState::default() },
            counts: Counts { ncc_evaluations, samples, early_outs },
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
            let [reduction, cycle, pixels, changed, validated] = record;
            let (reduction, cycle) = (reduction as u32, cycle as u32);
            state.cycles.push(CycleRecord { reduction, cycle, pixels, changed, validated });
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
            state.solved.solutions.push(Solution { depth, normal, cost: cost.into(), ..Solution::default() });
            for word in 0..words {
                let bits = u32::from_le_bytes(reader.take().unwrap_or([0; 4]));
                for source in (word * 32..sources.min(word * 32 + 32)).filter(|s| bits >> (s % 32) & 1 != 0) {
                    state.solved.sets.insert(pixel, source);
                }
            }
        }
        if state.marked {
            state.solved.mark(&steps.scaled(step, view).camera, &verdicts);
        }
        Ok(state)
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
