//! The search of one view within a cycle.

use super::Run;
use super::schedule::Step;
use crate::ambc::{BAND_ROWS, CostRules, FoodSource, Offer, Search, stream};
use crate::error::Result;
use crate::image::ScaledView;
use crate::options::Aggregation;
use crate::progress::{Phase, Tracker};
use crate::propagation::{self, Giver};
use crate::state::{Solution, ViewState};
use crate::views::{Reference, Source, ViewRules};

impl Run<'_> {
    /// Searches one view; `states` are those of all views after the last check.
    pub(super) fn search(
        &mut self,
        step: Step,
        view: usize,
        views: &[ScaledView],
        states: &[ViewState],
        tracker: &Tracker,
    ) -> Result<ViewState> {
        let camera = &views[view].camera;
        if self.sources.lists[view].is_empty() {
            let none = vec![Solution::default(); camera.pixels()];
            return Ok(ViewState { cost: vec![0.0; none.len()], solutions: none, ..ViewState::default() });
        }
        let start = (!states[view].solutions.is_empty()).then_some(&states[view].solutions[..]);
        let offers = (self.options.propagation && step.cycle > 0).then(|| self.offers(view, views, states));
        let reference = self.reference(view, views, states);
        let progress = step.progress(Phase::Search, view, views.len());
        let band_work = u64::from(camera.width) * BAND_ROWS as u64 * u64::from(step.scale.foods);
        // A band of one colour has half of its pixels.
        let cancelled = || tracker.advance(band_work / 2, progress);
        let search = Search {
            mask: views[view].mask.as_deref(),
            start,
            offers: offers.as_deref(),
            foods: step.scale.foods as usize,
            iterations: step.iterations(),
            around_start: self.around_start(step),
            stream: stream(&[self.options.seed, view as u64, step.scale_index as u64, u64::from(step.cycle)]),
            ..self.plain_search(&reference, start.is_some(), &cancelled)
        };
        let found = search.run()?;
        self.counts[view] += found.counts;
        let solution =
            |food: &FoodSource| Solution { depth: food.depth, normal: food.normal, ..Solution::default() };
        Ok(ViewState {
            solutions: found.best.iter().map(solution).collect(),
            cost: found.best.iter().map(|food| food.cost).collect(),
            sets: found.sets,
            surface: Vec::new(),
        })
    }

    /// A search with everything that all searches have in common.
    pub(super) fn plain_search<'b>(
        &'b self,
        reference: &'b Reference<'b>,
        has_start: bool,
        cancelled: &'b (dyn Fn() -> bool + Sync),
    ) -> Search<'b> {
        // The paper's cost is infinite for a single view; the mean of the best needs two to be worth anything.
        let min_views = if self.options.aggregation == Aggregation::AllViews { 0 } else { 2 };
        Search {
            reference,
            window: &self.window,
            cost_rules: CostRules::new(self.options, has_start),
            view_rules: ViewRules::new(self.options, min_views),
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
        let shrink = 0.5f64.powi(step.cycle.min(64) as i32);
        ((self.options.restart_spread * shrink) as f32, (self.options.restart_tilt * shrink) as f32)
    }

    /// The planes other views offer to a view.
    fn offers(&self, view: usize, views: &[ScaledView], states: &[ViewState]) -> Vec<Offer> {
        let givers: Vec<Giver> = (0..views.len())
            .filter(|&giver| self.sources.lists[giver].contains(&(view as u32)))
            .map(|giver| Giver { view: giver, camera: &views[giver].camera, state: &states[giver] })
            .collect();
        propagation::offers(&views[view].camera, &states[view], views[view].range, &givers)
    }

    /// A view and its sources, which show their validated surfaces as far as there are any.
    pub(super) fn reference<'b>(
        &self,
        view: usize,
        views: &'b [ScaledView],
        states: &'b [ViewState],
    ) -> Reference<'b> {
        let ScaledView { camera, image, range, .. } = &views[view];
        let mut reference = Reference::new(camera, image, *range);
        for &source in &self.sources.lists[view] {
            let source = source as usize;
            let ScaledView { camera: other, image, .. } = &views[source];
            reference.sources.push(Source::new(camera, other, image, &states[source].surface));
        }
        reference
    }
}
