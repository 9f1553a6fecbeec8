//! Stepwise runs in C.

use super::estimate::skep_estimate;
use super::options::{options_or_default, skep_options};
use super::pointers::{destroy, get, give_list, out, slice, wanted_one};
use super::progress::{Host, skep_progress_fn};
use super::result::skep_result;
use super::scene::{no_view, skep_scene};
use super::status::{Failure, guard, skep_status};
use crate::parallel::JoinedPool;
use crate::pipeline::{AnyEstimate, Candidates, Checked, EstimateRef, Place, Stepper, ViewEstimate};
use std::ffi::c_void;

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

/// Planes of other views, transferred to the pixels of a view. Immutable.
pub struct skep_candidates {
    candidates: Candidates,
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
    estimate.checked().ok_or_else(|| Failure::argument(name, "searched and not yet checked", expected))
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
        let pool = JoinedPool::new(options.threads)?;
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

/// Transfers planes of other views to a view: for each pixel without a validated plane, the consistent plane
/// of lowest cost that projects onto it. There are none in the first cycle of a scale, without an estimate of
/// the view itself, and with option "search.view_propagation" off.
///
/// Reads the checked planes of the previous cycle of the views whose source lists contain the view, and of
/// the view itself. Changes nothing.
///
/// @param stepper         The stepper.
/// @param cycle           Number of the cycle that the candidates are for.
/// @param view            Number of the view.
/// @param estimates       `estimate_count` pointers by view: checked estimates on the scale of the cycle,
///                        NULL for none; may be NULL when `estimate_count` is 0.
/// @param estimate_count  The number of views, or 0.
/// @param candidates_out  Receives the candidates; destroy them with skep_candidates_destroy.
/// @retval SKEP_ERR_ARGUMENT  No such cycle or view; estimates of another view, scale or scene, or that are
///                            not checked.
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

/// Destroys candidates.
///
/// @param candidates  The candidates; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_candidates_destroy(candidates: *mut skep_candidates) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(candidates) };
        Ok(())
    });
}

/// Searches the planes of a view for one cycle, then fills its textureless regions from the planes around
/// them. The new estimate is to be checked before it is used for anything else.
///
/// Reads the planes of the view itself, random ones where it has no estimate, and the validated surfaces of
/// its sources, all of the previous cycle. Changes depth, normal, cost and view set of the pixels, in the new
/// estimate.
///
/// @param stepper             The stepper.
/// @param cycle               Number of the cycle.
/// @param view                Number of the view.
/// @param estimates           `estimate_count` pointers by view: checked estimates on the scale of the cycle,
///                            NULL for none; may be NULL when `estimate_count` is 0.
/// @param estimate_count      The number of views, or 0.
/// @param candidates_or_null  Candidates of skep_stepper_propagate for this cycle and view; NULL: none.
/// @param progress_or_null    Receives the progress and may cancel; NULL: none.
/// @param user                Passed to the callback; may be NULL.
/// @param estimate_out        Receives the searched estimate; destroy it with skep_estimate_destroy. Not
///                            written when the call fails.
/// @retval SKEP_ERR_ARGUMENT   No such cycle or view; estimates of another view, scale or scene, or that are
///                             not checked; candidates of another cycle or view.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
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

/// Checks the planes of a view, and prepares them for the next cycle. Four stages, in this order:
///
///   1. consistency check: compares the planes with those of the source views; writes the consistent and
///      validated flags
///   2. correction of foreground fattening, if the scale may end with this cycle (option
///      "refine.fattening_passes"): gives pixels beside a depth edge the plane of the surface that their gray
///      values belong to, or none; changes depths, normals and flags
///   3. plane smoothing (option "refine.smoothing_passes"): changes depths and normals
///   4. publication of the validated surface, which the searches of the next cycle and the averaging of
///      skep_stepper_finish read
///
/// So the call changes depths, normals and flags, in the new estimate. It reads the searched planes of the
/// same cycle of the view's sources; a source without an estimate takes no part in the check.
///
/// @param stepper         The stepper.
/// @param cycle           Number of the cycle.
/// @param view            Number of the view.
/// @param estimates       `estimate_count` pointers by view: searched estimates of this cycle, NULL for none,
///                        except that of the view itself.
/// @param estimate_count  The number of views.
/// @param estimate_out    Receives the checked estimate; destroy it with skep_estimate_destroy.
/// @retval SKEP_ERR_ARGUMENT  No such cycle or view; estimates of another view, scale or scene; none of the
///                            view itself, or one that is checked already.
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
        let sources: Vec<Option<EstimateRef>> =
            estimates.iter().map(|estimate| estimate.map(EstimateRef::from)).collect();
        let at = Place { cycle: cycle as usize, view: view as usize };
        stepper.stepper.check_sources(at, &sources)?;
        let name = format!("estimates[{view}]");
        let own = estimates.get(at.view).copied().flatten();
        let own = own.ok_or_else(|| Failure::argument(&name, "none", "the estimate of the view itself"))?;
        let expected = "one that is searched and not yet checked";
        let own = own.searched().ok_or_else(|| Failure::argument(&name, "checked", expected))?;
        if own.cycle() != at.cycle {
            let value = format!("searched in cycle {}", own.cycle());
            return Err(Failure::argument(&name, value, format!("one that is searched in cycle {cycle}")));
        }
        let checked = stepper.install(|| stepper.stepper.check(own, &sources))?;
        out.give(skep_estimate::new(AnyEstimate::Checked(checked)));
        Ok(())
    })
}

/// Upsamples a checked estimate to the next finer scale: each pixel gets the plane of its coarse pixel, with
/// its flags.
///
/// Reads the estimate only.
///
/// @param stepper       The stepper.
/// @param cycle         Number of a cycle on the finer scale.
/// @param view          Number of the view.
/// @param estimate      The checked estimate of the view, on the scale before.
/// @param estimate_out  Receives the checked estimate on the finer scale; destroy it with
///                      skep_estimate_destroy.
/// @retval SKEP_ERR_ARGUMENT  No such cycle or view; an estimate of another view, scale or scene, or that is
///                            not checked.
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
        stepper.stepper.size(cycle as usize, view as usize)?;
        if estimate.view() != view as usize {
            let (value, expected) =
                (format!("the estimate of view {}", estimate.view()), format!("that of view {view}"));
            return Err(Failure::argument("estimate", value, expected));
        }
        let upsampled = stepper.install(|| stepper.stepper.upsample(cycle as usize, estimate))?;
        out.give(skep_estimate::new(AnyEstimate::Checked(upsampled)));
        Ok(())
    })
}

/// Gets the cycle that follows a cycle. A scale ends early when the fraction of changed pixels in all given
/// estimates is below option "schedule.min_changed_fraction".
///
/// Reads the numbers of changed pixels only.
///
/// @param stepper         The stepper.
/// @param cycle           Number of the cycle that was searched and checked.
/// @param estimates       `estimate_count` pointers by view: checked estimates of this cycle, NULL for none;
///                        may be NULL when `estimate_count` is 0.
/// @param estimate_count  The number of views, or 0.
/// @param next_out        Receives the number of the next cycle; SKEP_CYCLE_NONE after the last.
/// @retval SKEP_ERR_ARGUMENT  No such cycle; estimates of another view, scale or scene, or that are not
///                            checked.
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

/// Finishes a view after the last cycle. Four stages, in this order:
///
///   1. averaging of the validated planes with those of the source views (option
///      "refine.cross_view_averaging"); reads the published surfaces of the last cycle of the view's sources
///   2. gap filling from the surrounding planes (option "refine.fill_gaps")
///   3. check of the filled pixels against the planes of the source views as they were before averaging:
///      reads the checked planes of the last cycle of the view's sources; pixels that fail keep what they had
///   4. classification: determines view set, cost and status of every pixel
///
/// The estimates are not changed.
///
/// @param stepper           The stepper.
/// @param view              Number of the view.
/// @param estimates         `estimate_count` pointers by view: checked estimates of the last cycle, NULL for
///                          none, except that of the view itself.
/// @param estimate_count    The number of views.
/// @param progress_or_null  Receives the progress and may cancel; NULL: none.
/// @param user              Passed to the callback; may be NULL.
/// @param result_out        Receives a result that holds this view alone, under its number; destroy it with
///                          skep_result_destroy. Not written when the call fails.
/// @retval SKEP_ERR_ARGUMENT   No such view; estimates of another view, scale or scene, or that are not
///                             checked; none of the view itself.
/// @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
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
