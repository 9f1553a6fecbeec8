//! The loop over bands of rows.

use super::Advance;
use crate::error::Result;
use crate::simd::Simd;
use rayon::prelude::*;

/// An image divided into bands of rows, the units of work of the threads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bands {
    /// Pixels of a row.
    pub width: usize,
    /// Rows of every band but the last, which may have fewer.
    pub rows: usize,
}

/// Maximum number of rows of a band: with tiles of 64 columns its working set stays in cache.
const MAX_ROWS: usize = 8;
/// Minimum number of rows of a band.
const MIN_ROWS: usize = 2;
/// Number of bands per thread below which bands get fewer rows: threads that finish early wait for the last
/// band.
const BANDS_PER_THREAD: usize = 8;

impl Bands {
    /// Bands of an image for the threads of the current rayon pool.
    pub(crate) fn new(width: usize, height: usize) -> Bands {
        let rows = (height / (BANDS_PER_THREAD * rayon::current_num_threads())).clamp(MIN_ROWS, MAX_ROWS);
        Bands { width, rows }
    }

    /// The largest number of bands of an image, for any number of threads.
    pub(crate) fn most(height: usize) -> usize {
        height.div_ceil(MIN_ROWS)
    }

    /// Pixels of a band.
    pub(crate) fn pixels(self) -> usize {
        self.width * self.rows
    }
}

/// Runs `work` on each band with the threads of the current rayon pool, compiled for the instruction set, and
/// returns the results in order. Before each band `advance` counts its `units` of work.
///
/// # Errors
/// What `advance` returns; the remaining bands are skipped.
#[inline(always)]
pub(crate) fn run_bands<S: Simd, B: Send, R: Send>(
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
