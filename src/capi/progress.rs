//! Progress and cancellation in C.

use crate::parallel::{Phase, Progress};
use std::ffi::c_void;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Search of the planes of a view.
pub const SKEP_PHASE_SEARCH: u32 = 0;
/// Checks between views.
pub const SKEP_PHASE_CHECK: u32 = 1;
/// Fusion of maps into points.
pub const SKEP_PHASE_FUSION: u32 = 2;
/// Reading of photographs.
pub const SKEP_PHASE_READ: u32 = 3;

/// Progress of a call.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_progress {
    /// Fraction of the work of the call that is done, 0 to 1.
    pub done: f64,
    /// Stage of the call: a SKEP_PHASE_ value.
    pub phase: u32,
    /// Scale of the images: 1 is full size, 2 half, 4 a quarter.
    pub downscale: u32,
    /// Number of the cycle on this scale, from 0.
    pub cycle: u32,
    /// Number of the view that is worked on.
    pub view: u32,
    /// Number of views.
    pub view_count: u32,
}

/// Progress callback of the host. It is called about a hundred times a second from any thread of the library,
/// never twice at the same time for one call. Returning non-zero cancels the call, which then returns
/// SKEP_ERR_CANCELLED, usually within 100 ms. The callback must return soon, must not throw or unwind, and
/// must not destroy objects that the call uses. NULL: no callback.
///
/// @param user      The pointer that was passed to the call.
/// @param progress  Progress of the call; valid during the callback only.
/// @return 0 to continue, non-zero to cancel.
pub type skep_progress_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, progress: *const skep_progress) -> i32>;

/// Time between two calls of the host.
const INTERVAL: Duration = Duration::from_millis(10);

/// The callback of a host with its user pointer.
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

    /// Calls the callback, at most once per [`INTERVAL`] and from one thread at a time.
    pub fn tell(&self, at: &Progress) -> ControlFlow<()> {
        if let Some(callback) = self.callback
            && !self.cancelled.load(Ordering::Relaxed)
            && let Ok(mut last_call) = self.last_call.try_lock()
            && (at.done >= 1.0 || last_call.is_none_or(|last| last.elapsed() >= INTERVAL))
        {
            let progress = skep_progress {
                done: at.done,
                phase: match at.phase {
                    Phase::Read => SKEP_PHASE_READ,
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
