//! Counts the work of a call and reports it to the host.

use crate::error::{Error, Result};
use crate::parallel::{Phase, Progress, ProgressFn};
use crate::scene::Scene;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// The progress before the first cycle.
pub(super) fn start(scene: &Scene) -> Progress {
    let views = scene.views().len();
    Progress { phase: Phase::Search, downscale: 1, cycle: 0, view: 0, views, done: 0.0 }
}

/// Estimated fraction of a whole run's work that fusion takes.
const FUSION_SHARE: f64 = 0.03;

/// Counts the work of a call and reports it to the host.
pub(crate) struct Tracker<'a> {
    progress: ProgressFn<'a>,
    /// Units of work of the call before fusion.
    total: f64,
    /// Their fraction of the whole call.
    share: f64,
    done: AtomicU64,
    cancelled: AtomicBool,
}

impl<'a> Tracker<'a> {
    /// A tracker of a whole run, whose work is not known yet.
    pub(super) fn new(progress: ProgressFn<'a>) -> Tracker<'a> {
        Tracker::with_work(progress, 0)
    }

    /// A tracker of a call with this number of units of work.
    pub(crate) fn with_work(progress: ProgressFn<'a>, units: u64) -> Tracker<'a> {
        let (done, cancelled) = (AtomicU64::new(0), AtomicBool::new(false));
        Tracker { progress, total: units.max(1) as f64, share: 1.0, done, cancelled }
    }

    /// Sets the work of a whole run before fusion.
    pub(super) fn set_work(&mut self, units: u64) {
        (self.total, self.share) = (units.max(1) as f64, 1.0 - FUSION_SHARE);
    }

    /// Adds finished work and reports the progress.
    ///
    /// # Errors
    /// [`Error::Cancelled`] after the host has cancelled.
    pub(crate) fn advance(&self, units: u64, at: Progress) -> Result<()> {
        let done = self.done.fetch_add(units, Ordering::Relaxed) + units;
        self.report(&Progress { done: self.share * (done as f64 / self.total).min(1.0), ..at })
    }

    /// Sets the finished work after cycles were skipped.
    pub(super) fn jump_to(&self, units: u64) {
        self.done.store(units, Ordering::Relaxed);
    }

    /// Reports the fusion at the end of a whole run; `at` is the progress of the fusion alone.
    pub(super) fn report_fusion(&self, at: &Progress) -> ControlFlow<()> {
        (self.progress)(&Progress { done: 1.0 - FUSION_SHARE * (1.0 - at.done), ..*at })
    }

    fn report(&self, at: &Progress) -> Result<()> {
        if (self.progress)(at).is_break() {
            self.cancelled.store(true, Ordering::Relaxed);
        }
        if self.cancelled.load(Ordering::Relaxed) { Err(Error::Cancelled) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::ignore_progress;
    use std::sync::Mutex;

    const PROGRESS: Progress =
        Progress { phase: Phase::Search, downscale: 2, cycle: 1, view: 3, views: 5, done: 0.0 };

    #[test]
    fn the_host_receives_the_fraction_of_finished_work() {
        let reported = Mutex::new(Vec::new());
        let hook = |at: &Progress| {
            assert_eq!(Progress { done: 0.0, ..*at }, PROGRESS);
            reported.lock().unwrap().push(at.done);
            ControlFlow::Continue(())
        };
        let tracker = Tracker::with_work(&hook, 8);
        tracker.advance(2, PROGRESS).unwrap();
        tracker.advance(0, PROGRESS).unwrap();
        tracker.jump_to(6);
        tracker.advance(1, PROGRESS).unwrap();
        // More than all work counts as all.
        tracker.advance(5, PROGRESS).unwrap();
        assert_eq!(*reported.lock().unwrap(), [0.25, 0.25, 0.875, 1.0]);
    }

    #[test]
    fn every_thread_gets_an_error_after_a_cancellation() {
        let calls = AtomicU64::new(0);
        let hook = |_: &Progress| match calls.fetch_add(1, Ordering::Relaxed) {
            1 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        };
        let tracker = Tracker::with_work(&hook, 8);
        assert_eq!([(); 4].map(|()| tracker.advance(1, PROGRESS).is_err()), [false, true, true, true]);
    }

    #[test]
    fn a_run_without_work_is_reported_too() {
        let tracker = Tracker::with_work(&ignore_progress, 0);
        tracker.advance(0, PROGRESS).unwrap();
    }
}
