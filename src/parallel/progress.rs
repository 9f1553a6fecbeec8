//! Progress and cancellation of a call.

use std::ops::ControlFlow;

/// Phase of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Photographs are read.
    Read,
    /// The planes of a view are searched.
    Search,
    /// Views are checked against each other, and finished.
    Check,
    /// Maps are fused into points.
    Fusion,
}

impl Phase {
    /// One lower-case word.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Read => "read",
            Phase::Search => "search",
            Phase::Check => "check",
            Phase::Fusion => "fusion",
        }
    }
}

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Current phase.
    pub phase: Phase,
    /// Size of the images searched: 1 is full, 2 half, 4 a quarter.
    pub downscale: u32,
    /// The cycle on this scale, counted from 0.
    pub cycle: u32,
    /// Current view, counted from 0.
    pub view: usize,
    /// Number of views.
    pub views: usize,
    /// Fraction of the whole call that is done, 0 to 1. Cycles that are skipped because a scale ended early
    /// count as done.
    pub done: f64,
}

/// Callback of the host for progress and cancellation: called often, from any worker thread, and from several
/// at once; it must be fast. `Break` cancels the call, which then returns [`crate::Error::Cancelled`] well
/// within a second.
pub type ProgressFn<'a> = &'a (dyn Fn(&Progress) -> ControlFlow<()> + Sync);

/// A progress callback that does nothing.
pub fn ignore_progress(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
