//! The steps of one view: propagation, search, check.

use super::prepare::Steps;
use super::state::State;
use crate::ambc::{CostRules, FoodSource, Offer, OnlookerRules, Search, band_rows, stream};
use crate::consistency::{self, ConsistencyRules};
use crate::edges::trim;
use crate::error::{Error, Result};
use crate::filling::fill;
use crate::image::ScaledView;
use crate::maps::CycleRecord;
use crate::options::Aggregation;
use crate::progress::{Cancelled, Hook, Phase, Tracker};
use crate::propagation::{self, Giver};
use crate::smoothing::smooth;
use crate::state::{Solution, ViewState};
use crate::views::{Reference, ShownPlane, Source, ViewRules, ViewSets, select_sets};
use rayon::prelude::*;

/// The planes other views offer to the pixels of a view; nothing on a scale's first cycle or with propagation off.
#[derive(Debug, Clone)]
pub struct Offers {
    step: usize,
    view: usize,
    /// Pixels of the view.
    pixels: usize,
    /// The pixels with an offer, a small part of all.
    planes: Vec<(u32, Offer)>,
}

impl Offers {
    /// One offer a pixel; `None` where there are none at all.
    fn by_pixel(&self) -> Option<Vec<Offer>> {
        let mut all = vec![Offer::default(); if self.planes.is_empty() { 0 } else { self.pixels }];
        self.planes.iter().for_each(|&(pixel, offer)| all[pixel as usize] = offer);
        (!all.is_empty()).then_some(all)
    }
}

/// What a check says of every pixel of a view.
#[derive(Debug, Clone)]
pub struct Verdicts(Vec<(u8, bool)>);

impl Steps {
    /// The planes other views offer to a view in a step.
    ///
    /// # Errors
    /// A step or view there is not; states of another scale, scene or view than they stand for, or not yet marked.
    pub fn propagate(&self, step: usize, view: usize, states: &[Option<&State>]) -> Result<Offers> {
        self.propagate_with(step, view, states, &|| false)
    }

    /// [`Steps::propagate`] that can be cancelled.
    pub(super) fn propagate_with(
        &self,
        step: usize,
        view: usize,
        states: &[Option<&State>],
        cancelled: Cancelled,
    ) -> Result<Offers> {
        self.check_states(step, view, states)?;
        let target = states.get(view).copied().flatten();
        let (Some(target), true, true) = (target, self.options.propagation, self.all()[step].cycle > 0)
        else {
            return Ok(Offers {
                step,
                view,
                pixels: self.scaled(step, view).camera.pixels(),
                planes: Vec::new(),
            });
        };
        let mut givers = Vec::new();
        for (giver, state) in states.iter().enumerate() {
            let Some(state) = state else { continue };
            state.require_marked(&format!("states[{giver}]"), true)?;
            if self.sources(giver).contains(&(view as u32)) {
                let camera = &self.scaled(step, giver).camera;
                givers.push(Giver { view: giver, camera, state: &state.solved });
            }
        }
        let ScaledView { camera, range, .. } = self.scaled(step, view);
        let offers = propagation::offers(camera, &target.solved, *range, &givers, cancelled)?;
        let planes = (0u32..).zip(offers).filter(|(_, offer)| offer.depth > 0.0).collect();
        Ok(Offers { step, view, pixels: camera.pixels(), planes })
    }

    /// Searches a view in a step, starting from its own state, helped by what is validated in its sources and by
    /// what is offered. Without a state of its own it starts at random.
    ///
    /// # Errors
    /// What [`Steps::propagate`] refuses; offers to another view or for another step; [`Error::Cancelled`] when the hook
    /// breaks.
    pub fn search(
        &self,
        step: usize,
        view: usize,
        states: &[Option<&State>],
        offers: Option<&Offers>,
        hook: Hook,
    ) -> Result<State> {
        self.check_place(step, view)?;
        let at = self.all()[step].progress(Phase::Search, view, self.views());
        let tracker =
            Tracker::new(hook, self.all()[step].work_on(self.scaled(step, view).camera.pixels() as u64));
        self.check_states(step, view, states)?;
        for (place, state) in states.iter().enumerate() {
            state.map_or(Ok(()), |state| state.require_marked(&format!("states[{place}]"), true))?;
        }
        if let Some(offers) = offers
            && (offers.step, offers.view, offers.pixels)
                != (step, view, self.scaled(step, view).camera.pixels())
        {
            let value = format!("offers to view {} for step {}", offers.view, offers.step);
            let expected = format!("those to view {view} for step {step}, of the same steps");
            return Err(Error::argument("offers", value, expected));
        }
        let own = states.get(view).copied().flatten();
        let shown = Shown {
            surfaces: &|view| surface_of(states, view),
            is_guided: states.iter().any(Option::is_some),
        };
        self.search_from((step, view), own, shown, offers, &|units| tracker.advance(units, at))
    }

    /// [`Steps::search`] from a view's own state and what the other views show of theirs; hands finished units of work to
    /// `advance`, which answers `true` to cancel.
    pub(super) fn search_from<'b>(
        &'b self,
        (step, view): (usize, usize),
        own: Option<&State>,
        shown: Shown<'b>,
        offers: Option<&Offers>,
        advance: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<State> {
        let schedule = self.all()[step];
        let ScaledView { camera, mask, .. } = self.scaled(step, view);
        let mut state = State {
            view,
            step,
            marked: false,
            solved: ViewState::default(),
            counts: own.map(State::counts).unwrap_or_default(),
            cycles: own.map(|own| own.cycles.clone()).unwrap_or_default(),
        };
        if self.sources(view).is_empty() {
            let solutions = vec![Solution::default(); camera.pixels()];
            let sets = ViewSets::empty(solutions.len(), 0);
            state.solved = ViewState { solutions, sets, ..ViewState::default() };
        } else {
            let start = own.map(|own| &own.solved.solutions[..]);
            let offers = offers.and_then(Offers::by_pixel);
            let reference = self.reference(step, view, shown.surfaces);
            // A band of one colour has half of its pixels.
            let band = camera.width as usize * band_rows(camera.height as usize);
            let cancelled = || advance(band as u64 * u64::from(schedule.scale.foods) / 2);
            let cycle = u64::from(schedule.cycle);
            let search = Search {
                mask: mask.as_deref(),
                start,
                offers: offers.as_deref(),
                foods: schedule.scale.foods as usize,
                iterations: schedule.iterations(),
                around_start: self.around_start(schedule.cycle),
                stream: stream(&[self.options.seed, view as u64, schedule.scale_index as u64, cycle]),
                ..self.plain_search(step, &reference, shown.is_guided, &cancelled)
            };
            let mut found = search.run()?;
            let filled = fill(&reference, &mut found.best, &found.weak);
            let plane = |&pixel: &usize| {
                let FoodSource { depth, normal, .. } = found.best[pixel];
                (pixel, depth, normal)
            };
            let filled: Vec<_> = filled.iter().map(plane).collect();
            select_sets(&reference, search.view_rules, &mut found.sets, &filled);
            state.counts += found.counts;
            let solution = |food: &FoodSource| Solution {
                depth: food.depth,
                normal: food.normal,
                cost: food.cost.into(),
                ..Solution::default()
            };
            state.solved = ViewState {
                solutions: found.best.par_iter().map(solution).collect(),
                sets: found.sets,
                surface: Vec::new(),
            };
        }
        let solutions = &state.solved.solutions;
        state.cycles.push(CycleRecord {
            reduction: schedule.reduction(),
            cycle: schedule.cycle,
            pixels: solutions.par_iter().filter(|solution| solution.depth > 0.0).count() as u64,
            changed: count_changed(own.map_or(&[], |own| &own.solved.solutions), solutions),
            validated: 0,
        });
        Ok(state)
    }

    /// The geometric consistency check of a view against what its sources have just found. A source whose state is
    /// `None` cannot speak.
    ///
    /// # Errors
    /// A step or view there is not; states of another scale, scene or view than they stand for, or already marked; no
    /// state of the view itself.
    pub fn check(&self, step: usize, view: usize, states: &[Option<&State>]) -> Result<Verdicts> {
        self.check_with(step, view, states, &|| false)
    }

    /// [`Steps::check`] that can be cancelled.
    pub(super) fn check_with(
        &self,
        step: usize,
        view: usize,
        states: &[Option<&State>],
        cancelled: Cancelled,
    ) -> Result<Verdicts> {
        self.check_states(step, view, states)?;
        let Some(own) = states.get(view).copied().flatten() else {
            return Err(missing(view));
        };
        own.require_marked(&format!("states[{view}]"), false)?;
        let reference = self.reference(step, view, &|view| surface_of(states, view));
        let sources = self.found_by_sources(view, states);
        let rules = ConsistencyRules::new(&self.options);
        Ok(Verdicts(consistency::check(self.level, &reference, &own.solved, &sources, &rules, cancelled)?))
    }

    /// What each source view of a view found, `None` of one without a state.
    pub(super) fn found_by_sources<'b>(
        &self,
        view: usize,
        states: &[Option<&'b State>],
    ) -> Vec<Option<&'b ViewState>> {
        let found = |&source: &u32| states.get(source as usize).copied().flatten().map(|state| &state.solved);
        self.sources(view).iter().map(found).collect()
    }

    /// Writes the verdicts of a check into the state they were made for: what is validated guides the next search.
    ///
    /// # Errors
    /// Another view than the state's; a state that is marked already or has another size.
    pub fn mark(&self, view: usize, state: &mut State, verdicts: &Verdicts) -> Result<()> {
        state.require_marked("state", false)?;
        if state.view() != view || verdicts.0.len() != state.pixels() {
            let value = format!("{} pixels of view {view}", verdicts.0.len());
            let expected =
                format!("the {} pixels of view {}, whose state it is", state.pixels(), state.view());
            return Err(Error::argument("verdicts", value, expected));
        }
        let ScaledView { camera, image, range, .. } = self.scaled(state.step(), view);
        state.solved.judge(&verdicts.0);
        if self.may_end_scale(state) {
            let is_last = state.step() + 1 == self.all().len();
            trim(camera, image, *range, &mut state.solved.solutions, self.options.edge_passes, is_last);
        }
        for _ in 0..self.options.smoothing_passes {
            smooth(camera, image, *range, &mut state.solved.solutions);
        }
        state.solved.show(camera);
        state.marked = true;
        let validated = state.solved.validated();
        if let Some(record) = state.cycles.last_mut() {
            record.validated = validated;
        }
        Ok(())
    }

    /// Whether a scale ends with the step of a state, for all that the state knows.
    fn may_end_scale(&self, state: &State) -> bool {
        let scale = |step: usize| self.all().get(step).map(|step| step.scale_index);
        let is_settled =
            |record: &CycleRecord| (record.changed as f64) < self.options.stop_share * record.pixels as f64;
        scale(state.step() + 1) != scale(state.step()) || state.cycles.last().is_some_and(is_settled)
    }

    /// A search with everything that all searches have in common; one that is guided has validated solutions to look at.
    pub(super) fn plain_search<'b>(
        &'b self,
        step: usize,
        reference: &'b Reference<'b>,
        is_guided: bool,
        cancelled: &'b (dyn Fn() -> bool + Sync),
    ) -> Search<'b> {
        // The paper starts no set again: its cost is infinite then.
        let min_views = match self.options.aggregation {
            Aggregation::AllViews => 0,
            Aggregation::BestViews(_) => self.options.min_matched(),
        };
        Search {
            reference,
            window: self.window(step),
            cost_rules: CostRules::new(&self.options, is_guided),
            view_rules: ViewRules::new(&self.options, min_views),
            mask: None,
            start: None,
            offers: None,
            foods: 0,
            iterations: 0,
            trial_limit: self.options.trial_limit.min(u32::from(u16::MAX)) as u16,
            employed_foods: self.employed_foods(is_guided),
            onlookers: OnlookerRules {
                reward: self.options.reward as f32,
                draws: self.options.neighbours_drawn,
            },
            plane_fit: self.options.plane_fit as f32,
            focused_views: self.options.focused_views as usize,
            around_start: (0.0, 0.0),
            stream: 0,
            level: self.level,
            cancelled,
        }
    }

    fn employed_foods(&self, is_guided: bool) -> usize {
        match self.options.employed_foods {
            count if is_guided && count > 0 => count as usize,
            _ => usize::MAX,
        }
    }

    fn around_start(&self, cycle: u32) -> (f32, f32) {
        let shrink = 0.5f64.powi(cycle.min(64) as i32);
        ((self.options.restart_spread * shrink) as f32, (self.options.restart_tilt * shrink) as f32)
    }

    /// A view and its sources, which show their validated surfaces as far as there are any.
    pub(super) fn reference<'b>(
        &'b self,
        step: usize,
        view: usize,
        surfaces: &dyn Fn(usize) -> &'b [ShownPlane],
    ) -> Reference<'b> {
        let ScaledView { camera, image, range, .. } = self.scaled(step, view);
        let mut reference = Reference::new(camera, image, *range);
        for &source in self.sources(view) {
            let source = source as usize;
            let ScaledView { camera: other, image, .. } = self.scaled(step, source);
            reference.sources.push(Source::new(camera, other, image, surfaces(source)));
        }
        reference
    }
}

/// What the views show of their states to a search.
#[derive(Clone, Copy)]
pub(super) struct Shown<'b> {
    /// The validated surface of a view, empty where nothing is known.
    pub surfaces: &'b (dyn Fn(usize) -> &'b [ShownPlane] + Sync),
    /// Whether anything is known of any view.
    pub is_guided: bool,
}

/// What a view's state shows of it.
pub(super) fn surface_of<'b>(states: &[Option<&'b State>], view: usize) -> &'b [ShownPlane] {
    states.get(view).copied().flatten().map_or(&[], |state| &state.solved.surface)
}

/// The error of a step that needs the view's own state.
pub(super) fn missing(view: usize) -> Error {
    Error::argument(format!("states[{view}]"), "none", "the state of the view itself")
}

/// A solution changed when its depth moved by more than this share.
const CHANGE: f32 = 1e-3;

fn count_changed(before: &[Solution], after: &[Solution]) -> u64 {
    let changed = |(pixel, solution): &(usize, &Solution)| {
        let before = before.get(*pixel).map_or(0.0, |solution| solution.depth);
        solution.depth > 0.0 && (solution.depth - before).abs() > CHANGE * solution.depth
    };
    after.par_iter().enumerate().filter(changed).count() as u64
}
