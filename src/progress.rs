//! How a host follows a run and stops it.

use std::ops::ControlFlow;

/// What a run is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Bees search the solutions of a view.
    Search,
    /// Views check each other's solutions.
    Check,
    /// Maps become points.
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

/// Where a run stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub phase: Phase,
    /// Size of the images searched: 1 is full, 2 half, 4 a quarter.
    pub reduction: u32,
    /// The cycle on this scale, counted from 0.
    pub cycle: u32,
    /// The view at work, counted from 0.
    pub view: usize,
    /// Number of views.
    pub views: usize,
    /// Share of the whole run that is done, 0 to 1, never falling. Cycles that the stopping rule skips count as done.
    pub done: f64,
}

/// A host's hook: called often, from any worker thread, one call at a time or several at once; it must be quick.
/// `Break` cancels the run, which then ends with [`crate::Error::Cancelled`] well within a second.
pub type Hook<'a> = &'a (dyn Fn(&Progress) -> ControlFlow<()> + Sync);

/// The hook of a host that neither looks nor stops.
pub fn ignore_progress(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
