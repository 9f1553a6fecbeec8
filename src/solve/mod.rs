//! The cycles (section 3 of the paper): search every view, check the views against each other, let what was validated
//! guide the next search; from the coarsest scale to full size; then fuse.

mod results;
mod schedule;
mod view;

use crate::consistency::{self, ConsistencyRules};
use crate::error::{Error, Result};
use crate::image::ScaledView;
use crate::kernels::Window;
use crate::maps::{Counts, CycleRecord, Reconstruction};
use crate::options::Options;
use crate::progress::{Hook, Phase, Tracker};
use crate::scene::Scene;
use crate::simd::Level;
use crate::state::{Solution, ViewState};
use crate::views::{SourceLists, source_lists};
use schedule::Step;

/// Estimates depth, normal and view set of every pixel of every view, and fuses the validated ones.
///
/// Runs on a thread pool of its own, joined before it returns; may be called from several threads at once. The same
/// scene, options and crate version give the same bits for any number of threads and any instruction set.
///
/// # Errors
/// An option out of its range, named; [`Error::Cancelled`] when the hook breaks.
pub fn reconstruct(scene: &Scene, options: &Options, hook: Hook) -> Result<Reconstruction> {
    options.check()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads);
    let run = |pool: &rayon::ThreadPool| pool.install(|| Run::new(scene, options, hook).run());
    pool.build_scoped(|thread| thread.run(), run).map_err(|error| {
        let expected = format!("a number of threads that the system can start ({error})");
        Error::argument("options.threads", options.threads, expected)
    })?
}

/// What stays the same during a run, and what it keeps a record of.
struct Run<'a> {
    scene: &'a Scene,
    options: &'a Options,
    hook: Hook<'a>,
    level: Level,
    window: Window,
    sources: SourceLists,
    cycles: Vec<Vec<CycleRecord>>,
    counts: Vec<Counts>,
}

impl<'a> Run<'a> {
    fn new(scene: &'a Scene, options: &'a Options, hook: Hook<'a>) -> Run<'a> {
        let window = Window::new(
            options.window_radius,
            options.window_step,
            options.spatial_sigma,
            options.colour_sigma,
            options.min_variance,
        );
        Run {
            scene,
            options,
            hook,
            level: options.simd.unwrap_or_else(Level::detect),
            window,
            sources: source_lists(scene, options),
            cycles: vec![Vec::new(); scene.views().len()],
            counts: vec![Counts::default(); scene.views().len()],
        }
    }

    fn run(mut self) -> Result<Reconstruction> {
        let steps = Step::all(self.options);
        let total: u64 = steps.iter().map(|step| step.work(self.scene)).sum();
        let tracker = Tracker::new(self.hook, (total as f64 / (1.0 - results::FUSION_SHARE)) as u64);
        let mut finished = 0;
        let mut views = Vec::new();
        let mut states = Vec::new();
        let mut settled_scale = None;
        for step in steps {
            if step.cycle == 0 {
                let finer = ScaledView::all(self.scene, step.scale.halvings);
                states = hand_up(&states, &views, &finer);
                views = finer;
            }
            if settled_scale != Some(step.scale_index) {
                let changed = self.cycle(step, &views, &mut states, &tracker)?;
                if step.cycle > 0 && changed < self.options.stop_share {
                    settled_scale = Some(step.scale_index);
                }
            }
            finished += step.work(self.scene);
            tracker.jump_to(finished);
        }
        self.finish(&views, &states, &tracker)
    }

    /// One cycle: every view is searched from the states the last cycle left, then all are checked. Gives the share of
    /// pixels that changed.
    fn cycle(
        &mut self,
        step: Step,
        views: &[ScaledView],
        states: &mut Vec<ViewState>,
        tracker: &Tracker,
    ) -> Result<f64> {
        let mut searched = Vec::with_capacity(views.len());
        for view in 0..views.len() {
            searched.push(self.search(step, view, views, states, tracker)?);
        }
        let verdicts = self.check(step, views, &searched, tracker)?;
        let (mut changed, mut pixels) = (0, 0);
        for (view, (state, verdicts)) in searched.iter_mut().zip(&verdicts).enumerate() {
            state.mark(&views[view].camera, verdicts);
            let record = CycleRecord {
                reduction: step.reduction(),
                cycle: step.cycle,
                pixels: state.solutions.iter().filter(|solution| solution.depth > 0.0).count() as u64,
                changed: count_changed(&states[view].solutions, &state.solutions),
                validated: state.validated(),
            };
            changed += record.changed;
            pixels += record.pixels;
            self.cycles[view].push(record);
        }
        *states = searched;
        Ok(changed as f64 / pixels.max(1) as f64)
    }

    /// The geometric consistency check of every view against the solutions all have just found.
    fn check(
        &self,
        step: Step,
        views: &[ScaledView],
        searched: &[ViewState],
        tracker: &Tracker,
    ) -> Result<Vec<Vec<(u8, bool)>>> {
        let rules = ConsistencyRules::new(self.options);
        let mut verdicts = Vec::with_capacity(views.len());
        for view in 0..views.len() {
            let reference = self.reference(view, views, searched);
            let list = &self.sources.lists[view];
            let sources: Vec<&ViewState> = list.iter().map(|&source| &searched[source as usize]).collect();
            verdicts.push(consistency::check(&reference, &searched[view], &sources, &rules));
            if tracker.advance(0, step.progress(Phase::Check, view, views.len())) {
                return Err(Error::Cancelled);
            }
        }
        Ok(verdicts)
    }
}

/// The states to start a scale from: none at first, then those of the next coarser scale.
fn hand_up(states: &[ViewState], coarse: &[ScaledView], fine: &[ScaledView]) -> Vec<ViewState> {
    if states.is_empty() {
        return vec![ViewState::default(); fine.len()];
    }
    let refined = |(view, state): (usize, &ViewState)| {
        state.refined(&coarse[view].camera, &fine[view].camera, fine[view].range)
    };
    states.iter().enumerate().map(refined).collect()
}

/// A solution changed when its depth moved by more than this share.
const CHANGE: f32 = 1e-3;

fn count_changed(before: &[Solution], after: &[Solution]) -> u64 {
    let changed = |(pixel, solution): &(usize, &Solution)| {
        let before = before.get(*pixel).map_or(0.0, |solution| solution.depth);
        solution.depth > 0.0 && (solution.depth - before).abs() > CHANGE * solution.depth
    };
    after.iter().enumerate().filter(changed).count() as u64
}
