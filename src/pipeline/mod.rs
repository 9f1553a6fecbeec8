//! The cycles (section 3 of the paper): search every view, check the views against each other, let what was validated
//! guide the next search; from the coarsest scale to full size; then fuse.

mod cycle;
mod estimate;
mod finish;
mod progress;
mod result;
mod serialize;
mod stages;
mod status;
mod stepper;

use crate::error::Result;
use crate::fusion::PointCloud;
use crate::fusion::{self, FusionView};
use crate::options::Options;
use crate::parallel::JoinedPool;
use crate::scene::CompactPlane;
use crate::scene::Scene;
pub use cycle::Cycle;
pub use estimate::{OwnMaps, ViewEstimate};
pub(crate) use progress::{Cancelled, Tracker};
pub use progress::{Hook, Phase, Progress, ignore_progress};
use rayon::prelude::*;
pub use result::{CycleRecord, Reconstruction, ViewResult};
use stages::Shown;
pub use stages::{Candidates, Verdicts};
use std::ops::ControlFlow;
pub use stepper::Stepper;

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
        downscale: 1,
        cycle: 0,
        view: 0,
        views: scene.views().len(),
        done: 0.0,
    };
    let stepper = Stepper::new_with(scene, options, &|| hook(&start).is_break())?;
    let work_before = |cycle| stepper.all()[..cycle].iter().map(|cycle| cycle.work(scene)).sum::<u64>();
    let total = work_before(stepper.all().len());
    let tracker = Tracker::new(hook, (total as f64 / (1.0 - FUSION_SHARE)) as u64);
    let mut estimates: Vec<ViewEstimate> = Vec::new();
    let mut next = Some(0);
    while let Some(cycle) = next {
        estimates = run_cycle(&stepper, cycle, estimates, &tracker)?;
        next = stepper.next(cycle, &some(&estimates))?;
        tracker.jump_to(work_before(next.unwrap_or(stepper.all().len())));
    }
    let views = finish(&stepper, estimates, &tracker)?;
    let warnings = stepper.warnings().to_vec();
    drop(stepper);
    let points = fuse(scene, options, &views, hook)?;
    Ok(Reconstruction { views, points, warnings })
}

/// One cycle: every view is searched from the estimates the last cycle left, then all are checked.
fn run_cycle(
    stepper: &Stepper,
    cycle: usize,
    estimates: Vec<ViewEstimate>,
    tracker: &Tracker,
) -> Result<Vec<ViewEstimate>> {
    let views = stepper.views();
    let estimates = each_view(estimates, |view, estimate| match stepper.is_coarser(&estimate, cycle) {
        true => stepper.upsample(cycle, view, &estimate),
        false => Ok(estimate),
    })?;
    let searching = |view| stepper.all()[cycle].progress(Phase::Search, view, views);
    let before = some(&estimates);
    let candidates = each_view(vec![(); views], |view, ()| {
        stepper.propagate_with(cycle, view, &before, &|| tracker.advance(0, searching(view)))
    })?;
    // From here on a view's own estimate is of no use to the others, and goes as soon as the view is searched.
    let (surfaces, owns) = shown(estimates, views);
    let given = owns.into_iter().zip(candidates).collect();
    let searched = each_view(given, |view, (own, candidates): (Option<ViewEstimate>, Candidates)| {
        let shown = Shown { surfaces: &|view| &surfaces[view], is_guided: own.is_some() };
        let advance = |units| tracker.advance(units, searching(view));
        stepper.search_from((cycle, view), own.as_ref(), shown, Some(&candidates), &advance)
    })?;
    drop(surfaces);
    let found = some(&searched);
    let verdicts = each_view(vec![(); views], |view, ()| {
        let progress = stepper.all()[cycle].progress(Phase::Check, view, views);
        stepper.check_with(cycle, view, &found, &|| tracker.advance(0, progress))
    })?;
    let searched = searched.into_iter().zip(&verdicts).collect();
    each_view(searched, |view, (mut estimate, verdicts): (ViewEstimate, _)| {
        stepper.mark(view, &mut estimate, verdicts)?;
        estimate.forget_view_sets();
        Ok(estimate)
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

/// What the estimates show of all views, empty before there are any, and the estimates without it.
fn shown(estimates: Vec<ViewEstimate>, views: usize) -> (Vec<Vec<CompactPlane>>, Vec<Option<ViewEstimate>>) {
    let mut estimates: Vec<Option<ViewEstimate>> = estimates.into_iter().map(Some).collect();
    estimates.resize_with(views, || None);
    let show = |estimate: &mut Option<ViewEstimate>| {
        estimate.as_mut().map(|estimate| std::mem::take(&mut estimate.solved.surface)).unwrap_or_default()
    };
    (estimates.iter_mut().map(show).collect(), estimates)
}

/// The estimates of all views as the stepper take them.
fn some(estimates: &[ViewEstimate]) -> Vec<Option<&ViewEstimate>> {
    estimates.iter().map(Some).collect()
}

/// Settles what became of every pixel.
fn finish(stepper: &Stepper, estimates: Vec<ViewEstimate>, tracker: &Tracker) -> Result<Vec<ViewResult>> {
    let views = stepper.views();
    let last = stepper.all().last().expect("options have a scale");
    let advance = |view, units| tracker.advance(units, last.progress(Phase::Check, view, views));
    let known = some(&estimates);
    let closings =
        each_view(vec![(); views], |view, ()| stepper.closings(view, &known, &|units| advance(view, units)))?;
    // What closes the gaps is all that a view takes from other views' own estimates.
    let (surfaces, owns) = shown(estimates, views);
    let given = owns.into_iter().flatten().zip(closings).collect();
    each_view(given, |view, (own, closings): (ViewEstimate, Vec<_>)| {
        stepper.settle(&own, &|view| &surfaces[view], &closings, &|units| advance(view, units))
    })
}

fn fuse(scene: &Scene, options: &Options, results: &[ViewResult], hook: Hook) -> Result<PointCloud> {
    let overlaps = fusion::overlaps(results.len(), scene.points());
    let views: Vec<FusionView> = (scene.views().iter().zip(results).zip(&overlaps))
        .map(|((view, result), overlap)| FusionView {
            camera: &view.camera,
            maps: &result.estimate,
            status: Some(&result.status),
            picture: Some(&view.picture),
            overlap,
        })
        .collect();
    let hook = |at: &Progress| -> ControlFlow<()> {
        hook(&Progress { done: 1.0 - FUSION_SHARE * (1.0 - at.done), ..*at })
    };
    fusion::fuse(&views, &options.fusion, &hook)
}
