//! The cycles (section 3 of the paper): search every view, check the views against each other, let what was validated
//! guide the next search; from the coarsest scale to full size; then fuse.

mod bytes;
mod prepare;
mod result;
mod schedule;
mod search;
mod state;

use crate::error::Result;
use crate::fusion::{self, FusionView};
use crate::maps::{PointCloud, Reconstruction, ViewResult};
use crate::options::Options;
use crate::pool::JoinedPool;
use crate::progress::{Hook, Phase, Progress, Tracker};
use crate::scene::Scene;
use crate::views::ShownPlane;
pub use prepare::Steps;
use rayon::prelude::*;
pub use schedule::Step;
use search::Shown;
pub use search::{Offers, Verdicts};
pub use state::{OwnMaps, State};
use std::ops::ControlFlow;

/// Estimates depth, normal and view set of every pixel of every view, and fuses the validated ones.
///
/// Runs on a thread pool of its own, joined before it returns; may be called from several threads at once. The same
/// scene, options and crate version give the same bits for any number of threads and any instruction set.
///
/// # Errors
/// An option out of its range, named; [`crate::Error::Cancelled`] when the hook breaks.
pub fn reconstruct(scene: &Scene, options: &Options, hook: Hook) -> Result<Reconstruction> {
    options.check()?;
    JoinedPool::new(options.threads)?.install(|| run(scene, options, hook))
}

/// Threads that find work enough in one view most of the time.
const THREADS_PER_VIEW: usize = 4;
/// Share of the whole work that fusion is reckoned at.
const FUSION_SHARE: f64 = 0.03;

fn run(scene: &Scene, options: &Options, hook: Hook) -> Result<Reconstruction> {
    let start = Progress {
        phase: Phase::Search,
        reduction: 1,
        cycle: 0,
        view: 0,
        views: scene.views().len(),
        done: 0.0,
    };
    let steps = Steps::new_with(scene, options, &|| hook(&start).is_break())?;
    let work_before = |step| steps.all()[..step].iter().map(|step| step.work(scene)).sum::<u64>();
    let total = work_before(steps.all().len());
    let tracker = Tracker::new(hook, (total as f64 / (1.0 - FUSION_SHARE)) as u64);
    let mut states: Vec<State> = Vec::new();
    let mut next = Some(0);
    while let Some(step) = next {
        states = cycle(&steps, step, states, &tracker)?;
        next = steps.next(step, &some(&states))?;
        tracker.jump_to(work_before(next.unwrap_or(steps.all().len())));
    }
    let views = finish(&steps, states, &tracker)?;
    let warnings = steps.warnings().to_vec();
    drop(steps);
    let points = fuse(scene, options, &views, hook)?;
    Ok(Reconstruction { views, points, warnings })
}

/// One cycle: every view is searched from the states the last cycle left, then all are checked.
fn cycle(steps: &Steps, step: usize, states: Vec<State>, tracker: &Tracker) -> Result<Vec<State>> {
    let views = steps.views();
    let states = each_view(states, |view, state| match steps.is_coarser(&state, step) {
        true => steps.hand_up(step, view, &state),
        false => Ok(state),
    })?;
    let searching = |view| steps.all()[step].progress(Phase::Search, view, views);
    let before = some(&states);
    let offers = each_view(vec![(); views], |view, ()| {
        steps.propagate_with(step, view, &before, &|| tracker.advance(0, searching(view)))
    })?;
    // From here on a view's own state is of no use to the others, and goes as soon as the view is searched.
    let (surfaces, owns) = shown(states, views);
    let given = owns.into_iter().zip(offers).collect();
    let searched = each_view(given, |view, (own, offers): (Option<State>, Offers)| {
        let shown = Shown { surfaces: &|view| &surfaces[view], is_guided: own.is_some() };
        let advance = |units| tracker.advance(units, searching(view));
        steps.search_from((step, view), own.as_ref(), shown, Some(&offers), &advance)
    })?;
    drop(surfaces);
    let found = some(&searched);
    let verdicts = each_view(vec![(); views], |view, ()| {
        let progress = steps.all()[step].progress(Phase::Check, view, views);
        steps.check_with(step, view, &found, &|| tracker.advance(0, progress))
    })?;
    let searched = searched.into_iter().zip(&verdicts).collect();
    each_view(searched, |view, (mut state, verdicts): (State, _)| {
        steps.mark(view, &mut state, verdicts)?;
        state.forget_view_sets();
        Ok(state)
    })
}

/// Does the same to all views, some at a time. The threads share the work on one view, and while there is not enough of
/// it for all of them they work on another one; more views at a time would take more memory.
fn each_view<T: Send, R: Send>(views: Vec<T>, each: impl Fn(usize, T) -> Result<R> + Sync) -> Result<Vec<R>> {
    let at_a_time = 1 + (rayon::current_num_threads() + THREADS_PER_VIEW / 2) / THREADS_PER_VIEW;
    let mut turns: Vec<Vec<(usize, T)>> = (0..at_a_time).map(|_| Vec::new()).collect();
    for (view, input) in views.into_iter().enumerate() {
        turns[view % at_a_time].push((view, input));
    }
    let one_by_one = |views: Vec<(usize, T)>| -> Result<Vec<(usize, R)>> {
        views.into_iter().map(|(view, input)| Ok((view, each(view, input)?))).collect()
    };
    let done: Vec<_> = turns.into_par_iter().with_max_len(1).map(one_by_one).collect::<Result<_>>()?;
    let mut done: Vec<(usize, R)> = done.into_iter().flatten().collect();
    done.sort_unstable_by_key(|(view, _)| *view);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

/// What the states show of all views, empty before there are any, and the states without it.
fn shown(states: Vec<State>, views: usize) -> (Vec<Vec<ShownPlane>>, Vec<Option<State>>) {
    let mut states: Vec<Option<State>> = states.into_iter().map(Some).collect();
    states.resize_with(views, || None);
    let show = |state: &mut Option<State>| {
        state.as_mut().map(|state| std::mem::take(&mut state.solved.surface)).unwrap_or_default()
    };
    (states.iter_mut().map(show).collect(), states)
}

/// The states of all views as the steps take them.
fn some(states: &[State]) -> Vec<Option<&State>> {
    states.iter().map(Some).collect()
}

/// Settles what became of every pixel.
fn finish(steps: &Steps, states: Vec<State>, tracker: &Tracker) -> Result<Vec<ViewResult>> {
    let views = steps.views();
    let last = steps.all().last().expect("options have a scale");
    let advance = |view, units| tracker.advance(units, last.progress(Phase::Check, view, views));
    let known = some(&states);
    let closings =
        each_view(vec![(); views], |view, ()| steps.closings(view, &known, &|units| advance(view, units)))?;
    // What closes the gaps is all that a view takes from other views' own states.
    let (surfaces, owns) = shown(states, views);
    let given = owns.into_iter().flatten().zip(closings).collect();
    each_view(given, |view, (own, closings): (State, Vec<_>)| {
        steps.settle(&own, &|view| &surfaces[view], &closings, &|units| advance(view, units))
    })
}

fn fuse(scene: &Scene, options: &Options, results: &[ViewResult], hook: Hook) -> Result<PointCloud> {
    let overlaps = fusion::overlaps(results.len(), scene.points());
    let views: Vec<FusionView> = (scene.views().iter().zip(results).zip(&overlaps))
        .map(|((view, result), overlap)| FusionView {
            camera: &view.camera,
            maps: &result.estimate,
            outcome: Some(&result.outcome),
            picture: Some(&view.picture),
            overlap,
        })
        .collect();
    let hook = |at: &Progress| -> ControlFlow<()> {
        hook(&Progress { done: 1.0 - FUSION_SHARE * (1.0 - at.done), ..*at })
    };
    fusion::fuse(&views, &options.fusion, &hook)
}
