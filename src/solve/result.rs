//! What a run hands out for a view: confidence and outcome of every pixel.

use super::prepare::Steps;
use super::search::missing;
use super::state::State;
use crate::ambc::assess;
use crate::error::Result;
use crate::maps::ViewResult;
use crate::outcome::outcomes;
use crate::progress::{Hook, Phase, Tracker};
use crate::views::ViewRules;

impl Steps {
    /// Settles view set, cost and outcome of every pixel of a view after the last step.
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
        let assessment = assess(&search, &own.solved.solutions)?;
        let mut counts = own.counts();
        counts += assessment.counts;
        let sources = self.sources(view).to_vec();
        Ok(ViewResult {
            width: self.scaled(step, view).camera.width,
            estimate: own.maps(),
            outcome: outcomes(
                self.scaled(step, view),
                &own.solved,
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
