//! What a run hands out for a view: its solutions averaged with those of other views and with small gaps
//! closed, and what became of every pixel.

use super::prepare::Steps;
use super::search::missing;
use super::state::{State, maps_of};
use crate::ambc::{Search, assess};
use crate::averaging::average;
use crate::closing;
use crate::consistency::{self, ConsistencyRules};
use crate::error::Result;
use crate::image::ScaledView;
use crate::maps::ViewResult;
use crate::outcome::outcomes;
use crate::progress::{Hook, Phase, Tracker};
use crate::state::{Solution, ViewState};
use crate::views::{ViewRules, ViewSets, select_sets};

impl Steps {
    /// Averages planes between views, closes small gaps and settles view set, cost and outcome of every pixel of a view after the last step.
    ///
    /// # Errors
    /// A view there is not; states that are not of full size, of another scene or view than they stand for, or not
    /// marked; no state of the view itself; [`crate::Error::Cancelled`] when the hook breaks.
    pub fn finish(&self, view: usize, states: &[Option<&State>], hook: Hook) -> Result<ViewResult> {
        let step = self.all().len() - 1;
        self.check_place(step, view)?;
        let at = self.all()[step].progress(Phase::Check, view, self.views());
        let tracker = Tracker::new(hook, u64::from(self.scaled(step, view).camera.height));
        self.finish_with(view, states, &|units| tracker.advance(units, at))
    }

    /// [`Steps::finish`] that asks `advance` whether to go on.
    pub(super) fn finish_with(
        &self,
        view: usize,
        states: &[Option<&State>],
        advance: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<ViewResult> {
        let step = self.all().len() - 1;
        self.check_states(step, view, states)?;
        for (place, state) in states.iter().enumerate() {
            state.map_or(Ok(()), |state| state.require_marked(&format!("states[{place}]"), true))?;
        }
        let Some(own) = states.get(view).copied().flatten() else {
            return Err(missing(view));
        };
        let reference = self.reference(step, view, states);
        let cancelled = || advance(0);
        let mut search = self.plain_search(step, &reference, true, &cancelled);
        // A set that falls back to the start set would hide that nothing sees the solution.
        search.view_rules = ViewRules::new(&self.options, 0);
        let mut solutions = own.solved.solutions.clone();
        if self.options.average_views {
            average(&reference, &mut solutions);
        }
        if self.options.close_gaps {
            self.close_gaps(view, states, (&search, &mut solutions))?;
        }
        let assessment = assess(&search, &solutions)?;
        let mut counts = own.counts();
        counts += assessment.counts;
        let sources = self.sources(view).to_vec();
        Ok(ViewResult {
            width: self.scaled(step, view).camera.width,
            estimate: maps_of(&solutions),
            outcome: outcomes(
                self.scaled(step, view),
                &solutions,
                &assessment,
                sources.len(),
                self.options.min_matched(),
            ),
            cost: assessment.cost,
            sources,
            view_sets: assessment.sets,
            counts,
            cycles: own.cycles().to_vec(),
        })
    }

    /// Gives pixels without a validated solution what the surfaces around them go on to, where the sources agree.
    fn close_gaps(
        &self,
        view: usize,
        states: &[Option<&State>],
        (search, solutions): (&Search, &mut [Solution]),
    ) -> Result<()> {
        let reference = search.reference;
        let ScaledView { camera, image, range, .. } = self.scaled(self.all().len() - 1, view);
        let offers = closing::offers(camera, image, *range, solutions);
        let mut sets = ViewSets::empty(offers.len(), reference.sources.len());
        let made = offers.iter().enumerate().filter(|(_, offer)| offer.depth > 0.0);
        let made = made.map(|(pixel, offer)| (pixel, offer.depth, offer.normal));
        select_sets(reference, search.view_rules, &mut sets, &made.collect::<Vec<_>>());
        let offered = ViewState { solutions: offers, sets, ..ViewState::default() };
        let sources = self.found_by_sources(view, states);
        // What is offered has no cost of its own that speaks for it: the sources must agree more closely.
        let rules = ConsistencyRules::new(&self.options).closer();
        let verdicts = consistency::check(reference, &offered, &sources, &rules, search.cancelled)?;
        for (pixel, (consistent, validated)) in verdicts.into_iter().enumerate() {
            if validated {
                solutions[pixel] = Solution { consistent, validated, ..offered.solutions[pixel] };
            }
        }
        Ok(())
    }
}
