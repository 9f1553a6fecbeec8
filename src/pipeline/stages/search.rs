//! The search of a view: candidates from other views, planes of all pixels, and textureless regions.

use super::pixels_with_planes;
use crate::ambc::{Candidate, Search, SearchResult, SearchRules, stream};
use crate::cross_view::{self, CandidateCollector, Donor, Target};
use crate::error::Result;
use crate::geometry::ViewSets;
use crate::image::Mask;
use crate::matching::Problem;
use crate::options::Options;
use crate::parallel::Advance;
use crate::pipeline::context::RunContext;
use crate::pipeline::cycle::{CycleRecord, Place};
use crate::pipeline::estimate::{Checked, CheckedPlanes, OwnEstimate, Searched, Unfilled, ViewEstimate};
use crate::refine::Filter;
use crate::refine::textureless::{FillTextureless, halos};
use crate::scene::{CompactPlane, PixelEstimate, PlaneMap, ScaledView};
use crate::view_selection::select_sets;
use rayon::prelude::*;

/// The planes that other views propagate to the pixels of a view; none in a scale's first cycle or with
/// propagation off.
#[derive(Debug, Clone)]
pub struct Candidates {
    pub(in crate::pipeline) at: Place,
    /// Pixels of the view.
    pub(in crate::pipeline) pixels: usize,
    /// The pixels with a candidate, a small part of all.
    planes: Vec<(u32, Candidate)>,
}

impl Candidates {
    /// One for each pixel; `None` where there are none at all.
    fn by_pixel(&self) -> Option<Vec<Candidate>> {
        if self.planes.is_empty() {
            return None;
        }
        let mut all = vec![Candidate::default(); self.pixels];
        self.planes.iter().for_each(|&(pixel, candidate)| all[pixel as usize] = candidate);
        Some(all)
    }
}

/// Upsamples an estimate to the scale of a cycle: each pixel gets the plane of its coarse pixel. An estimate
/// that is already on that scale is unchanged.
pub(in crate::pipeline) fn upsample(
    context: &RunContext,
    at: Place,
    own: ViewEstimate<Checked>,
) -> ViewEstimate<Checked> {
    let scale = |at: Place| context.cycles()[at.cycle].scale_index;
    if scale(own.at) == scale(at) {
        return own;
    }
    let planes = upsampled(context, at, &own);
    let surface = surface(context, &planes);
    planes.into_stage(Checked { surface }).0
}

/// The planes of an estimate of the next coarser scale on the scale of a cycle.
pub(in crate::pipeline) fn upsampled<S>(
    context: &RunContext,
    at: Place,
    own: &ViewEstimate<S>,
) -> ViewEstimate<CheckedPlanes> {
    let (coarse, fine) = (context.scaled(own.at), context.scaled(at));
    let map = own.map.upsample(&coarse.camera, &fine.camera, fine.range);
    ViewEstimate { at, map, counts: own.counts, cycles: own.cycles.clone(), stage: CheckedPlanes }
}

/// The surface of a checked estimate as other views read it.
pub(in crate::pipeline) fn surface(
    context: &RunContext,
    planes: &ViewEstimate<CheckedPlanes>,
) -> Vec<CompactPlane> {
    planes.map.publish(&context.scaled(planes.at).camera)
}

/// Collects the candidates for the pixels of a view without a validated plane, from one donor after another:
/// of the planes of the views that have it among their sources, those that at least one source view confirms
/// (section 5.6.1 of the paper).
pub(in crate::pipeline) struct Propagation<'a> {
    context: &'a RunContext,
    at: Place,
    /// `None` where no plane is propagated.
    collector: Option<CandidateCollector<'a>>,
}

impl<'a> Propagation<'a> {
    /// No candidates yet.
    pub(in crate::pipeline) fn new(
        context: &'a RunContext,
        at: Place,
        own: Option<OwnEstimate<'a>>,
    ) -> Propagation<'a> {
        let is_on = context.options.search.view_propagation && context.cycles()[at.cycle].cycle > 0;
        let ScaledView { camera, range, .. } = context.scaled(at);
        let collector = own
            .filter(|_| is_on)
            .map(|own| CandidateCollector::new(Target { camera, planes: own.planes, range: *range }));
        Propagation { context, at, collector }
    }

    /// The views whose planes are propagated: none in a scale's first cycle or with propagation off.
    pub(in crate::pipeline) fn donors(&self) -> &'a [u32] {
        self.collector.as_ref().map_or(&[], |_| self.context.readers(self.at.view))
    }

    /// Adds the candidates from the checked planes of a donor. The order of the donors does not matter.
    ///
    /// # Errors
    /// What `advance` returns.
    pub(in crate::pipeline) fn add(
        &mut self,
        view: usize,
        planes: &[PixelEstimate],
        advance: Advance,
    ) -> Result<()> {
        let camera = &self.context.scaled(Place { view, ..self.at }).camera;
        match &mut self.collector {
            Some(collector) => collector.add(&Donor { view: view as u32, camera, planes }, advance),
            None => Ok(()),
        }
    }

    /// The candidates.
    pub(in crate::pipeline) fn finish(self) -> Candidates {
        let pixels = self.context.scaled(self.at).camera.pixels();
        let planes = self.collector.map(CandidateCollector::into_candidates).unwrap_or_default();
        Candidates { at: self.at, pixels, planes }
    }
}

/// The input of a search besides the published surfaces of the sources.
#[derive(Clone, Copy)]
pub(in crate::pipeline) struct SearchInput<'a> {
    /// The view's own estimate of the cycle before, on this scale; `None` starts at random.
    pub own: Option<OwnEstimate<'a>>,
    /// The planes of other views.
    pub candidates: Option<&'a Candidates>,
    /// Whether the estimate of any view is known.
    pub is_guided: bool,
}

/// The options, tolerances of the depths of other views widened by the errors of the poses that the last
/// check of a view found.
fn widened(context: &RunContext, own: Option<OwnEstimate>) -> Options {
    let mut options = context.options.clone();
    let record = own.and_then(|own| own.cycles.last());
    let widening =
        record.map_or(1.0, |record| cross_view::widening(&options.check, record.median_residual as f32));
    options.cost.geom_consistency_max_error *= f64::from(widening);
    options.cost.geom_consistency_missing_error *= f64::from(widening);
    options.view_selection.occlusion_tolerance *= f64::from(widening);
    options
}

/// Searches the plane of every pixel (section 5 of the paper).
pub(in crate::pipeline) fn search(
    context: &RunContext,
    at: Place,
    problem: &Problem,
    input: SearchInput,
    advance: Advance,
) -> Result<ViewEstimate<Unfilled>> {
    let SearchInput { own, candidates, is_guided } = input;
    let ScaledView { camera, mask, .. } = context.scaled(at);
    let cycle = &context.cycles()[at.cycle];
    let options = widened(context, own);
    let found = if problem.sources.is_empty() {
        SearchResult::without_sources(camera.pixels())
    } else {
        let candidates = candidates.and_then(Candidates::by_pixel);
        let mask = mask.as_ref().map(Mask::to_vec);
        let names = [context.options.seed, at.view as u64, cycle.scale_index as u64, u64::from(cycle.cycle)];
        let search = Search {
            problem,
            window: context.window(at.cycle),
            evidence_window: context.evidence_window(),
            rules: SearchRules::new(&options, &cycle.scale, cycle.cycle, is_guided),
            mask: mask.as_deref(),
            start: own.map(|own| own.planes),
            candidates: candidates.as_deref(),
            random_stream: stream(&names),
            level: context.level,
            advance,
        };
        search.run()?
    };
    let SearchResult { planes, view_sets, is_textureless, counts } = found;
    let mut total = own.map(|own| own.counts).unwrap_or_default();
    total += counts;
    Ok(ViewEstimate {
        at,
        map: PlaneMap { planes },
        counts: total,
        cycles: own.map(|own| own.cycles.to_vec()).unwrap_or_default(),
        stage: Unfilled { view_sets, is_textureless },
    })
}

/// Fills textureless regions from the planes around them; determines the view sets of the filled pixels.
/// Reads the images and the published surfaces of the sources.
pub(in crate::pipeline) fn fill_textureless(
    context: &RunContext,
    problem: &Problem,
    found: ViewEstimate<Unfilled>,
) -> ViewEstimate<Searched> {
    let cycle = &context.cycles()[found.cycle()];
    let (mut searched, Unfilled { mut view_sets, is_textureless }) =
        found.into_stage(Searched { view_sets: ViewSets::default() });
    let planes = &mut searched.map.planes;
    if !problem.sources.is_empty() {
        let filter = FillTextureless { problem, is_textureless: &is_textureless };
        let filled = filter.apply(&context.filtered_view(searched.at, problem.image), planes);
        let rules = SearchRules::new(&context.options, &cycle.scale, cycle.cycle, false).view_set;
        select_sets(problem, rules, &mut view_sets, &pixels_with_planes(&filled, planes));
        if cycle.scale_index > 0 {
            let has_no_evidence: Vec<bool> =
                (0..planes.len()).map(|pixel| is_textureless[pixel] && view_sets.count(pixel) == 0).collect();
            for pixel in halos(problem.image, &has_no_evidence) {
                let words = view_sets.words_per_pixel();
                view_sets.words_mut()[pixel as usize * words..][..words].fill(0);
            }
        }
    }
    // During a search `validated` marks planes that come from validated ones; the check sets it anew.
    planes.par_iter_mut().for_each(|plane| plane.validated = false);
    searched.stage.view_sets = view_sets;
    searched
}

/// Relative difference of depths from which on a plane counts as changed.
const CHANGED_DEPTH: f32 = 1e-3;

/// Records the cycle: how many pixels have a plane, and how many planes changed since the cycle before.
pub(in crate::pipeline) fn record_search(
    context: &RunContext,
    own: Option<OwnEstimate>,
    mut searched: ViewEstimate<Searched>,
) -> ViewEstimate<Searched> {
    let (before, planes) = (own.map_or(&[][..], |own| own.planes), searched.planes());
    let has_changed = |(index, plane): &(usize, &PixelEstimate)| {
        let before = before.get(*index).map_or(0.0, |plane| plane.depth);
        plane.depth > 0.0 && (plane.depth - before).abs() > CHANGED_DEPTH * plane.depth
    };
    let cycle = &context.cycles()[searched.cycle()];
    let record = CycleRecord {
        downscale: cycle.scale.downscale,
        cycle: cycle.cycle,
        pixels: planes.par_iter().filter(|plane| plane.depth > 0.0).count() as u64,
        changed: planes.par_iter().enumerate().filter(has_changed).count() as u64,
        validated: 0,
        median_residual: 0.0,
    };
    searched.cycles.push(record);
    searched
}
