//! The stepper of one view: propagation, search, check.

use super::estimate::ViewEstimate;
use super::stepper::Stepper;
use crate::ambc::{Candidate, CostRules, FoodSource, OnlookerRules, Search, band_rows, stream};
use crate::cross_view::consistency::{self, ConsistencyRules};
use crate::cross_view::propagation::{self, Donor};
use crate::error::{Error, Result};
use crate::geometry::ViewSets;
use crate::matching::{Problem, Source};
use crate::pipeline::CycleRecord;
use crate::pipeline::{Cancelled, Hook, Phase, Tracker};
use crate::refine::foreground_fattening::CorrectFattening;
use crate::refine::plane_smoothing::SmoothPlanes;
use crate::refine::textureless::FillTextureless;
use crate::refine::{Filter, FilteredView};
use crate::scene::CompactPlane;
use crate::scene::ScaledView;
use crate::scene::{PixelEstimate, PlaneMap};
use crate::view_selection::{ViewRules, select_sets};
use rayon::prelude::*;

/// The planes other views offer to the pixels of a view; nothing on a scale's first cycle or with propagation off.
#[derive(Debug, Clone)]
pub struct Candidates {
    cycle: usize,
    view: usize,
    /// Pixels of the view.
    pixels: usize,
    /// The pixels with an offer, a small part of all.
    planes: Vec<(u32, Candidate)>,
}

impl Candidates {
    /// One offer a pixel; `None` where there are none at all.
    fn by_pixel(&self) -> Option<Vec<Candidate>> {
        let mut all = vec![Candidate::default(); if self.planes.is_empty() { 0 } else { self.pixels }];
        self.planes.iter().for_each(|&(pixel, offer)| all[pixel as usize] = offer);
        (!all.is_empty()).then_some(all)
    }
}

/// What a check says of every pixel of a view.
#[derive(Debug, Clone)]
pub struct Verdicts(Vec<(u8, bool)>);

impl Stepper {
    /// The planes other views offer to a view in a cycle.
    ///
    /// # Errors
    /// A cycle or view there is not; estimates of another scale, scene or view than they stand for, or not yet marked.
    pub fn propagate(
        &self,
        cycle: usize,
        view: usize,
        estimates: &[Option<&ViewEstimate>],
    ) -> Result<Candidates> {
        self.propagate_with(cycle, view, estimates, &|| false)
    }

    /// [`Stepper::propagate`] that can be cancelled.
    pub(super) fn propagate_with(
        &self,
        cycle: usize,
        view: usize,
        estimates: &[Option<&ViewEstimate>],
        cancelled: Cancelled,
    ) -> Result<Candidates> {
        self.check_states(cycle, view, estimates)?;
        let target = estimates.get(view).copied().flatten();
        let (Some(target), true, true) =
            (target, self.options.search.view_propagation, self.all()[cycle].cycle > 0)
        else {
            return Ok(Candidates {
                cycle,
                view,
                pixels: self.scaled(cycle, view).camera.pixels(),
                planes: Vec::new(),
            });
        };
        let mut donors = Vec::new();
        for (donor, estimate) in estimates.iter().enumerate() {
            let Some(estimate) = estimate else { continue };
            estimate.require_marked(&format!("estimates[{donor}]"), true)?;
            if self.sources(donor).contains(&(view as u32)) {
                let camera = &self.scaled(cycle, donor).camera;
                donors.push(Donor { view: donor, camera, map: &estimate.solved });
            }
        }
        let ScaledView { camera, range, .. } = self.scaled(cycle, view);
        let candidates = propagation::candidates(camera, &target.solved, *range, &donors, cancelled)?;
        let planes = (0u32..).zip(candidates).filter(|(_, offer)| offer.depth > 0.0).collect();
        Ok(Candidates { cycle, view, pixels: camera.pixels(), planes })
    }

    /// Searches a view in a cycle, starting from its own estimate, helped by what is validated in its sources and by
    /// what is offered. Without a estimate of its own it starts at random.
    ///
    /// # Errors
    /// What [`Stepper::propagate`] refuses; candidates to another view or for another cycle; [`Error::Cancelled`] when the hook
    /// breaks.
    pub fn search(
        &self,
        cycle: usize,
        view: usize,
        estimates: &[Option<&ViewEstimate>],
        candidates: Option<&Candidates>,
        hook: Hook,
    ) -> Result<ViewEstimate> {
        self.check_place(cycle, view)?;
        let at = self.all()[cycle].progress(Phase::Search, view, self.views());
        let tracker =
            Tracker::new(hook, self.all()[cycle].work_on(self.scaled(cycle, view).camera.pixels() as u64));
        self.check_states(cycle, view, estimates)?;
        for (place, estimate) in estimates.iter().enumerate() {
            estimate
                .map_or(Ok(()), |estimate| estimate.require_marked(&format!("estimates[{place}]"), true))?;
        }
        if let Some(candidates) = candidates
            && (candidates.cycle, candidates.view, candidates.pixels)
                != (cycle, view, self.scaled(cycle, view).camera.pixels())
        {
            let value = format!("candidates to view {} for cycle {}", candidates.view, candidates.cycle);
            let expected = format!("those to view {view} for cycle {cycle}, of the same stepper");
            return Err(Error::argument("candidates", value, expected));
        }
        let own = estimates.get(view).copied().flatten();
        let shown = Shown {
            surfaces: &|view| surface_of(estimates, view),
            is_guided: estimates.iter().any(Option::is_some),
        };
        self.search_from((cycle, view), own, shown, candidates, &|units| tracker.advance(units, at))
    }

    /// [`Stepper::search`] from a view's own estimate and what the other views show of theirs; hands finished units of work to
    /// `advance`, which answers `true` to cancel.
    pub(super) fn search_from<'b>(
        &'b self,
        (cycle, view): (usize, usize),
        own: Option<&ViewEstimate>,
        shown: Shown<'b>,
        candidates: Option<&Candidates>,
        advance: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<ViewEstimate> {
        let schedule = self.all()[cycle];
        let ScaledView { camera, image, mask, range, .. } = self.scaled(cycle, view);
        let mut estimate = ViewEstimate {
            view,
            cycle,
            marked: false,
            solved: PlaneMap::default(),
            counts: own.map(ViewEstimate::counts).unwrap_or_default(),
            cycles: own.map(|own| own.cycles.clone()).unwrap_or_default(),
        };
        if self.sources(view).is_empty() {
            let solutions = vec![PixelEstimate::default(); camera.pixels()];
            let sets = ViewSets::empty(solutions.len(), 0);
            estimate.solved = PlaneMap { solutions, sets, ..PlaneMap::default() };
        } else {
            let start = own.map(|own| &own.solved.solutions[..]);
            let candidates = candidates.and_then(Candidates::by_pixel);
            let problem = self.problem(cycle, view, shown.surfaces);
            // A band of one color has half of its pixels.
            let band = camera.width as usize * band_rows(camera.height as usize);
            let cancelled = || advance(band as u64 * u64::from(schedule.scale.food_sources) / 2);
            let cycle_number = u64::from(schedule.cycle);
            let search = Search {
                mask: mask.as_deref(),
                start,
                candidates: candidates.as_deref(),
                foods: schedule.scale.food_sources as usize,
                iterations: schedule.iterations(),
                around_start: self.around_start(schedule.cycle),
                stream: stream(&[self.options.seed, view as u64, schedule.scale_index as u64, cycle_number]),
                ..self.plain_search(cycle, &problem, shown.is_guided, &cancelled)
            };
            let mut found = search.run()?;
            let solution = |food: &FoodSource| PixelEstimate {
                depth: food.depth,
                normal: food.normal,
                cost: food.cost.into(),
                consistent: 0,
                validated: food.validated,
            };
            let mut solutions: Vec<PixelEstimate> = found.best.par_iter().map(solution).collect();
            let filter = FillTextureless { problem: &problem, is_textureless: &found.weak };
            let filled = filter.apply(&FilteredView { camera, image, range: *range }, &mut solutions);
            let plane = |&pixel: &u32| {
                let PixelEstimate { depth, normal, .. } = solutions[pixel as usize];
                (pixel as usize, depth, normal)
            };
            let filled: Vec<_> = filled.iter().map(plane).collect();
            select_sets(&problem, search.view_rules, &mut found.sets, &filled);
            estimate.counts += found.counts;
            // Nothing of this cycle is checked yet.
            solutions.par_iter_mut().for_each(|solution| solution.validated = false);
            estimate.solved = PlaneMap { solutions, sets: found.sets, surface: Vec::new() };
        }
        let solutions = &estimate.solved.solutions;
        estimate.cycles.push(CycleRecord {
            downscale: schedule.downscale(),
            cycle: schedule.cycle,
            pixels: solutions.par_iter().filter(|solution| solution.depth > 0.0).count() as u64,
            changed: count_changed(own.map_or(&[], |own| &own.solved.solutions), solutions),
            validated: 0,
        });
        Ok(estimate)
    }

    /// The geometric consistency check of a view against what its sources have just found. A source whose estimate is
    /// `None` cannot speak.
    ///
    /// # Errors
    /// A cycle or view there is not; estimates of another scale, scene or view than they stand for, or already marked; no
    /// estimate of the view itself.
    pub fn check(&self, cycle: usize, view: usize, estimates: &[Option<&ViewEstimate>]) -> Result<Verdicts> {
        self.check_with(cycle, view, estimates, &|| false)
    }

    /// [`Stepper::check`] that can be cancelled.
    pub(super) fn check_with(
        &self,
        cycle: usize,
        view: usize,
        estimates: &[Option<&ViewEstimate>],
        cancelled: Cancelled,
    ) -> Result<Verdicts> {
        self.check_states(cycle, view, estimates)?;
        let Some(own) = estimates.get(view).copied().flatten() else {
            return Err(missing(view));
        };
        own.require_marked(&format!("estimates[{view}]"), false)?;
        let problem = self.problem(cycle, view, &|view| surface_of(estimates, view));
        let sources = self.found_by_sources(view, estimates);
        let rules = ConsistencyRules::new(&self.options);
        Ok(Verdicts(consistency::check(self.level, &problem, &own.solved, &sources, &rules, cancelled)?))
    }

    /// What each source view of a view found, `None` of one without a estimate.
    pub(super) fn found_by_sources<'b>(
        &self,
        view: usize,
        estimates: &[Option<&'b ViewEstimate>],
    ) -> Vec<Option<&'b PlaneMap>> {
        let found = |&source: &u32| {
            estimates.get(source as usize).copied().flatten().map(|estimate| &estimate.solved)
        };
        self.sources(view).iter().map(found).collect()
    }

    /// Writes the verdicts of a check into the estimate they were made for: what is validated guides the next search.
    ///
    /// # Errors
    /// Another view than the estimate's; a estimate that is marked already or has another size.
    pub fn mark(&self, view: usize, estimate: &mut ViewEstimate, verdicts: &Verdicts) -> Result<()> {
        estimate.require_marked("estimate", false)?;
        if estimate.view() != view || verdicts.0.len() != estimate.pixels() {
            let value = format!("{} pixels of view {view}", verdicts.0.len());
            let expected =
                format!("the {} pixels of view {}, whose estimate it is", estimate.pixels(), estimate.view());
            return Err(Error::argument("verdicts", value, expected));
        }
        let ScaledView { camera, image, range, .. } = self.scaled(estimate.cycle(), view);
        estimate.solved.judge(&verdicts.0);
        let filtered = FilteredView { camera, image, range: *range };
        if self.may_end_scale(estimate) {
            let is_last_cycle = estimate.cycle() + 1 == self.all().len();
            let passes = self.options.refine.fattening_passes;
            CorrectFattening { passes, is_last_cycle }.apply(&filtered, &mut estimate.solved.solutions);
        }
        let passes = self.options.refine.smoothing_passes;
        SmoothPlanes { passes }.apply(&filtered, &mut estimate.solved.solutions);
        estimate.solved.show(camera);
        estimate.marked = true;
        let validated = estimate.solved.validated();
        if let Some(record) = estimate.cycles.last_mut() {
            record.validated = validated;
        }
        Ok(())
    }

    /// Whether a scale ends with the cycle of a estimate, for all that the estimate knows.
    fn may_end_scale(&self, estimate: &ViewEstimate) -> bool {
        let scale = |cycle: usize| self.all().get(cycle).map(|cycle| cycle.scale_index);
        let is_settled = |record: &CycleRecord| {
            (record.changed as f64) < self.options.schedule.min_changed_fraction * record.pixels as f64
        };
        scale(estimate.cycle() + 1) != scale(estimate.cycle())
            || estimate.cycles.last().is_some_and(is_settled)
    }

    /// A search with everything that all searches have in common; one that is guided has validated solutions to look at.
    pub(super) fn plain_search<'b>(
        &'b self,
        cycle: usize,
        problem: &'b Problem<'b>,
        is_guided: bool,
        cancelled: &'b (dyn Fn() -> bool + Sync),
    ) -> Search<'b> {
        // The paper starts no set again: its cost is infinite then.
        let min_views = match self.options.cost.best_views {
            0 => 0,
            _ => self.options.min_matched_views(),
        };
        Search {
            problem,
            window: self.window(cycle),
            cost_rules: CostRules::new(&self.options, is_guided),
            view_rules: ViewRules::new(&self.options, min_views),
            mask: None,
            start: None,
            candidates: None,
            foods: 0,
            iterations: 0,
            trial_limit: self.options.search.trial_limit.min(u32::from(u16::MAX)) as u16,
            employed_foods: self.employed_foods(is_guided),
            onlookers: OnlookerRules {
                reward: self.options.search.smoothness_reward as f32,
                draws: self.options.search.onlooker_tournament_size,
            },
            plane_fit: self.options.search.local_plane_tolerance as f32,
            focused_views: self.options.cost.max_views_per_pixel as usize,
            around_start: (0.0, 0.0),
            stream: 0,
            level: self.level,
            cancelled,
        }
    }

    fn employed_foods(&self, is_guided: bool) -> usize {
        match self.options.search.employed_bees {
            count if is_guided && count > 0 => count as usize,
            _ => usize::MAX,
        }
    }

    fn around_start(&self, cycle: u32) -> (f32, f32) {
        let shrink = 0.5f64.powi(cycle.min(64) as i32);
        (
            (self.options.search.depth_perturbation * shrink) as f32,
            (self.options.search.normal_perturbation * shrink) as f32,
        )
    }

    /// A view and its sources, which show their validated surfaces as far as there are any.
    pub(super) fn problem<'b>(
        &'b self,
        cycle: usize,
        view: usize,
        surfaces: &dyn Fn(usize) -> &'b [CompactPlane],
    ) -> Problem<'b> {
        let ScaledView { camera, image, range, .. } = self.scaled(cycle, view);
        let mut problem = Problem::new(camera, image, *range);
        for &source in self.sources(view) {
            let source = source as usize;
            let ScaledView { camera: other, image, .. } = self.scaled(cycle, source);
            problem.sources.push(Source::new(camera, other, image, surfaces(source)));
        }
        problem
    }
}

/// What the views show of their estimates to a search.
#[derive(Clone, Copy)]
pub(super) struct Shown<'b> {
    /// The validated surface of a view, empty where nothing is known.
    pub surfaces: &'b (dyn Fn(usize) -> &'b [CompactPlane] + Sync),
    /// Whether anything is known of any view.
    pub is_guided: bool,
}

/// What a view's estimate shows of it.
pub(super) fn surface_of<'b>(estimates: &[Option<&'b ViewEstimate>], view: usize) -> &'b [CompactPlane] {
    estimates.get(view).copied().flatten().map_or(&[], |estimate| &estimate.solved.surface)
}

/// The error of a cycle that needs the view's own estimate.
pub(super) fn missing(view: usize) -> Error {
    Error::argument(format!("estimates[{view}]"), "none", "the estimate of the view itself")
}

/// A solution changed when its depth moved by more than this share.
const CHANGE: f32 = 1e-3;

fn count_changed(before: &[PixelEstimate], after: &[PixelEstimate]) -> u64 {
    let changed = |(pixel, solution): &(usize, &PixelEstimate)| {
        let before = before.get(*pixel).map_or(0.0, |solution| solution.depth);
        solution.depth > 0.0 && (solution.depth - before).abs() > CHANGE * solution.depth
    };
    after.par_iter().enumerate().filter(changed).count() as u64
}
