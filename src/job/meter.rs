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

    /// A progress function for a task of this work, whose own `done` goes from 0 to 1.
    pub(super) fn task(&self, units: u64) -> impl Fn(&Progress) -> ControlFlow<()> + Sync {
        let counted = AtomicU64::new(0);
        move |at: &Progress| {
            let own = (at.done.clamp(0.0, 1.0) * units as f64 * STEPS) as u64;
            let before = counted.fetch_max(own, Ordering::Relaxed);
            let done = self.done.fetch_add(own.saturating_sub(before), Ordering::Relaxed);
            let done = done as f64 / STEPS / self.total;
            (self.progress)(&Progress { done: done.min(1.0), ..*at })
        }
    }
}
