//! Stepwise runs in C.

use super::options::{options_or_default, skep_options};
use super::pointers::{destroy, get, give_list, out, wanted_one};
use super::scene::{no_view, skep_scene};
use super::status::{Failure, guard, skep_status};
use crate::parallel::JoinedPool;
use crate::pipeline::{Stepper, thread_count};

/// The stages of a run on single views, for hosts that schedule views themselves. Immutable.
///
/// A stepper holds what all stages share: image pyramids, source views and threads. Different views may be
/// processed at the same time from several threads, or on several machines: estimates are saved to bytes and
/// loaded by a stepper of the same scene and options.
///
/// A run is, for cycle 0 and then for each cycle that skep_stepper_next returns, until SKEP_CYCLE_NONE:
///   - for each view, if the cycle is on a finer scale than its estimate: skep_stepper_upsample
///   - for each view: skep_stepper_propagate, then skep_stepper_search, from the checked estimates of the
///     previous cycle
///   - for each view: skep_stepper_check, from the searched estimates of the same cycle
///
/// and then, for each view, skep_stepper_finish from the checked estimates of the last cycle, and skep_fuse
/// for the validated maps of all views. That gives the same bits as skep_reconstruct. What each call
/// performs, and which estimates of other views it reads:
///
///   call       stages                                  estimates of other views
///   upsample   upsampling                              none
///   propagate  transfer of planes                      checked planes, previous cycle, of the views whose
///                                                      source lists contain the view
///   search     search,                                 validated surfaces, previous cycle, of the view's
///              filling of textureless regions          sources
///   check      consistency check,                      searched planes, same cycle, of the view's sources
///              correction of foreground fattening,
///              plane smoothing,
///              publication of the validated surface
///   finish     averaging across views, gap filling,    validated surfaces and checked planes, last cycle,
///              check of filled pixels, classification  of the view's sources
///
/// Arrays of estimates hold one pointer for each view of the scene. Those of the view itself and of the views
/// named above are read; entries of other views may be NULL. A view without an estimate contributes nothing.
pub struct skep_stepper {
    stepper: Stepper,
    pool: JoinedPool,
}

/// No cycle: the run is complete.
pub const SKEP_CYCLE_NONE: u32 = 4294967295;

/// Scale and search parameters of a cycle.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_cycle {
    /// Scale of the images: 1 is full size, 2 half, 4 a quarter.
    pub downscale: u32,
    /// Number of the cycle on that scale, from 0.
    pub cycle_on_scale: u32,
    /// Food sources (plane hypotheses) of the colony of each pixel.
    pub food_sources: u32,
    /// Iterations: turns of the employed, onlooker and scout bees.
    pub iterations: u32,
}

impl skep_stepper {
    pub fn inner(&self) -> &Stepper {
        &self.stepper
    }

    /// Runs work on the threads of the stepper: anywhere else it would start rayon's own, which never end.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.install(work)
    }
}

/// Creates a stepper: builds the image pyramids, selects source views and starts threads.
///
/// @param scene            The scene, as it is when the call starts; it may be destroyed afterwards.
/// @param options_or_null  The options, copied; NULL: the default preset.
/// @param stepper_out      Receives the stepper; destroy it with skep_stepper_destroy.
/// @retval SKEP_ERR_ARGUMENT  A scene that skep_scene_validate refuses, options out of range, or threads that
///                            cannot be started.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_create(
    scene: *const skep_scene,
    options_or_null: *const skep_options,
    stepper_out: *mut *mut skep_stepper,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, options, out) = unsafe {
            (get(scene, "scene")?, options_or_default(options_or_null)?, out(stepper_out, "stepper_out")?)
        };
        let scene = scene.checked()?;
        options.check()?;
        let pool = JoinedPool::new(thread_count(&scene, &options))?;
        let stepper = pool.install(|| Stepper::new(&scene, &options))?;
        out.give(skep_stepper { stepper, pool });
        Ok(())
    })
}

/// Destroys a stepper and ends its threads. Estimates and results made with it are not affected.
///
/// @param stepper  The stepper; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_destroy(stepper: *mut skep_stepper) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(stepper) };
        Ok(())
    });
}

/// Gets the number of cycles of the schedule, and of views.
///
/// @param stepper          The stepper.
/// @param cycle_count_out  Receives the number of cycles on all scales; may be NULL.
/// @param view_count_out   Receives the number of views; may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_get_count(
    stepper: *const skep_stepper,
    cycle_count_out: *mut u32,
    view_count_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let stepper = &unsafe { get(stepper, "stepper") }?.stepper;
        // SAFETY: as the header demands of the caller.
        let (cycle_count, view_count) = unsafe {
            (wanted_one(cycle_count_out, "cycle_count_out")?, wanted_one(view_count_out, "view_count_out")?)
        };
        cycle_count.into_iter().for_each(|out| out.set(stepper.cycles().len() as u32));
        view_count.into_iter().for_each(|out| out.set(stepper.views() as u32));
        Ok(())
    })
}

/// Gets the scale and the search parameters of a cycle.
///
/// @param stepper    The stepper.
/// @param cycle      Number of the cycle, from 0, on all scales.
/// @param cycle_out  Receives the parameters.
/// @retval SKEP_ERR_ARGUMENT  No such cycle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_get_cycle(
    stepper: *const skep_stepper,
    cycle: u32,
    cycle_out: *mut skep_cycle,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, out) = unsafe { (&get(stepper, "stepper")?.stepper, out(cycle_out, "cycle_out")?) };
        let found = stepper.cycles().get(cycle as usize).ok_or_else(|| {
            Failure::argument(
                "cycle",
                cycle,
                format!("a cycle below the number of cycles, {}", stepper.cycles().len()),
            )
        })?;
        out.set(skep_cycle {
            downscale: found.scale.downscale,
            cycle_on_scale: found.cycle,
            food_sources: found.scale.food_sources,
            iterations: found.iterations(),
        });
        Ok(())
    })
}

/// Gets the size of the maps of a view in a cycle.
///
/// @param stepper     The stepper.
/// @param cycle       Number of the cycle.
/// @param view        Number of the view.
/// @param width_out   Receives the width in pixels.
/// @param height_out  Receives the height in pixels.
/// @retval SKEP_ERR_ARGUMENT  No such cycle or view.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_get_size(
    stepper: *const skep_stepper,
    cycle: u32,
    view: u32,
    width_out: *mut u32,
    height_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, width, height) = unsafe {
            (&get(stepper, "stepper")?.stepper, out(width_out, "width_out")?, out(height_out, "height_out")?)
        };
        let size = stepper.size(cycle as usize, view as usize)?;
        width.set(size.0);
        height.set(size.1);
        Ok(())
    })
}

/// Gets the source views of a view.
///
/// @param stepper    The stepper.
/// @param view       Number of the view.
/// @param sources    Receives `*count_out` numbers of views; may be NULL to ask for their number.
/// @param capacity   Elements of room in `sources`.
/// @param count_out  Receives the number of source views.
/// @retval SKEP_ERR_ARGUMENT  No such view.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_get_sources(
    stepper: *const skep_stepper,
    view: u32,
    sources: *mut u32,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let stepper = &unsafe { get(stepper, "stepper") }?.stepper;
        if view as usize >= stepper.views() {
            return Err(no_view(view, stepper.views()));
        }
        // SAFETY: as the header demands of the caller.
        unsafe {
            give_list(stepper.sources(view as usize), sources, capacity, count_out, ("sources", "count_out"))
        }
    })
}
