//! Threads: the pool that ends with its owner, the one loop over bands of rows, and how work is counted, reported and
//! cancelled.

mod bands;
mod pool;
mod progress;

pub use bands::{Bands, run_bands};
pub use pool::JoinedPool;
pub use progress::{Phase, Progress, ProgressFn, ignore_progress};

use crate::error::Result;

/// Told by whatever takes longer than a moment how many units of work are done, from any thread;
/// [`Error::Cancelled`](crate::Error::Cancelled) ends the work. What a unit is, the caller says.
pub type Advance<'a> = &'a (dyn Fn(u64) -> Result<()> + Sync);
