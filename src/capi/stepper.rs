//! A run taken apart, in C.

use super::estimate::skep_estimate;
use super::options::{options_or_default, skep_options};
use super::pointers::{destroy, get, give_list, out, slice, wanted_one};
use super::progress::{Host, skep_progress_fn};
use super::result::skep_result;
use super::scene::{no_view, skep_scene};
use super::status::{Failure, guard, skep_status};
use crate::parallel::JoinedPool;
use crate::pipeline::{AnyEstimate, Candidates, Checked, EstimateRef, Stepper, ViewEstimate};
use std::ffi::c_void;

/// A run taken apart, for hosts that schedule views themselves, on one machine or on many, or that bring maps of their
/// own. Holds what all stepper share (images of all scales, source views, threads) and never changes: stepper of
/// different views may be taken at the same time from several threads. The scene may be destroyed.
///
/// A run is this, for step 0 and then for what skep_stepper_next says, until that is SKEP_CYCLE_NONE:
///   - when the step is on a finer scale than the estimates, skep_stepper_upsample each of them;
///   - skep_stepper_propagate, then skep_stepper_search each view, all from the estimates the step before left;
///   - skep_stepper_check each view against what all have just found: that is what the next step starts from.
///
/// After the last, skep_stepper_finish each view, and skep_fuse the validated maps. Done so for all views, that gives the
/// same bits as skep_reconstruct.
///
/// States are passed as an array with one pointer for each view of the scene. Looked at are only the view itself, its
/// sources, and the views it is a source of; NULL says that nothing is known of a view. (NULL, 0) knows of none.
pub struct skep_stepper {
    stepper: Stepper,
    pool: JoinedPool,
}

/// Planes that other views offer to the pixels of a view. Never changes.
pub struct skep_candidates {
    candidates: Candidates,
}

/// No step: the run is done.
pub const SKEP_CYCLE_NONE: u32 = 4294967295;

/// One cycle on one scale.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_cycle {
    /// Size of the images: 1 is full, 2 half, 4 a quarter.
    pub downscale: u32,
    /// The cycle on that scale, counted from 0.
    pub cycle_on_scale: u32,
    /// Food sources of each pixel's colony.
    pub food_sources: u32,
    /// Rounds of bees.
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

    /// The estimates of an array, `None` where it holds NULL.
    ///
    /// # Safety
    /// Every pointer is NULL or points to an estimate, for `'a`.
    unsafe fn estimates<'a>(
        estimates: &[*const skep_estimate],
    ) -> Result<Vec<Option<&'a AnyEstimate>>, Failure> {
        let estimate = |(index, &estimate): (usize, &*const skep_estimate)| match estimate.is_null() {
            true => Ok(None),
            // SAFETY: as promised by the caller.
            false => Ok(Some(unsafe { get(estimate, &format!("estimates[{index}]")) }?.inner())),
        };
        estimates.iter().enumerate().map(estimate).collect()
    }

    /// The same of estimates that must be checked.
    ///
    /// # Safety
    /// Every pointer is NULL or points to an estimate, for `'a`.
    unsafe fn checked<'a>(
        estimates: &[*const skep_estimate],
    ) -> Result<Vec<Option<&'a ViewEstimate<Checked>>>, Failure> {
        // SAFETY: as promised by the caller.
        let estimates = unsafe { skep_stepper::estimates(estimates) }?;
        let checked = |(index, estimate): (usize, Option<&'a AnyEstimate>)| {
            estimate.map(|estimate| require_checked(estimate, &format!("estimates[{index}]"))).transpose()
        };
        estimates.into_iter().enumerate().map(checked).collect()
    }
}

/// Refuses an estimate that is not checked; `name` is how the error calls it.
fn require_checked<'a>(estimate: &'a AnyEstimate, name: &str) -> Result<&'a ViewEstimate<Checked>, Failure> {
    let expected = "one that is checked";
    estimate.checked().ok_or_else(|| Failure::argument(name, "searched and not checked", expected))
}

/// Prepares the stepper of a run.
///
/// SKEP_ERR_ARGUMENT: the scene is not in order (see skep_scene_validate) or an option is out of range.
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
        let pool = JoinedPool::new(options.threads)?;
        let stepper = pool.install(|| Stepper::new(&scene, &options))?;
        out.give(skep_stepper { stepper, pool });
        Ok(())
    })
}

/// Destroys stepper and ends their threads; NULL is ignored. States and results stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_destroy(stepper: *mut skep_stepper) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(stepper) };
        Ok(())
    });
}

/// The number of stepper, and of views. Either output may be NULL.
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

/// What a step does.
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
                format!("a cycle below their number, {}", stepper.cycles().len()),
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

/// Width and height of a view's maps at a step.
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

/// The source views of a view: those whose estimates its stepper look at. `sources` may be NULL to only ask for their number.
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

/// The planes that other views offer to a view: their consistent solutions where it has no validated one of its own.
/// From checked estimates.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_propagate(
    stepper: *const skep_stepper,
    cycle: u32,
    view: u32,
    estimates: *const *const skep_estimate,
    estimate_count: usize,
    candidates_out: *mut *mut skep_candidates,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, estimates, out) = unsafe {
            (
                get(stepper, "stepper")?,
                slice(estimates, estimate_count, "estimates")?,
                out(candidates_out, "candidates_out")?,
            )
        };
        // SAFETY: as the header demands of the caller, who keeps the estimates during the call.
        let estimates = unsafe { skep_stepper::checked(estimates) }?;
        let propagate = || stepper.stepper.propagate(cycle as usize, view as usize, &estimates);
        out.give(skep_candidates { candidates: stepper.install(propagate)? });
        Ok(())
    })
}

/// Destroys candidates; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_candidates_destroy(candidates: *mut skep_candidates) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(candidates) };
        Ok(())
    });
}

/// Searches a view for one cycle: from its own estimate, helped by what is validated in its sources and by what is offered.
/// Without a estimate of its own it starts at random. From checked estimates on the step's scale; gives one that is still to
/// be checked. When it is cancelled or fails, `estimate_out` is not written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_search(
    stepper: *const skep_stepper,
    cycle: u32,
    view: u32,
    estimates: *const *const skep_estimate,
    estimate_count: usize,
    candidates_or_null: *const skep_candidates,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    estimate_out: *mut *mut skep_estimate,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, estimates, out) = unsafe {
            (
                get(stepper, "stepper")?,
                slice(estimates, estimate_count, "estimates")?,
                out(estimate_out, "estimate_out")?,
            )
        };
        let candidates = match candidates_or_null.is_null() {
            true => None,
            // SAFETY: as the header demands of the caller.
            false => Some(&unsafe { get(candidates_or_null, "candidates") }?.candidates),
        };
        // SAFETY: as the header demands of the caller, who keeps the estimates during the call.
        let estimates = unsafe { skep_stepper::checked(estimates) }?;
        let host = Host::new(progress_or_null, user);
        let search = || {
            stepper.stepper.search(cycle as usize, view as usize, &estimates, candidates, &|at| host.tell(at))
        };
        out.give(skep_estimate::new(AnyEstimate::Searched(stepper.install(search)?)));
        Ok(())
    })
}

/// Checks a view's solutions against what its sources have just found, and gives its estimate with the verdicts in it. From
/// estimates that skep_stepper_search gave; a source whose estimate is NULL cannot speak.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_check(
    stepper: *const skep_stepper,
    cycle: u32,
    view: u32,
    estimates: *const *const skep_estimate,
    estimate_count: usize,
    estimate_out: *mut *mut skep_estimate,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, estimates, out) = unsafe {
            (
                get(stepper, "stepper")?,
                slice(estimates, estimate_count, "estimates")?,
                out(estimate_out, "estimate_out")?,
            )
        };
        // SAFETY: as the header demands of the caller, who keeps the estimates during the call.
        let estimates = unsafe { skep_stepper::estimates(estimates) }?;
        stepper.stepper.size(cycle as usize, view as usize)?;
        let name = format!("estimates[{view}]");
        let own = estimates.get(view as usize).copied().flatten();
        let own = own.ok_or_else(|| Failure::argument(&name, "NULL", "the estimate of the view itself"))?;
        let expected = "one that is searched and not checked";
        let own = own.searched().ok_or_else(|| Failure::argument(&name, "checked", expected))?;
        if (own.view(), own.cycle()) != (view as usize, cycle as usize) {
            let value = format!("that of view {} in cycle {}", own.view(), own.cycle());
            return Err(Failure::argument(&name, value, format!("that of view {view} in cycle {cycle}")));
        }
        let sources: Vec<Option<EstimateRef>> =
            estimates.iter().map(|estimate| estimate.map(EstimateRef::from)).collect();
        let checked = stepper.install(|| stepper.stepper.check(own, &sources))?;
        out.give(skep_estimate::new(AnyEstimate::Checked(checked)));
        Ok(())
    })
}

/// A checked estimate on the next finer scale, that of `step`: each pixel gets the plane of its coarse pixel.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_upsample(
    stepper: *const skep_stepper,
    cycle: u32,
    view: u32,
    estimate: *const skep_estimate,
    estimate_out: *mut *mut skep_estimate,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, estimate, out) = unsafe {
            (get(stepper, "stepper")?, get(estimate, "estimate")?, out(estimate_out, "estimate_out")?)
        };
        let estimate = require_checked(estimate.inner(), "estimate")?;
        if estimate.view() != view as usize {
            let (value, expected) =
                (format!("that of view {}", estimate.view()), format!("that of view {view}"));
            return Err(Failure::argument("estimate", value, expected));
        }
        let upsampled = stepper.install(|| stepper.stepper.upsample(cycle as usize, estimate))?;
        out.give(skep_estimate::new(AnyEstimate::Checked(upsampled)));
        Ok(())
    })
}

/// The step to take after `step` was taken for all views; SKEP_CYCLE_NONE after the last. A scale ends early when too
/// few pixels of the given estimates, which are checked ones of `step`, changed (option "stop_share").
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_next(
    stepper: *const skep_stepper,
    cycle: u32,
    estimates: *const *const skep_estimate,
    estimate_count: usize,
    next_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, estimates, out) = unsafe {
            (
                get(stepper, "stepper")?,
                slice(estimates, estimate_count, "estimates")?,
                out(next_out, "next_out")?,
            )
        };
        // SAFETY: as the header demands of the caller, who keeps the estimates during the call.
        let estimates = unsafe { skep_stepper::checked(estimates) }?;
        let next = stepper.stepper.next(cycle as usize, &estimates)?;
        out.set(next.map_or(SKEP_CYCLE_NONE, |next| next as u32));
        Ok(())
    })
}

/// Averages planes with those of the source views, closes small gaps, and settles source views, cost and status of
/// every pixel of a view after the last step, from checked estimates. The result holds this view alone, under its own
/// number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_stepper_finish(
    stepper: *const skep_stepper,
    view: u32,
    estimates: *const *const skep_estimate,
    estimate_count: usize,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    result_out: *mut *mut skep_result,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, estimates, out) = unsafe {
            (
                get(stepper, "stepper")?,
                slice(estimates, estimate_count, "estimates")?,
                out(result_out, "result_out")?,
            )
        };
        // SAFETY: as the header demands of the caller, who keeps the estimates during the call.
        let estimates = unsafe { skep_stepper::checked(estimates) }?;
        let host = Host::new(progress_or_null, user);
        let finish = || stepper.stepper.finish(view as usize, &estimates, &|at| host.tell(at));
        out.give(skep_result::of_view(view, stepper.install(finish)?));
        Ok(())
    })
}
