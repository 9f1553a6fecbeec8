//! What a run hands out for a view: its solutions averaged with those of other views and with small gaps
//! closed, and what became of every pixel.

use super::prepare::Steps;
use super::search::{missing, surface_of};
use super::state::{State, maps_of};
use crate::ambc::assess;
use crate::averaging::average;
use crate::closing;
use crate::consistency::{self, ConsistencyRules};
use crate::error::Result;
use crate::image::ScaledView;
use crate::maps::ViewResult;
use crate::outcome::outcomes;
use crate::progress::{Hook, Phase, Tracker};
use crate::state::{Solution, ViewState};
use crate::views::{Reference, ShownPlane, ViewRules, ViewSets, select_sets};

impl Steps {
    /// Averages planes between views, closes small gaps and settles view set, cost and outcome of every pixel of a view
    /// after the last step.
    ///
    /// # Errors
    /// A view there is not; states that are not of full size, of another scene or view than they stand for, or not
    /// marked; no state of the view itself; [`crate::Error::Cancelled`] when the hook breaks.
    pub fn finish(&self, view: usize, states: &[Option<&State>], hook: Hook) -> Result<ViewResult> {
        let step = self.all().len() - 1;
        self.check_place(step, view)?;
        let at = self.all()[step].progress(Phase::Check, view, self.views());
        let tracker = Tracker::new(hook, u64::from(self.scaled(step, view).camera.height));
        self.check_states(step, view, states)?;
        for (place, state) in states.iter().enumerate() {
            state.map_or(Ok(()), |state| state.require_marked(&format!("states[{place}]"), true))?;
        }
        let Some(own) = states.get(view).copied().flatten() else {
            return Err(missing(view));
        };
        let advance = |units| tracker.advance(units, at);
        let closings = self.closings(view, states, &advance)?;
        self.settle(own, &|view| surface_of(states, view), &closings, &advance)
    }

    /// The validated planes of a view, averaged with those that its sources show.
    fn averaged(&self, own: &State, reference: &Reference) -> Vec<Solution> {
        let mut solutions = own.solved.solutions.clone();
        if self.options.average_views {
            average(self.level, reference, &mut solutions);
        }
        solutions
    }

    /// The pixels of small gaps with what the surfaces around them go on to, where the sources agree.
    pub(super) fn closings(
        &self,
        view: usize,
        states: &[Option<&State>],
        advance: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<Vec<(u32, Solution)>> {
        let (step, Some(own)) = (self.all().len() - 1, states[view]) else { return Ok(Vec::new()) };
        if !self.options.close_gaps {
            return Ok(Vec::new());
        }
        let reference = self.reference(step, view, &|view| surface_of(states, view));
        let ScaledView { camera, image, range, .. } = self.scaled(step, view);
        let offers = closing::offers(camera, image, *range, &self.averaged(own, &reference));
        let mut sets = ViewSets::empty(offers.len(), reference.sources.len());
        let made = offers.iter().enumerate().filter(|(_, offer)| offer.depth > 0.0);
        let made: Vec<_> = made.map(|(pixel, offer)| (pixel, offer.depth, offer.normal)).collect();
        select_sets(&reference, ViewRules::new(&self.options, 0), &mut sets, &made);
        let offered = ViewState { solutions: offers, sets, ..ViewState::default() };
        let sources = self.found_by_sources(view, states);
        // What is offered has no cost of its own that speaks for it: the sources must agree more closely.
        let rules = ConsistencyRules::new(&self.options).closer();
        let verdicts =
            consistency::check(self.level, &reference, &offered, &sources, &rules, &|| advance(0))?;
        let closed =
            (0u32..).zip(offered.solutions.iter().zip(verdicts)).filter(|(_, (_, verdict))| verdict.1);
        let closed = closed.map(|(pixel, (&offer, (consistent, validated)))| {
            (pixel, Solution { consistent, validated, ..offer })
        });
        Ok(closed.collect())
    }

    /// [`Steps::finish`] from a view's own state, the surfaces that the views show, and what closes its gaps.
    pub(super) fn settle<'b>(
        &'b self,
        own: &State,
        surfaces: &dyn Fn(usize) -> &'b [ShownPlane],
        closings: &[(u32, Solution)],
        advance: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<ViewResult> {
        let (step, view) = (self.all().len() - 1, own.view());
        let reference = self.reference(step, view, surfaces);
        let cancelled = || advance(0);
        let mut search = self.plain_search(step, &reference, true, &cancelled);
        // A set that falls back to the start set would hide that nothing sees the solution.
        search.view_rules = ViewRules::new(&self.options, 0);
        // Averaged once more: kept since the gaps were closed, those of all views would take half as much memory again.
        let mut solutions = self.averaged(own, &reference);
        closings.iter().for_each(|&(pixel, closed)| solutions[pixel as usize] = closed);
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
}
