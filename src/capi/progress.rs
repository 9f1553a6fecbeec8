//! How C follows a run and stops it.

use crate::parallel::{Phase, Progress};
use std::ffi::c_void;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Bees search the solutions of a view.
pub const SKEP_PHASE_SEARCH: u32 = 0;
/// Views check each other's solutions.
pub const SKEP_PHASE_CHECK: u32 = 1;
/// Maps become points.
pub const SKEP_PHASE_FUSION: u32 = 2;

/// Where a call stands.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_progress {
    /// Share of the whole call that is done, 0 to 1.
    pub done: f64,
    /// What is being done: a SKEP_PHASE_ value.
    pub phase: u32,
    /// Size of the images searched: 1 is full, 2 half, 4 a quarter.
    pub downscale: u32,
    /// The cycle on this scale, counted from 0.
    pub cycle: u32,
    /// The view at work.
    pub view: u32,
    /// Number of views.
    pub view_count: u32,
}

/// The host's callback: called about a hundred times a second, never twice at the same time, but from any thread of
/// the library. Non-zero cancels the call it is handed to, which then returns SKEP_ERR_CANCELLED, in general within
/// 100 ms. It must return soon, must not throw or unwind, and must not destroy what the call uses. NULL is a host that
/// neither looks nor stops.
pub type skep_progress_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, progress: *const skep_progress) -> i32>;

/// Time between two calls of the host.
const INTERVAL: Duration = Duration::from_millis(10);

/// A host's callback with what it wants to have handed back.
pub struct Host {
    callback: skep_progress_fn,
    user: *mut c_void,
    last_call: Mutex<Option<Instant>>,
    cancelled: AtomicBool,
}

// SAFETY: the host was told that its callback comes from any thread; `user` is only handed through.
unsafe impl Sync for Host {}
// SAFETY: as above.
unsafe impl Send for Host {}

impl Host {
    pub fn new(callback: skep_progress_fn, user: *mut c_void) -> Host {
        Host { callback, user, last_call: Mutex::new(None), cancelled: AtomicBool::new(false) }
    }

    /// The hook of a run: tells the host, unless another thread is doing so or it was told a moment ago.
    pub fn tell(&self, at: &Progress) -> ControlFlow<()> {
        if let Some(callback) = self.callback
            && !self.cancelled.load(Ordering::Relaxed)
            && let Ok(mut last_call) = self.last_call.try_lock()
            && (at.done >= 1.0 || last_call.is_none_or(|last| last.elapsed() >= INTERVAL))
        {
            let progress = skep_progress {
                done: at.done,
                phase: match at.phase {
                    Phase::Search => SKEP_PHASE_SEARCH,
                    Phase::Check => SKEP_PHASE_CHECK,
                    Phase::Fusion => SKEP_PHASE_FUSION,
                },
                downscale: at.downscale,
                cycle: at.cycle,
                view: at.view as u32,
                view_count: at.views as u32,
            };
            // SAFETY: the caller handed in a callback of this signature that is valid during the call.
            let answer = unsafe { callback(self.user, &progress) };
            if answer != 0 {
                self.cancelled.store(true, Ordering::Relaxed);
            }
            *last_call = Some(Instant::now());
        }
        if self.cancelled.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}
