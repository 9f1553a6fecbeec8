//! What a run hands out: confidence and outcome of every pixel, and the fused points.

use super::Run;
use crate::ambc::assess;
use crate::error::Result;
use crate::fusion::{self, FusionView};
use crate::image::ScaledView;
use crate::maps::{Maps, PointCloud, Reconstruction, ViewResult};
use crate::outcome::outcomes;
use crate::progress::{Phase, Progress, Tracker};
use crate::state::{Solution, ViewState};
use crate::views::ViewRules;
use std::ops::ControlFlow;

/// Share of the whole work that fusion is reckoned at.
pub const FUSION_SHARE: f64 = 0.03;

impl Run<'_> {
    /// Settles what became of every pixel, and fuses.
    pub(super) fn finish(
        mut self,
        views: &[ScaledView],
        states: &[ViewState],
        tracker: &Tracker,
    ) -> Result<Reconstruction> {
        let mut results = Vec::with_capacity(views.len());
        for view in 0..views.len() {
            results.push(self.result(view, views, states, tracker)?);
        }
        let points = self.fuse(&results)?;
        Ok(Reconstruction { views: results, points, warnings: self.sources.warnings })
    }

    fn result(
        &mut self,
        view: usize,
        views: &[ScaledView],
        states: &[ViewState],
        tracker: &Tracker,
    ) -> Result<ViewResult> {
        let cycles = std::mem::take(&mut self.cycles[view]);
        let reference = self.reference(view, views, states);
        let progress = Progress {
            phase: Phase::Check,
            reduction: 1,
            cycle: cycles.last().map_or(0, |last| last.cycle),
            view,
            views: views.len(),
            done: 0.0,
        };
        let cancelled = || tracker.advance(0, progress);
        let mut search = self.plain_search(&reference, true, &cancelled);
        // A set that falls back to the start set would hide that nothing sees the solution.
        search.view_rules = ViewRules::new(self.options, 0);
        let assessment = assess(&search, &states[view].solutions)?;
        let mut counts = self.counts[view];
        counts += assessment.counts;
        let sources = self.sources.lists[view].clone();
        Ok(ViewResult {
            estimate: estimate(&states[view].solutions),
            outcome: outcomes(&views[view], &states[view], &assessment, sources.len()),
            cost: assessment.cost,
            sources,
            view_sets: assessment.sets,
            counts,
            cycles,
        })
    }

    fn fuse(&self, results: &[ViewResult]) -> Result<PointCloud> {
        let maps: Vec<Maps> = results.iter().map(ViewResult::filtered).collect();
        let overlaps = fusion::overlaps(results.len(), self.scene.points());
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

fn estimate(solutions: &[Solution]) -> Maps {
    Maps {
        depth: solutions.iter().map(|solution| solution.depth).collect(),
        normal: solutions.iter().map(|solution| solution.normal.to_array()).collect(),
    }
}
