//! The progress of a run of several tasks at a time.

use crate::parallel::{Progress, ProgressFn};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};

/// Parts of a task that are counted.
const STEPS: f64 = 1024.0;

/// Adds up the work of tasks and reports its share of the whole.
pub(super) struct Meter<'a> {
    progress: ProgressFn<'a>,
    /// Work of the whole, in units of tasks.
    total: f64,
    /// Finished work times `STEPS`.
    done: AtomicU64,
}

impl<'a> Meter<'a> {
    pub(super) fn new(progress: ProgressFn<'a>, total: u64) -> Meter<'a> {
        Meter { progress, total: total.max(1) as f64, done: AtomicU64::new(0) }
    }

    /// Counts the work of tasks that were done before, or are needless.
    pub(super) fn skip(&self, units: u64) {
        self.done.fetch_add((units as f64 * STEPS) as u64, Ordering::Relaxed);
    }

    /// Counts all work up to here, if more than is counted.
    pub(super) fn reach(&self, units: u64) {
        self.done.fetch_max((units as f64 * STEPS) as u64, Ordering::Relaxed);
    }

    /// A task of this work.
    pub(super) fn task(&self, units: u64) -> TaskMeter<'_> {
        TaskMeter { meter: self, units: units as f64, counted: AtomicU64::new(0) }
    }
}

/// Counts the work of one task.
pub(super) struct TaskMeter<'a> {
    meter: &'a Meter<'a>,
    units: f64,
    /// What of it is counted, times `STEPS`.
    counted: AtomicU64,
}

impl TaskMeter<'_> {
    /// Reports the progress of the task, whose own `done` goes from 0 to 1.
    pub(super) fn report(&self, at: &Progress) -> ControlFlow<()> {
        let done = self.count(at.done) as f64 / STEPS / self.meter.total;
        (self.meter.progress)(&Progress { done: done.min(1.0), ..*at })
    }

    /// Counts the whole task.
    pub(super) fn complete(&self) {
        self.count(1.0);
    }

    /// Counts the task up to a fraction; returns all work that is counted.
    fn count(&self, fraction: f64) -> u64 {
        let own = (fraction.clamp(0.0, 1.0) * self.units * STEPS) as u64;
        let added = own.saturating_sub(self.counted.fetch_max(own, Ordering::Relaxed));
        self.meter.done.fetch_add(added, Ordering::Relaxed) + added
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::Phase;
    use std::sync::Mutex;

    #[test]
    fn tasks_at_the_same_time_add_up_and_never_count_twice() {
        let reported = Mutex::new(Vec::new());
        let progress = |at: &Progress| {
            reported.lock().unwrap().push(at.done);
            ControlFlow::Continue(())
        };
        let at = |done| Progress { phase: Phase::Search, downscale: 1, cycle: 0, view: 0, views: 2, done };
        let meter = Meter::new(&progress, 8);
        meter.skip(2);
        let (first, second) = (meter.task(4), meter.task(2));
        for (task, done) in [(&first, 0.5), (&second, 0.5), (&first, 0.25), (&first, 1.0)] {
            assert!(task.report(&at(done)).is_continue());
        }
        second.complete();
        first.complete();
        assert!(second.report(&at(1.0)).is_continue());
        assert_eq!(*reported.lock().unwrap(), [0.5, 0.625, 0.625, 0.875, 1.0]);
    }
}
