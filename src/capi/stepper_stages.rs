//! The stages of a stepwise run in C.

use super::estimate::skep_estimate;
use super::pointers::{destroy, get, out, slice};
use super::progress::{Host, skep_progress_fn};
use super::result::skep_result;
use super::status::{Failure, guard, skep_status};
use super::stepper::{SKEP_CYCLE_NONE, skep_stepper};
use crate::pipeline::{AnyEstimate, Candidates, Checked, EstimateRef, Place, ViewEstimate};
use std::ffi::c_void;

/// Planes of other views, transferred to the pixels of a view. Immutable. They cannot be saved: transfer and
/// search of a view run in the same process.
pub struct skep_candidates {
    candidates: Candidates,
}

/// The estimates of an array, `None` where it holds NULL.
///
/// # Safety
/// Every pointer is NULL or points to an estimate, for `'a`.
unsafe fn estimate_list<'a>(
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
unsafe fn checked_list<'a>(
    estimates: &[*const skep_estimate],
) -> Result<Vec<Option<&'a ViewEstimate<Checked>>>, Failure> {
    // SAFETY: as promised by the caller.
    let estimates = unsafe { estimate_list(estimates) }?;
    let checked = |(index, estimate): (usize, Option<&'a AnyEstimate>)| {
        estimate.map(|estimate| require_checked(estimate, &format!("estimates[{index}]"))).transpose()
    };
    estimates.into_iter().enumerate().map(checked).collect()
}

/// Refuses an estimate that is not checked; `name` is how the error calls it.
fn require_checked<'a>(estimate: &'a AnyEstimate, name: &str) -> Result<&'a ViewEstimate<Checked>, Failure> {
    let expected = "one that is checked";
    estimate.checked().ok_or_else(|| Failure::argument(name, "searched and not yet checked", expected))
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
        let estimates = unsafe { checked_list(estimates) }?;
        let propagate = || stepper.inner().propagate(cycle as usize, view as usize, &estimates);
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
        let estimates = unsafe { checked_list(estimates) }?;
        let host = Host::new(progress_or_null, user);
        let search = || {
            stepper.inner().search(cycle as usize, view as usize, &estimates, candidates, &|at| host.tell(at))
        };
        out.give(skep_estimate::new(AnyEstimate::Searched(stepper.install(search)?)));
        Ok(())
    })
}

/// Checks the planes of a view, and prepares them for the next cycle. Four stages, in this order:
///
///   1. consistency check: compares the planes with those of the source views; writes the
///      number of consistent views, and which planes are validated
///   2. correction of foreground fattening, if the scale may end with this cycle (option
///      "refine.fattening_passes"): gives validated pixels beside a depth edge the plane of the surface
///      behind where their gray values are closer to it; in the last cycle some keep their plane and lose
///      their validation
///   3. plane smoothing (option "refine.smoothing_passes"): changes depths and normals
///   4. publication of the validated surface, which the searches of the next cycle and the averaging of
///      skep_stepper_finish read
///
/// So the new estimate differs in depths, normals, numbers of consistent views and validation; the view sets
/// are dropped, costs stay. The call reads depths and normals of the view's sources, searched in the same
/// cycle; for a source with maps of the host's own (skep_estimate_from_maps) its checked estimate is taken. A
/// source without an estimate takes no part in the check.
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
        let estimates = unsafe { estimate_list(estimates) }?;
        let sources: Vec<Option<EstimateRef>> =
            estimates.iter().map(|estimate| estimate.map(EstimateRef::from)).collect();
        let at = Place { cycle: cycle as usize, view: view as usize };
        stepper.inner().check_sources(at, &sources)?;
        let name = format!("estimates[{view}]");
        let own = estimates.get(at.view).copied().flatten();
        let own = own.ok_or_else(|| Failure::argument(&name, "none", "the estimate of the view itself"))?;
        let expected = "one that is searched and not yet checked";
        let own = own.searched().ok_or_else(|| Failure::argument(&name, "checked", expected))?;
        if own.cycle() != at.cycle {
            let value = format!("searched in cycle {}", own.cycle());
            return Err(Failure::argument(&name, value, format!("one that is searched in cycle {cycle}")));
        }
        let checked = stepper.install(|| stepper.inner().check(own, &sources))?;
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
        stepper.inner().size(cycle as usize, view as usize)?;
        if estimate.view() != view as usize {
            let (value, expected) =
                (format!("the estimate of view {}", estimate.view()), format!("that of view {view}"));
            return Err(Failure::argument("estimate", value, expected));
        }
        let upsampled = stepper.install(|| stepper.inner().upsample(cycle as usize, estimate))?;
        out.give(skep_estimate::new(AnyEstimate::Checked(upsampled)));
        Ok(())
    })
}

/// Gets the cycle that follows a cycle. From its second cycle on, a scale ends early when the fraction of
/// changed pixels in all given estimates is below option "schedule.min_changed_fraction".
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
        let estimates = unsafe { checked_list(estimates) }?;
        let next = stepper.inner().next(cycle as usize, &estimates)?;
        out.set(next.map_or(SKEP_CYCLE_NONE, |next| next as u32));
        Ok(())
    })
}

/// Finishes a view after the last cycle. Five stages, in this order:
///
///   1. averaging of the validated planes with those of the source views (option
///      "refine.cross_view_averaging"); reads the published surfaces of the last cycle of the view's sources
///   2. gap filling from the surrounding planes (option "refine.fill_gaps")
///   3. check of the filled pixels against the planes of the source views as they were before averaging:
///      reads the checked planes of the last cycle of the view's sources; pixels that fail keep what they had
///   4. speckle removal: small islands of planes lose their validation (option "refine.max_speckle_size")
///   5. classification: determines view set, cost and status of every pixel
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
        let estimates = unsafe { checked_list(estimates) }?;
        let host = Host::new(progress_or_null, user);
        let finish = || stepper.inner().finish(view as usize, &estimates, &|at| host.tell(at));
        out.give(skep_result::of_view(view, stepper.install(finish)?));
        Ok(())
    })
}
