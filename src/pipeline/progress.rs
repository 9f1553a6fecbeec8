//! How a host follows a run and stops it.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

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
    pub downscale: u32,
    /// The cycle on this scale, counted from 0.
    pub cycle: u32,
    /// The view at work, counted from 0.
    pub view: usize,
    /// Number of views.
    pub views: usize,
    /// Share of the whole run that is done, 0 to 1. Cycles that the stopping rule skips count as done.
    pub done: f64,
}

/// A host's hook: called often, from any worker thread, several calls may run at once; it must be quick.
/// `Break` cancels the run, which then ends with [`crate::Error::Cancelled`] well within a second.
pub type Hook<'a> = &'a (dyn Fn(&Progress) -> ControlFlow<()> + Sync);

/// The hook of a host that neither looks nor stops.
pub fn ignore_progress(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Asked now and then by whatever takes longer than a moment, from any thread; `true` cancels it.
pub(crate) type Cancelled<'a> = &'a (dyn Fn() -> bool + Sync);

/// Counts the work of a run and tells the hook.
pub(crate) struct Tracker<'a> {
    hook: Hook<'a>,
    total: u64,
    done: AtomicU64,
    cancelled: AtomicBool,
}

impl<'a> Tracker<'a> {
    /// A tracker of `total` units of work.
    pub fn new(hook: Hook<'a>, total: u64) -> Tracker<'a> {
        Tracker { hook, total: total.max(1), done: AtomicU64::new(0), cancelled: AtomicBool::new(false) }
    }

    /// Adds finished work and reports where the run stands; `true` when the host wants to stop.
    pub fn advance(&self, units: u64, at: Progress) -> bool {
        let done = self.done.fetch_add(units, Ordering::Relaxed) + units;
        self.report(done, at)
    }

    /// Sets the finished work, when some was skipped.
    pub fn jump_to(&self, units: u64) {
        self.done.store(units, Ordering::Relaxed);
    }

    fn report(&self, done: u64, at: Progress) -> bool {
        let done = (done as f64 / self.total as f64).min(1.0);
        if (self.hook)(&Progress { done, ..at }).is_break() {
            self.cancelled.store(true, Ordering::Relaxed);
        }
        self.cancelled.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    const SOMEWHERE: Progress =
        Progress { phase: Phase::Search, downscale: 2, cycle: 1, view: 3, views: 5, done: 0.0 };

    #[test]
    fn the_hook_hears_the_share_that_is_done() {
        let heard = Mutex::new(Vec::new());
        let hook = |at: &Progress| {
            assert_eq!(Progress { done: 0.0, ..*at }, SOMEWHERE);
            heard.lock().unwrap().push(at.done);
            ControlFlow::Continue(())
        };
        let tracker = Tracker::new(&hook, 8);
        assert!(!tracker.advance(2, SOMEWHERE));
        assert!(!tracker.advance(0, SOMEWHERE));
        tracker.jump_to(6);
        tracker.advance(1, SOMEWHERE);
        // Bands are rounded up: more than all is all.
        tracker.advance(5, SOMEWHERE);
        assert_eq!(*heard.lock().unwrap(), [0.25, 0.25, 0.875, 1.0]);
    }

    #[test]
    fn once_the_hook_broke_everybody_stops() {
        let calls = AtomicU64::new(0);
        let hook = |_: &Progress| match calls.fetch_add(1, Ordering::Relaxed) {
            1 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        };
        let tracker = Tracker::new(&hook, 8);
        assert_eq!([(); 4].map(|()| tracker.advance(1, SOMEWHERE)), [false, true, true, true]);
    }

    #[test]
    fn a_run_without_work_is_reported_too() {
        let tracker = Tracker::new(&ignore_progress, 0);
        assert!(!tracker.advance(0, SOMEWHERE));
    }
}
