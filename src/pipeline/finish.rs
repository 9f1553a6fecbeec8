//! What a run hands out for a view: its solutions averaged with those of other views and with small gaps
//! closed, and what became of every pixel.

use super::estimate::{ViewEstimate, maps_of};
use super::stages::{missing, surface_of};
use super::status::classify;
use super::stepper::Stepper;
use crate::ambc::assess;
use crate::cross_view::averaging::average;
use crate::cross_view::consistency::{self, ConsistencyRules};
use crate::error::Result;
use crate::geometry::ViewSets;
use crate::matching::Problem;
use crate::pipeline::ViewResult;
use crate::pipeline::{Hook, Phase, Tracker};
use crate::refine::gap_filling::FillGaps;
use crate::refine::{Filter, FilteredView};
use crate::scene::CompactPlane;
use crate::scene::ScaledView;
use crate::scene::{PixelEstimate, PlaneMap};
use crate::view_selection::{ViewRules, select_sets};

impl Stepper {
    /// Averages planes between views, closes small gaps and settles view set, cost and status of every pixel of a view
    /// after the last cycle.
    ///
    /// # Errors
    /// A view there is not; estimates that are not of full size, of another scene or view than they stand for, or not
    /// marked; no estimate of the view itself; [`crate::Error::Cancelled`] when the hook breaks.
    pub fn finish(&self, view: usize, estimates: &[Option<&ViewEstimate>], hook: Hook) -> Result<ViewResult> {
        let cycle = self.all().len() - 1;
        self.check_place(cycle, view)?;
        let at = self.all()[cycle].progress(Phase::Check, view, self.views());
        let tracker = Tracker::new(hook, u64::from(self.scaled(cycle, view).camera.height));
        self.check_states(cycle, view, estimates)?;
        for (place, estimate) in estimates.iter().enumerate() {
            estimate
                .map_or(Ok(()), |estimate| estimate.require_marked(&format!("estimates[{place}]"), true))?;
        }
        let Some(own) = estimates.get(view).copied().flatten() else {
            return Err(missing(view));
        };
        let advance = |units| tracker.advance(units, at);
        let closings = self.closings(view, estimates, &advance)?;
        self.settle(own, &|view| surface_of(estimates, view), &closings, &advance)
    }

    /// The validated planes of a view, averaged with those that its sources show.
    fn averaged(&self, own: &ViewEstimate, problem: &Problem) -> Vec<PixelEstimate> {
        let mut solutions = own.solved.solutions.clone();
        if self.options.refine.cross_view_averaging {
            average(self.level, problem, &mut solutions);
        }
        solutions
    }

    /// The pixels of small gaps with what the surfaces around them go on to, where the sources agree.
    pub(super) fn closings(
        &self,
        view: usize,
        estimates: &[Option<&ViewEstimate>],
        advance: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<Vec<(u32, PixelEstimate)>> {
        let (cycle, Some(own)) = (self.all().len() - 1, estimates[view]) else { return Ok(Vec::new()) };
        if !self.options.refine.fill_gaps {
            return Ok(Vec::new());
        }
        let problem = self.problem(cycle, view, &|view| surface_of(estimates, view));
        let ScaledView { camera, image, range, .. } = self.scaled(cycle, view);
        let mut filled = self.averaged(own, &problem);
        let pixels = FillGaps.apply(&FilteredView { camera, image, range: *range }, &mut filled);
        let mut candidates = vec![PixelEstimate::default(); filled.len()];
        pixels.iter().for_each(|&pixel| candidates[pixel as usize] = filled[pixel as usize]);
        let mut sets = ViewSets::empty(candidates.len(), problem.sources.len());
        let made = candidates.iter().enumerate().filter(|(_, offer)| offer.depth > 0.0);
        let made: Vec<_> = made.map(|(pixel, offer)| (pixel, offer.depth, offer.normal)).collect();
        select_sets(&problem, ViewRules::new(&self.options, 0), &mut sets, &made);
        let offered = PlaneMap { solutions: candidates, sets, ..PlaneMap::default() };
        let sources = self.found_by_sources(view, estimates);
        // What is offered has no cost of its own that speaks for it: the sources must agree more closely.
        let rules = ConsistencyRules::new(&self.options).closer();
        let verdicts = consistency::check(self.level, &problem, &offered, &sources, &rules, &|| advance(0))?;
        let closed =
            (0u32..).zip(offered.solutions.iter().zip(verdicts)).filter(|(_, (_, verdict))| verdict.1);
        let closed = closed.map(|(pixel, (&offer, (consistent, validated)))| {
            (pixel, PixelEstimate { consistent, validated, ..offer })
        });
        Ok(closed.collect())
    }

    /// [`Stepper::finish`] from a view's own estimate, the surfaces that the views show, and what closes its gaps.
    pub(super) fn settle<'b>(
        &'b self,
        own: &ViewEstimate,
        surfaces: &dyn Fn(usize) -> &'b [CompactPlane],
        closings: &[(u32, PixelEstimate)],
        advance: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<ViewResult> {
        let (cycle, view) = (self.all().len() - 1, own.view());
        let problem = self.problem(cycle, view, surfaces);
        let cancelled = || advance(0);
        let mut search = self.plain_search(cycle, &problem, true, &cancelled);
        // A set that falls back to the start set would hide that nothing sees the solution.
        search.view_rules = ViewRules::new(&self.options, 0);
        // Averaged once more: kept since the gaps were closed, those of all views would take half as much memory again.
        let mut solutions = self.averaged(own, &problem);
        closings.iter().for_each(|&(pixel, closed)| solutions[pixel as usize] = closed);
        let assessment = assess(&search, &solutions)?;
        let mut counts = own.counts();
        counts += assessment.counts;
        let sources = self.sources(view).to_vec();
        Ok(ViewResult {
            width: self.scaled(cycle, view).camera.width,
            estimate: maps_of(&solutions),
            status: classify(
                self.scaled(cycle, view),
                &solutions,
                &assessment,
                sources.len(),
                self.options.min_matched_views(),
            ),
            cost: assessment.cost,
            sources,
            view_sets: assessment.sets,
            counts,
            cycles: own.cycles().to_vec(),
        })
    }
}
