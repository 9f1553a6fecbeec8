//! How a host follows a call and cancels it.

use std::ops::ControlFlow;

/// What a run is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
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
            Phase::Search => "search",
            Phase::Check => "check",
            Phase::Fusion => "fusion",
        }
    }
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What is done now.
    pub phase: Phase,
    /// Size of the images searched: 1 is full, 2 half, 4 a quarter.
    pub downscale: u32,
    /// The cycle on this scale, counted from 0.
    pub cycle: u32,
    /// The view that is worked on, counted from 0.
    pub view: usize,
    /// Number of views.
    pub views: usize,
    /// Fraction of the whole call that is done, 0 to 1. Cycles that are skipped because a scale ended early count as done.
    pub done: f64,
}

/// The callback of a host, for progress and for cancelling: called often, from any worker thread, several calls may run at
/// once; it must be quick. `Break` cancels the call, which then ends with [`crate::Error::Cancelled`] well within a second.
pub type ProgressFn<'a> = &'a (dyn Fn(&Progress) -> ControlFlow<()> + Sync);

/// The callback of a host that neither watches nor cancels.
pub fn ignore_progress(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
