//! A run, stage by stage (section 3 of the paper and beyond).
//!
//! What a stage changes is in its name and signature, and what it reads of the estimates of other views is in
//! the types of its inputs: checked planes, searched planes, or published surfaces. Images and cameras of all
//! views are in the context. A stage of one view needs nothing else of other views: it can run in this
//! process or in another, from memory or from files.

mod context;
mod cycle;
mod estimate;
mod progress;
mod result;
mod serialize;
mod sources;
mod stages;
mod status;
mod stepper;
mod store;
#[cfg(feature = "io")]
mod streamed;
mod view_tasks;

use crate::error::Result;
use crate::memory::require_memory;
use crate::options::Options;
use crate::parallel::{Bands, JoinedPool, Phase, ProgressFn, useful_threads};
use crate::scene::Scene;
use context::RunContext;
pub(crate) use cycle::Place;
pub use cycle::{Cycle, CycleRecord};
#[cfg(feature = "io")]
pub(crate) use estimate::CheckedPlanes;
pub use estimate::{AnyEstimate, Checked, EstimateRef, OwnMaps, Searched, ViewEstimate};
pub(crate) use progress::Tracker;
pub use result::{Reconstruction, ViewResult};
#[cfg(feature = "io")]
pub(crate) use serialize::ReadEstimate;
pub use stages::Candidates;
use stages::{Propagation, SearchInput};
pub use stepper::Stepper;
use store::Store;
#[cfg(feature = "io")]
pub(crate) use streamed::CheckedEstimates;

/// Estimates depth, normal and view set of every pixel of every view, and fuses the validated ones into
/// points.
///
/// Runs on a thread pool of its own, joined before it returns; may be called from several threads at once.
/// The same scene, options and crate version give the same bits for any number of threads and any instruction
/// set.
///
/// # Errors
/// An option out of its range, named; less memory than the run needs; [`crate::Error::Cancelled`] when
/// `progress` returns `Break`.
pub fn reconstruct(scene: &Scene, options: &Options, progress: ProgressFn) -> Result<Reconstruction> {
    options.check()?;
    let pixels: u64 = scene.views().iter().map(|view| view.camera.pixels() as u64).sum();
    require_memory(pixels * BYTES_PER_PIXEL, "a run in memory, of all views at a time,")?;
    JoinedPool::new(thread_count(scene, options))?.install(|| run(scene, options, progress))
}

/// Bytes that a run in memory takes at least for each pixel of all views together.
const BYTES_PER_PIXEL: u64 = 40;

/// The number of threads that [`reconstruct`] starts: that of the option `threads`, or one for each core; but
/// at most four for each core, and no more than there are pairs of rows in all images.
pub fn thread_count(scene: &Scene, options: &Options) -> usize {
    let bands = scene.views().iter().map(|view| Bands::most(view.camera.height as usize));
    useful_threads(options.threads, bands.sum())
}

/// The cycles of all scales, coarse to fine, then the end of the run.
fn run(scene: &Scene, options: &Options, report: ProgressFn) -> Result<Reconstruction> {
    let mut tracker = Tracker::new(report);
    let context = RunContext::new(scene, options, &|_| tracker.advance(0, progress::start(scene)))?;
    tracker.set_work(context.work_before(context.cycles().len()));
    let mut estimates = Store::unknown(context.views());
    let mut next = Some(0);
    while let Some(cycle) = next {
        estimates = run_cycle(&context, cycle, estimates, &tracker)?;
        next = context.next_cycle(cycle, estimates.last_records());
        tracker.jump_to(context.work_before(next.unwrap_or(context.cycles().len())));
    }
    let views = finish(&context, estimates, &tracker)?;
    let warnings = context.warnings().to_vec();
    drop(context);
    let points = stages::fuse(scene, options, &views, &|at| tracker.report_fusion(at))?;
    Ok(Reconstruction { views, points, warnings })
}

/// One cycle: every view is searched from the estimates of the cycle before, then all are checked against
/// each other.
fn run_cycle(
    context: &RunContext,
    cycle: usize,
    previous: Store<Option<ViewEstimate<Checked>>>,
    tracker: &Tracker,
) -> Result<Store<Option<ViewEstimate<Checked>>>> {
    let at = |view| Place { cycle, view };
    let searching = |view, units| tracker.advance(units, context.progress(Phase::Search, at(view)));
    let checking = |view, units| tracker.advance(units, context.progress(Phase::Check, at(view)));

    let upsample = |view, own| stages::upsample(context, at(view), own);
    let previous = previous.map(|view, own: Option<_>| Ok(own.map(|own| upsample(view, own))))?;

    // Reads the checked planes of the views that have this one among their sources.
    let candidates = previous.map_ref(|view, own| {
        let own = own.as_ref().map(ViewEstimate::as_own);
        let mut propagation = Propagation::new(context, at(view), own);
        for &donor in propagation.donors() {
            let planes = previous.planes(donor as usize).unwrap_or_default();
            propagation.add(donor as usize, planes, &|units| searching(view, units))?;
        }
        Ok(propagation.finish())
    })?;

    // Reads the surfaces that the sources published. A view's own planes are freed as soon as it is searched.
    let (previous, surfaces) = previous.take_surfaces();
    let searched = previous.zip(candidates).map(|view, (own, candidates)| {
        let images = context.images(at(view))?;
        let problem = context.problem(at(view), &images, surfaces.of_sources(context.sources(view)));
        let own = own.as_ref().map(ViewEstimate::as_own);
        let input = SearchInput { own, candidates: Some(&candidates), is_guided: own.is_some() };
        let found = stages::search(context, at(view), &problem, input, &|units| searching(view, units))?;
        let found = stages::fill_textureless(context, &problem, found);
        Ok(stages::record_search(context, own, found))
    })?;
    drop(surfaces);

    // Reads the searched planes of the sources.
    let verdicts = searched.map_ref(|view, own| {
        let sources = searched.planes_of_sources(context.sources(view));
        stages::check(context, own, sources, &|units| checking(view, units))
    })?;

    // Each view independently.
    searched.zip(verdicts).map(|view, (own, verdicts)| {
        let image = context.image(at(view))?;
        let mut checked = stages::apply_check(own, &verdicts);
        stages::correct_fattening(context, &image, &mut checked);
        stages::smooth_planes(context, &image, &mut checked);
        Ok(Some(stages::publish(context, checked)))
    })
}

/// The end of a run: from the checked estimates of the last cycle to results.
fn finish(
    context: &RunContext,
    estimates: Store<Option<ViewEstimate<Checked>>>,
    tracker: &Tracker,
) -> Result<Vec<ViewResult>> {
    let at = |view| Place { cycle: context.cycles().len() - 1, view };
    let advance = |view, units| tracker.advance(units, context.progress(Phase::Check, at(view)));
    let estimates = estimates.all_known();

    // Reads the surfaces that the sources published and, for the recheck, their planes as they were before
    // averaging.
    let filled = estimates.map_ref(|view, own| {
        let images = context.images(at(view))?;
        let surfaces = estimates.surfaces_of_sources(context.sources(view));
        let problem = context.problem(at(view), &images, surfaces);
        let averaged = stages::average_across_views(context, &problem, own.as_own());
        let filled = stages::fill_gaps(context, at(view), &images.own, &averaged);
        let sources = estimates.planes_of_sources(context.sources(view));
        stages::recheck(context, &problem, filled, sources, &|units| advance(view, units))
    })?;

    // Reads the surfaces that the sources published. Repeats the averaging: to keep the averaged planes of
    // all views since gap filling would take half as much memory again.
    let (estimates, surfaces) = estimates.take_surfaces();
    let results = estimates.zip(filled).map(|view, (own, filled)| {
        let images = context.images(at(view))?;
        let problem = context.problem(at(view), &images, surfaces.of_sources(context.sources(view)));
        let mut planes = stages::average_across_views(context, &problem, own.as_own());
        filled.write_to(&mut planes);
        stages::remove_speckles(context, at(view), &images.own, &mut planes);
        stages::classify(context, &problem, own.as_own(), planes, &filled, &|units| advance(view, units))
    })?;
    Ok(results.into_vec())
}
