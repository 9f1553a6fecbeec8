//! Threads: the thread pool, the loop over bands of rows, progress and cancellation.

mod bands;
mod pool;
mod progress;

pub(crate) use bands::{Bands, run_bands};
pub(crate) use pool::{JoinedPool, useful_threads};
pub use progress::{Phase, Progress, ProgressFn, ignore_progress};

use crate::error::Result;

/// Callback of long computations, from any thread: adds this many units to the finished work. If it returns
/// [`Error::Cancelled`](crate::Error::Cancelled), the computation ends. The caller defines the unit.
pub(crate) type Advance<'a> = &'a (dyn Fn(u64) -> Result<()> + Sync);
