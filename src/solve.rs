//! The cycles (section 3 of the paper): search every view, check the views against each other, let what was validated
//! guide the next search; from the coarsest scale to full size; then fuse.

use crate::ambc::{CostRules, Search, stream};
use crate::consistency::{self, ConsistencyRules};
use crate::error::{Error, Result};
use crate::fusion::{self, FusionView};
use crate::image::ScaledView;
use crate::kernels::Window;
use crate::maps::{CycleRecord, Maps, PointCloud, Reconstruction, ViewResult};
use crate::options::{Options, Scale};
use crate::outcome;
use crate::progress::{Hook, Phase, Progress, Tracker};
use crate::propagation::{self, Giver};
use crate::scene::Scene;
use crate::simd::Level;
use crate::state::{Solution, ViewState};
use crate::views::{Reference, Source, SourceLists, ViewRules, source_lists};
use std::ops::ControlFlow;

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
    pool.build_scoped(|thread| thread.run(), |pool| pool.install(|| Run::new(scene, options, hook).run()))
        .map_err(|error| {
            Error::argument(
                "options.threads",
                options.threads,
                format!("threads the system can start ({error})"),
            )
        })?
}

/// Share of the whole work that fusion is reckoned at.
const FUSION_SHARE: f64 = 0.03;

struct Run<'a> {
    scene: &'a Scene,
    options: &'a Options,
    hook: Hook<'a>,
    level: Level,
    window: Window,
    lists: SourceLists,
    records: Vec<Vec<CycleRecord>>,
    counts: Vec<crate::maps::Counts>,
}

/// One search in the course of a run.
#[derive(Clone, Copy)]
struct Step {
    scale_index: usize,
    scale: Scale,
    cycle: u32,
}

impl Step {
    fn iterations(&self) -> u32 {
        if self.cycle == 0 { self.scale.first_iterations } else { self.scale.cycle_iterations }
    }

    /// Units of work of searching one view, so that each of its bands' passes counts its pixels and foods.
    fn work(&self, scene: &Scene) -> u64 {
        let pixels: u64 = scene.views().iter().map(|view| view.camera.pixels() as u64).sum();
        let passes = 1 + 2 * u64::from(self.iterations());
        (pixels >> (2 * self.scale.halvings)) * passes * u64::from(self.scale.foods)
    }
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
            lists: source_lists(scene, options),
            records: vec![Vec::new(); scene.views().len()],
            counts: vec![Default::default(); scene.views().len()],
        }
    }

    fn run(mut self) -> Result<Reconstruction> {
        let steps = self.steps();
        let total: u64 = steps.iter().map(|step| step.work(self.scene)).sum();
        let total = (total as f64 / (1.0 - FUSION_SHARE)) as u64;
        let tracker = Tracker::new(self.hook, total);
        let mut finished = 0;
        let mut views = Vec::new();
        let mut states: Vec<ViewState> = Vec::new();
        let mut settled_scale = None;
        for step in steps {
            if step.cycle == 0 {
                let finer = ScaledView::all(self.scene, step.scale.halvings);
                states = hand_up(states, &views, &finer);
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
        self.finish(&views, states)
    }

    /// All searches in order.
    fn steps(&self) -> Vec<Step> {
        let scales = self.options.scales.iter().enumerate();
        let cycles = |(scale_index, &scale): (usize, &Scale)| {
            (0..=scale.cycles).map(move |cycle| Step { scale_index, scale, cycle })
        };
        scales.flat_map(cycles).collect()
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
        let rules = ConsistencyRules::new(self.options);
        let mut verdicts = Vec::with_capacity(views.len());
        for view in 0..views.len() {
            let reference = self.reference(view, views, &searched);
            let sources: Vec<&ViewState> =
                self.lists.lists[view].iter().map(|&s| &searched[s as usize]).collect();
            verdicts.push(consistency::check(&reference, &searched[view], &sources, &rules));
            if tracker.advance(0, self.progress(Phase::Check, step, view)) {
                return Err(Error::Cancelled);
            }
        }
        let (mut changed, mut pixels) = (0, 0);
        for (view, (state, verdicts)) in searched.iter_mut().zip(&verdicts).enumerate() {
            state.mark(&views[view].camera, verdicts);
            let record = CycleRecord {
                reduction: 1 << step.scale.halvings,
                cycle: step.cycle,
                pixels: state.solutions.iter().filter(|solution| solution.depth > 0.0).count() as u64,
                changed: count_changed(&states[view].solutions, &state.solutions),
                validated: state.validated(),
            };
            changed += record.changed;
            pixels += record.pixels;
            self.records[view].push(record);
        }
        *states = searched;
        Ok(changed as f64 / pixels.max(1) as f64)
    }

    /// Searches one view; `states` are those of all views after the last check.
    fn search(
        &mut self,
        step: Step,
        view: usize,
        views: &[ScaledView],
        states: &[ViewState],
        tracker: &Tracker,
    ) -> Result<ViewState> {
        let pixels = views[view].camera.pixels();
        if self.lists.lists[view].is_empty() {
            return Ok(ViewState {
                solutions: vec![Solution::default(); pixels],
                cost: vec![0.0; pixels],
                ..ViewState::default()
            });
        }
        let has_start = states[view].solutions.len() == pixels;
        let offers = (self.options.propagation && step.cycle > 0).then(|| self.offers(view, views, states));
        let reference = self.reference(view, views, states);
        let progress = self.progress(Phase::Search, step, view);
        let band = u64::from(views[view].camera.width) * 8 * u64::from(step.scale.foods);
        let cancelled = || tracker.advance(band, progress);
        let search = Search {
            mask: views[view].mask.as_deref(),
            start: has_start.then_some(&states[view].solutions),
            offers: offers.as_deref(),
            foods: step.scale.foods as usize,
            iterations: step.iterations(),
            around_start: self.around_start(step),
            stream: stream(&[self.options.seed, view as u64, step.scale_index as u64, u64::from(step.cycle)]),
            ..self.idle_search(&reference, has_start, &cancelled)
        };
        let outcome = search.run()?;
        self.counts[view] += outcome.counts;
        let solution = |food: &crate::ambc::FoodSource| Solution {
            depth: food.depth,
            normal: food.normal,
            ..Solution::default()
        };
        Ok(ViewState {
            solutions: outcome.best.iter().map(solution).collect(),
            cost: outcome.best.iter().map(|food| food.cost).collect(),
            sets: outcome.sets,
            surface: Vec::new(),
        })
    }

    /// A search with everything that is the same in all of them.
    fn idle_search<'b>(
        &'b self,
        reference: &'b Reference<'b>,
        has_start: bool,
        cancelled: &'b (dyn Fn() -> bool + Sync),
    ) -> Search<'b> {
        let is_paper_cost = self.options.aggregation == crate::options::Aggregation::AllViews;
        Search {
            reference,
            window: &self.window,
            cost_rules: CostRules::new(self.options, has_start),
            view_rules: ViewRules::new(self.options, if is_paper_cost { 0 } else { 2 }),
            mask: None,
            start: None,
            offers: None,
            foods: 0,
            iterations: 0,
            trial_limit: self.options.trial_limit.min(u32::from(u16::MAX)) as u16,
            reward: self.options.reward as f32,
            focused_views: self.options.focused_views as usize,
            around_start: (0.0, 0.0),
            stream: 0,
            level: self.level,
            cancelled,
        }
    }

    fn around_start(&self, step: Step) -> (f32, f32) {
        let shrink = 0.5f64.powi(step.cycle as i32);
        ((self.options.restart_spread * shrink) as f32, (self.options.restart_tilt * shrink) as f32)
    }

    /// The planes other views offer to a view.
    fn offers(&self, view: usize, views: &[ScaledView], states: &[ViewState]) -> Vec<crate::ambc::Offer> {
        let givers: Vec<Giver> = (0..views.len())
            .filter(|&giver| self.lists.lists[giver].contains(&(view as u32)))
            .map(|giver| Giver { view: giver, camera: &views[giver].camera, state: &states[giver] })
            .collect();
        propagation::offers(&views[view].camera, &states[view], views[view].range, &givers)
    }

    /// A view and its sources, which show their validated surfaces as far as there are any.
    fn reference<'b>(&self, view: usize, views: &'b [ScaledView], states: &'b [ViewState]) -> Reference<'b> {
        let ScaledView { camera, image, range, .. } = &views[view];
        let mut reference = Reference::new(camera, image, *range);
        for &source in &self.lists.lists[view] {
            let source = source as usize;
            let surface = states.get(source).map_or(&[][..], |state| &state.surface);
            reference.sources.push(Source::new(camera, &views[source].camera, &views[source].image, surface));
        }
        reference
    }

    fn progress(&self, phase: Phase, step: Step, view: usize) -> Progress {
        Progress {
            phase,
            reduction: 1 << step.scale.halvings,
            cycle: step.cycle,
            view,
            views: self.scene.views().len(),
            done: 0.0,
        }
    }

    /// Settles confidence and outcome of every pixel and fuses.
    fn finish(mut self, views: &[ScaledView], states: Vec<ViewState>) -> Result<Reconstruction> {
        let mut results = Vec::with_capacity(views.len());
        for view in 0..views.len() {
            let reference = self.reference(view, views, &states);
            let never = || false;
            let mut search = self.idle_search(&reference, true, &never);
            search.view_rules = ViewRules::new(self.options, 0);
            let assessment = crate::ambc::assess(&search, &states[view].solutions)?;
            let mut counts = self.counts[view];
            counts += assessment.counts;
            let outcome =
                outcome::outcomes(&views[view], &states[view], &assessment, self.lists.lists[view].len());
            results.push(ViewResult {
                estimate: estimate(&states[view].solutions),
                cost: assessment.cost,
                outcome,
                sources: self.lists.lists[view].clone(),
                view_sets: assessment.sets,
                counts,
                cycles: std::mem::take(&mut self.records[view]),
            });
        }
        let points = self.fuse(&results)?;
        Ok(Reconstruction { views: results, points, warnings: self.lists.warnings })
    }

    fn fuse(&self, results: &[ViewResult]) -> Result<PointCloud> {
        let maps: Vec<Maps> = results.iter().map(ViewResult::filtered).collect();
        let overlaps = overlaps(&self.lists.lists);
        let views: Vec<FusionView> = (self.scene.views().iter().zip(&maps).zip(&overlaps))
            .map(|((view, maps), overlap)| FusionView {
                camera: &view.camera,
                maps,
                picture: Some(&view.picture),
                overlap,
            })
            .collect();
        let hook = |at: &Progress| -> ControlFlow<()> {
            (self.hook)(&Progress { done: 1.0 - FUSION_SHARE * (1.0 - at.done), ..*at })
        };
        fusion::fuse(&views, &self.options.fusion, &hook)
    }
}

/// The states to start a scale from: none at first, then those of the coarser scale, refined until the sizes match.
fn hand_up(states: Vec<ViewState>, coarse: &[ScaledView], fine: &[ScaledView]) -> Vec<ViewState> {
    if states.is_empty() {
        return vec![ViewState::default(); fine.len()];
    }
    states
        .iter()
        .enumerate()
        .map(|(view, state)| state.refined(&coarse[view].camera, &fine[view].camera, fine[view].range))
        .collect()
}

/// For each view all views that it is matched with, or that are matched with it.
fn overlaps(lists: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut overlaps = lists.to_vec();
    for (view, list) in lists.iter().enumerate() {
        for &source in list {
            overlaps[source as usize].push(view as u32);
        }
    }
    for overlap in &mut overlaps {
        overlap.sort_unstable();
        overlap.dedup();
    }
    overlaps
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

fn estimate(solutions: &[Solution]) -> Maps {
    Maps {
        depth: solutions.iter().map(|solution| solution.depth).collect(),
        normal: solutions.iter().map(|solution| solution.normal.to_array()).collect(),
    }
}
