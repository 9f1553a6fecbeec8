//! A run taken apart, in C.

use super::options::{options_or_default, skep_options};
use super::pointers::{destroy, get, give_list, out, slice, wanted_one};
use super::progress::{Host, skep_progress_fn};
use super::result::skep_result;
use super::scene::{no_view, skep_scene};
use super::state::skep_state;
use super::status::{Failure, guard, skep_status};
use crate::pool::JoinedPool;
use crate::solve::{Offers, State, Steps};
use std::ffi::c_void;

/// A run taken apart, for hosts that schedule views themselves, on one machine or on many, or that bring maps of their
/// own. Holds what all steps share (images of all scales, source views, threads) and never changes: steps of
/// different views may be taken at the same time from several threads. The scene may be destroyed.
///
/// A run is this, for step 0 and then for what skep_steps_next says, until that is SKEP_STEP_NONE:
///   - when the step is on a finer scale than the states, skep_steps_hand_up each of them;
///   - skep_steps_propagate, then skep_steps_search each view, all from the states the step before left;
///   - skep_steps_check each view against what all have just found: that is what the next step starts from.
///
/// After the last, skep_steps_finish each view, and skep_fuse the validated maps. Done so for all views, that gives the
/// same bits as skep_reconstruct.
///
/// States are passed as an array with one pointer for each view of the scene. Looked at are only the view itself, its
/// sources, and the views it is a source of; NULL says that nothing is known of a view. (NULL, 0) knows of none.
pub struct skep_steps {
    steps: Steps,
    pool: JoinedPool,
}

/// Planes that other views offer to the pixels of a view. Never changes.
pub struct skep_offers {
    offers: Offers,
}

/// No step: the run is done.
pub const SKEP_STEP_NONE: u32 = 4294967295;

/// One cycle on one scale.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_step {
    /// Size of the images: 1 is full, 2 half, 4 a quarter.
    pub reduction: u32,
    /// The cycle on that scale, counted from 0.
    pub cycle: u32,
    /// Food sources of each pixel's colony.
    pub foods: u32,
    /// Rounds of bees.
    pub iterations: u32,
}

impl skep_steps {
    pub fn inner(&self) -> &Steps {
        &self.steps
    }

    /// Runs work on the threads of the steps: anywhere else it would start rayon's own, which never end.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.install(work)
    }

    fn states<'a>(&self, states: &[*const skep_state]) -> Result<Vec<Option<&'a State>>, Failure> {
        let place = |(index, &state): (usize, &*const skep_state)| match state.is_null() {
            true => Ok(None),
            // SAFETY: as the header demands of the caller, who holds the states during the call.
            false => Ok(Some(unsafe { get(state, &format!("states[{index}]")) }?.inner())),
        };
        states.iter().enumerate().map(place).collect()
    }
}

/// Prepares the steps of a run.
///
/// SKEP_ERR_ARGUMENT: the scene is not in order (see skep_scene_validate) or an option is out of range.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_create(
    scene: *const skep_scene,
    options_or_null: *const skep_options,
    steps_out: *mut *mut skep_steps,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (scene, options, out) = unsafe {
            (get(scene, "scene")?, options_or_default(options_or_null)?, out(steps_out, "steps_out")?)
        };
        let scene = scene.checked()?;
        options.check()?;
        let pool = JoinedPool::new(options.threads)?;
        let steps = pool.install(|| Steps::new(&scene, &options))?;
        out.give(skep_steps { steps, pool });
        Ok(())
    })
}

/// Destroys steps and ends their threads; NULL is ignored. States and results stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_destroy(steps: *mut skep_steps) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(steps) };
        Ok(())
    });
}

/// The number of steps, and of views. Either output may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_get_count(
    steps: *const skep_steps,
    step_count_out: *mut u32,
    view_count_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let steps = &unsafe { get(steps, "steps") }?.steps;
        // SAFETY: as the header demands of the caller.
        let (step_count, view_count) = unsafe {
            (wanted_one(step_count_out, "step_count_out")?, wanted_one(view_count_out, "view_count_out")?)
        };
        step_count.into_iter().for_each(|out| out.set(steps.all().len() as u32));
        view_count.into_iter().for_each(|out| out.set(steps.views() as u32));
        Ok(())
    })
}

/// What a step does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_get_step(
    steps: *const skep_steps,
    step: u32,
    step_out: *mut skep_step,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, out) = unsafe { (&get(steps, "steps")?.steps, out(step_out, "step_out")?) };
        let found = steps.all().get(step as usize).ok_or_else(|| {
            Failure::argument("step", step, format!("a step below their number, {}", steps.all().len()))
        })?;
        out.set(skep_step {
            reduction: found.reduction(),
            cycle: found.cycle,
            foods: found.scale.foods,
            iterations: found.iterations(),
        });
        Ok(())
    })
}

/// Width and height of a view's maps at a step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_get_size(
    steps: *const skep_steps,
    step: u32,
    view: u32,
    width_out: *mut u32,
    height_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, width, height) = unsafe {
            (&get(steps, "steps")?.steps, out(width_out, "width_out")?, out(height_out, "height_out")?)
        };
        let size = steps.size(step as usize, view as usize)?;
        width.set(size.0);
        height.set(size.1);
        Ok(())
    })
}

/// The source views of a view: those whose states its steps look at. `sources` may be NULL to only ask for their number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_get_sources(
    steps: *const skep_steps,
    view: u32,
    sources: *mut u32,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let steps = &unsafe { get(steps, "steps") }?.steps;
        if view as usize >= steps.views() {
            return Err(no_view(view, steps.views()));
        }
        // SAFETY: as the header demands of the caller.
        unsafe {
            give_list(steps.sources(view as usize), sources, capacity, count_out, ("sources", "count_out"))
        }
    })
}

/// The planes that other views offer to a view: their consistent solutions where it has no validated one of its own.
/// From checked states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_propagate(
    steps: *const skep_steps,
    step: u32,
    view: u32,
    states: *const *const skep_state,
    state_count: usize,
    offers_out: *mut *mut skep_offers,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, states, out) = unsafe {
            (get(steps, "steps")?, slice(states, state_count, "states")?, out(offers_out, "offers_out")?)
        };
        let states = steps.states(states)?;
        let propagate = || steps.steps.propagate(step as usize, view as usize, &states);
        out.give(skep_offers { offers: steps.install(propagate)? });
        Ok(())
    })
}

/// Destroys offers; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_offers_destroy(offers: *mut skep_offers) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(offers) };
        Ok(())
    });
}

/// Searches a view for one cycle: from its own state, helped by what is validated in its sources and by what is offered.
/// Without a state of its own it starts at random. From checked states on the step's scale; gives one that is still to
/// be checked. When it is cancelled or fails, `state_out` is not written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_search(
    steps: *const skep_steps,
    step: u32,
    view: u32,
    states: *const *const skep_state,
    state_count: usize,
    offers_or_null: *const skep_offers,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    state_out: *mut *mut skep_state,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, states, out) = unsafe {
            (get(steps, "steps")?, slice(states, state_count, "states")?, out(state_out, "state_out")?)
        };
        let offers = match offers_or_null.is_null() {
            true => None,
            // SAFETY: as the header demands of the caller.
            false => Some(&unsafe { get(offers_or_null, "offers") }?.offers),
        };
        let states = steps.states(states)?;
        let host = Host::new(progress_or_null, user);
        let search =
            || steps.steps.search(step as usize, view as usize, &states, offers, &|at| host.tell(at));
        out.give(skep_state::new(steps.install(search)?));
        Ok(())
    })
}

/// Checks a view's solutions against what its sources have just found, and gives its state with the verdicts in it. From
/// states that skep_steps_search gave; a source whose state is NULL cannot speak.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_check(
    steps: *const skep_steps,
    step: u32,
    view: u32,
    states: *const *const skep_state,
    state_count: usize,
    state_out: *mut *mut skep_state,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, states, out) = unsafe {
            (get(steps, "steps")?, slice(states, state_count, "states")?, out(state_out, "state_out")?)
        };
        let states = steps.states(states)?;
        let check = || -> crate::Result<Option<State>> {
            let verdicts = steps.steps.check(step as usize, view as usize, &states)?;
            let mut checked = states.get(view as usize).copied().flatten().cloned();
            checked.iter_mut().try_for_each(|state| steps.steps.mark(view as usize, state, &verdicts))?;
            Ok(checked)
        };
        // A check without a state of the view's own has failed.
        if let Some(state) = steps.install(check)? {
            out.give(skep_state::new(state));
        }
        Ok(())
    })
}

/// A checked state on the next finer scale, that of `step`: each pixel gets the plane of its coarse pixel.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_hand_up(
    steps: *const skep_steps,
    step: u32,
    view: u32,
    state: *const skep_state,
    state_out: *mut *mut skep_state,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, state, out) =
            unsafe { (get(steps, "steps")?, get(state, "state")?, out(state_out, "state_out")?) };
        let hand_up = || steps.steps.hand_up(step as usize, view as usize, state.inner());
        out.give(skep_state::new(steps.install(hand_up)?));
        Ok(())
    })
}

/// The step to take after `step` was taken for all views; SKEP_STEP_NONE after the last. A scale ends early when too
/// few pixels of the given states, which are checked ones of `step`, changed (option "stop_share").
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_next(
    steps: *const skep_steps,
    step: u32,
    states: *const *const skep_state,
    state_count: usize,
    next_out: *mut u32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, states, out) = unsafe {
            (get(steps, "steps")?, slice(states, state_count, "states")?, out(next_out, "next_out")?)
        };
        let next = steps.steps.next(step as usize, &steps.states(states)?)?;
        out.set(next.map_or(SKEP_STEP_NONE, |next| next as u32));
        Ok(())
    })
}

/// Averages planes with those of the source views, closes small gaps, and settles source views, cost and outcome of
/// every pixel of a view after the last step, from checked states. The result holds this view alone, under its own
/// number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_steps_finish(
    steps: *const skep_steps,
    view: u32,
    states: *const *const skep_state,
    state_count: usize,
    progress_or_null: skep_progress_fn,
    user: *mut c_void,
    result_out: *mut *mut skep_result,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, states, out) = unsafe {
            (get(steps, "steps")?, slice(states, state_count, "states")?, out(result_out, "result_out")?)
        };
        let states = steps.states(states)?;
        let host = Host::new(progress_or_null, user);
        let finish = || steps.steps.finish(view as usize, &states, &|at| host.tell(at));
        out.give(skep_result::of_view(view, steps.install(finish)?));
        Ok(())
    })
}
