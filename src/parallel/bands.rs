//! The loop over bands of rows.

use super::Advance;
use crate::error::Result;
use crate::simd::Simd;
use rayon::prelude::*;

/// An image cut into bands of rows, the units of work of the threads.
#[derive(Debug, Clone, Copy)]
pub struct Bands {
    /// Pixels of a row.
    pub width: usize,
    /// Rows of every band but the last, which may have fewer.
    pub rows: usize,
}

/// The most rows of a band: with tiles of 64 columns its working set stays in cache.
const MAX_ROWS: usize = 8;
/// The fewest rows of a band.
const MIN_ROWS: usize = 2;
/// Bands for each thread that are worth lower bands: threads that end early wait for the last.
const BANDS_PER_THREAD: usize = 8;

impl Bands {
    /// Bands of an image for the threads of the current rayon pool.
    pub fn new(width: usize, height: usize) -> Bands {
        let rows = (height / (BANDS_PER_THREAD * rayon::current_num_threads())).clamp(MIN_ROWS, MAX_ROWS);
        Bands { width, rows }
    }

    /// Pixels of a band.
    pub fn pixels(self) -> usize {
        self.width * self.rows
    }
}

/// Does `work` for each band on the threads of the current rayon pool, compiled for the instruction set, and returns the
/// results in order. Before each band `advance` counts its `units` of work.
///
/// # Errors
/// What `advance` returns; bands that have not begun are left out then.
#[inline(always)]
pub fn run_bands<S: Simd, B: Send, R: Send>(
    simd: S,
    bands: Vec<B>,
    advance: Advance,
    units: impl Fn(&B) -> u64 + Sync,
    work: impl Fn(B) -> R + Sync,
) -> Result<Vec<R>> {
    let run = |band: B| {
        advance(units(&band))?;
        Ok(simd.vectorize(
            #[inline(always)]
            || work(band),
        ))
    };
    bands.into_par_iter().with_max_len(1).map(run).collect()
}
