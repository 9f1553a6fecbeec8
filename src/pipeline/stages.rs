//! The stages of a run, one function each: what it reads are its arguments, what it changes is what it
//! returns or takes by `&mut`. The order is in [`pipeline`](super).

use super::context::RunContext;
use super::cycle::{CycleRecord, Place};
use super::estimate::{Checked, Searched, Unfilled, Unpublished, ViewEstimate, maps_of};
use super::result::ViewResult;
use super::sources::{PublishedSurfaces, SourcePlanes};
use super::status;
use crate::ambc::{Candidate, ConfidenceTask, CostRules, Counts, Search, SearchResult, SearchRules, stream};
use crate::cross_view::{self, ConsistencyCheck, DepthTolerance, Donor, Target};
use crate::error::Result;
use crate::fusion::{self, FusionView, PointCloud};
use crate::geometry::ViewSets;
use crate::image::{PackedImage, Picture};
use crate::matching::Problem;
use crate::options::Options;
use crate::parallel::{Advance, ProgressFn};
use crate::refine::Filter;
use crate::refine::foreground_fattening::CorrectFattening;
use crate::refine::gap_filling::FillGaps;
use crate::refine::plane_smoothing::SmoothPlanes;
use crate::refine::speckles::RemoveSpeckles;
use crate::refine::textureless::{FillTextureless, halos};
use crate::scene::{PixelEstimate, PlaneMap, ScaledView, Scene, Verdict};
use crate::view_selection::{ViewRules, select_sets};
use glam::DVec3;
use rayon::prelude::*;

/// The planes that other views propagate to the pixels of a view; none in a scale's first cycle or with
/// propagation off.
#[derive(Debug, Clone)]
pub struct Candidates {
    pub(super) at: Place,
    /// Pixels of the view.
    pub(super) pixels: usize,
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
pub(super) fn upsample(
    context: &RunContext,
    at: Place,
    own: Option<ViewEstimate<Checked>>,
) -> Result<Option<ViewEstimate<Checked>>> {
    let cycles = context.cycles();
    let is_coarser =
        |own: &ViewEstimate<Checked>| cycles[own.cycle()].scale_index < cycles[at.cycle].scale_index;
    Ok(own.map(|own| if is_coarser(&own) { upsampled(context, at, &own) } else { own }))
}

/// An estimate of the next coarser scale on the scale of a cycle.
pub(super) fn upsampled(
    context: &RunContext,
    at: Place,
    own: &ViewEstimate<Checked>,
) -> ViewEstimate<Checked> {
    let (coarse, fine) = (context.scaled(own.at), context.scaled(at));
    let map = own.map.upsample(&coarse.camera, &fine.camera, fine.range);
    let surface = map.publish(&fine.camera);
    ViewEstimate { at, map, counts: own.counts, cycles: own.cycles.clone(), stage: Checked { surface } }
}

/// The candidates for the pixels of a view without a validated plane: of the planes of the views that have it
/// among their sources, those that at least one source view confirms (section 5.6.1 of the paper).
pub(super) fn propagate(
    context: &RunContext,
    at: Place,
    own: Option<&ViewEstimate<Checked>>,
    donors: &[Donor],
    advance: Advance,
) -> Result<Candidates> {
    let ScaledView { camera, range, .. } = context.scaled(at);
    let is_on = context.options.search.view_propagation && context.cycles()[at.cycle].cycle > 0;
    let candidates = match own.filter(|_| is_on) {
        Some(own) => {
            let target = Target { camera, planes: own.planes(), range: *range };
            cross_view::candidates(&target, donors, advance)?
        }
        None => Vec::new(),
    };
    let planes = (0u32..).zip(candidates).filter(|(_, candidate)| candidate.depth > 0.0).collect();
    Ok(Candidates { at, pixels: camera.pixels(), planes })
}

/// The input of a search besides the published surfaces of the sources.
#[derive(Clone, Copy)]
pub(super) struct SearchInput<'a> {
    /// The view's own estimate of the cycle before, on this scale; `None` starts at random.
    pub own: Option<&'a ViewEstimate<Checked>>,
    /// The planes of other views.
    pub candidates: Option<&'a Candidates>,
    /// Whether the estimate of any view is known.
    pub is_guided: bool,
}

/// The options, tolerances of the depths of other views widened by the errors of the poses that the last
/// check of a view found.
fn widened(context: &RunContext, own: Option<&ViewEstimate<Checked>>) -> Options {
    let mut options = context.options.clone();
    let record = own.and_then(|own| own.cycles().last());
    let widening =
        record.map_or(1.0, |record| cross_view::widening(&options.check, record.median_residual as f32));
    options.cost.geom_consistency_max_error *= f64::from(widening);
    options.cost.geom_consistency_missing_error *= f64::from(widening);
    options.view_selection.occlusion_tolerance *= f64::from(widening);
    options
}

/// Searches the plane of every pixel (section 5 of the paper).
pub(super) fn search(
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
        let names = [context.options.seed, at.view as u64, cycle.scale_index as u64, u64::from(cycle.cycle)];
        let search = Search {
            problem,
            window: context.window(at.cycle),
            evidence_window: context.evidence_window(),
            rules: SearchRules::new(&options, &cycle.scale, cycle.cycle, is_guided),
            mask: mask.as_deref(),
            start: own.map(ViewEstimate::planes),
            candidates: candidates.as_deref(),
            random_stream: stream(&names),
            level: context.level,
            advance,
        };
        search.run()?
    };
    let SearchResult { planes, view_sets, is_textureless, counts } = found;
    let mut total = own.map(ViewEstimate::counts).unwrap_or_default();
    total += counts;
    Ok(ViewEstimate {
        at,
        map: PlaneMap { planes },
        counts: total,
        cycles: own.map(|own| own.cycles.clone()).unwrap_or_default(),
        stage: Unfilled { view_sets, is_textureless },
    })
}

/// Fills textureless regions from the planes around them; determines the view sets of the filled pixels.
/// Reads the images and the published surfaces of the sources.
pub(super) fn fill_textureless(
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
pub(super) fn record_search(
    context: &RunContext,
    own: Option<&ViewEstimate<Checked>>,
    mut searched: ViewEstimate<Searched>,
) -> ViewEstimate<Searched> {
    let (before, planes) = (own.map_or(&[][..], ViewEstimate::planes), searched.planes());
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

/// Checks the planes of a view against the searched planes of its sources (section 5.6 of the paper).
pub(super) fn check(
    context: &RunContext,
    own: &ViewEstimate<Searched>,
    sources: SourcePlanes<Searched>,
    advance: Advance,
) -> Result<(Vec<Verdict>, f32)> {
    let images = context.images(own.at)?;
    let check = ConsistencyCheck {
        problem: &context.problem(own.at, &images, PublishedSurfaces::none(context.sources(own.view()))),
        planes: own.planes(),
        view_sets: own.view_sets(),
        sources: sources.into_vec(),
        options: &context.options.check,
        window_radius: context.window(own.cycle()).radius() as f32,
        is_recheck: false,
        level: context.level,
        advance,
    };
    check.run()
}

/// Writes the verdicts of a check into the checked planes.
pub(super) fn apply_check(
    own: ViewEstimate<Searched>,
    (verdicts, median_residual): &(Vec<Verdict>, f32),
) -> ViewEstimate<Unpublished> {
    let (mut checked, _) = own.into_stage(Unpublished);
    checked.map.set_verdicts(verdicts);
    if let Some(record) = checked.cycles.last_mut() {
        record.median_residual = f64::from(*median_residual);
    }
    checked
}

/// Corrects foreground fattening where the scale may end, as far as the view knows: changes depths and
/// normals of validated pixels at edges; in the last cycle some lose their validation.
pub(super) fn correct_fattening(
    context: &RunContext,
    image: &PackedImage,
    own: &mut ViewEstimate<Unpublished>,
) {
    if context.may_end_scale(own.cycle(), own.cycles().last()) {
        let filter = CorrectFattening {
            passes: context.options.refine.fattening_passes,
            is_last_cycle: own.cycle() + 1 == context.cycles().len(),
        };
        filter.apply(&context.filtered_view(own.at, image), &mut own.map.planes);
    }
}

/// Smooths validated planes: changes their depths and normals.
pub(super) fn smooth_planes(context: &RunContext, image: &PackedImage, own: &mut ViewEstimate<Unpublished>) {
    let filter = SmoothPlanes { passes: context.options.refine.smoothing_passes };
    filter.apply(&context.filtered_view(own.at, image), &mut own.map.planes);
}

/// Publishes the validated planes to other views, and records their number.
pub(super) fn publish(context: &RunContext, own: ViewEstimate<Unpublished>) -> ViewEstimate<Checked> {
    let surface = own.map.publish(&context.scaled(own.at).camera);
    let (mut checked, Unpublished) = own.into_stage(Checked { surface });
    let validated = checked.map.count_validated();
    if let Some(record) = checked.cycles.last_mut() {
        record.validated = validated;
    }
    checked
}

/// How far depths of the same surface may differ in the view after its last check.
fn depth_tolerance(context: &RunContext, own: &ViewEstimate<Checked>) -> DepthTolerance {
    let residual = own.cycles().last().map_or(0.0, |record| record.median_residual);
    DepthTolerance::new(&context.options.check, residual as f32)
}

/// The planes of a view, the validated ones averaged with the published surfaces of its sources.
pub(super) fn average_across_views(
    context: &RunContext,
    problem: &Problem,
    own: &ViewEstimate<Checked>,
) -> Vec<PixelEstimate> {
    match context.options.refine.cross_view_averaging {
        true => cross_view::average(context.level, problem, depth_tolerance(context, own), own.planes()),
        false => own.planes().to_vec(),
    }
}

/// Planes for pixels of small gaps.
pub(super) struct FilledGaps(Vec<(u32, PixelEstimate)>);

impl FilledGaps {
    /// Writes them to the planes of their view.
    pub(super) fn write_to(&self, planes: &mut [PixelEstimate]) {
        self.0.iter().for_each(|&(pixel, plane)| planes[pixel as usize] = plane);
    }
}

/// Planes, not validated yet, for the pixels of small gaps from the planes around them.
pub(super) fn fill_gaps(
    context: &RunContext,
    at: Place,
    image: &PackedImage,
    averaged: &[PixelEstimate],
) -> FilledGaps {
    if !context.options.refine.fill_gaps {
        return FilledGaps(Vec::new());
    }
    let mut planes = averaged.to_vec();
    let filled = FillGaps.apply(&context.filtered_view(at, image), &mut planes);
    FilledGaps(filled.into_iter().map(|pixel| (pixel, planes[pixel as usize])).collect())
}

/// The filled planes that are consistent with the planes of the sources before averaging, within tighter
/// tolerances than those of the check.
pub(super) fn recheck(
    context: &RunContext,
    problem: &Problem,
    filled: FilledGaps,
    sources: SourcePlanes<Checked>,
    advance: Advance,
) -> Result<FilledGaps> {
    if filled.0.is_empty() {
        return Ok(filled);
    }
    let pixels = problem.image.width * problem.image.height;
    let mut planes = vec![PixelEstimate::default(); pixels];
    filled.write_to(&mut planes);
    let mut view_sets = ViewSets::empty(pixels, problem.sources.len());
    let indices: Vec<u32> = filled.0.iter().map(|&(pixel, _)| pixel).collect();
    let rules = ViewRules::new(&context.options, 0);
    select_sets(problem, rules, &mut view_sets, &pixels_with_planes(&indices, &planes));
    let check = ConsistencyCheck {
        problem,
        planes: &planes,
        view_sets: &view_sets,
        sources: sources.into_vec(),
        options: &context.options.check,
        window_radius: context.window(context.cycles().len() - 1).radius() as f32,
        is_recheck: true,
        level: context.level,
        advance,
    };
    let (verdicts, _) = check.run()?;
    let confirmed = filled.0.into_iter().filter_map(|(pixel, plane)| {
        let (consistent_views, validated) = verdicts[pixel as usize];
        validated.then_some((pixel, PixelEstimate { consistent_views, validated, ..plane }))
    });
    Ok(FilledGaps(confirmed.collect()))
}

/// Takes the validation from small islands of planes that no surface around them continues.
pub(super) fn remove_speckles(
    context: &RunContext,
    at: Place,
    image: &PackedImage,
    planes: &mut [PixelEstimate],
) {
    let filter = RemoveSpeckles { max_size: context.options.refine.max_speckle_size };
    filter.apply(&context.filtered_view(at, image), planes);
}

/// Determines view set, cost (mean of 1 - NCC), confidence and status of every pixel; filled planes of pixels
/// without texture are not validated. Reads images and published surfaces
/// of the sources.
pub(super) fn classify(
    context: &RunContext,
    problem: &Problem,
    own: ViewEstimate<Checked>,
    mut planes: Vec<PixelEstimate>,
    filled: &FilledGaps,
    advance: Advance,
) -> Result<ViewResult> {
    let costs = ConfidenceTask {
        problem,
        window: context.window(own.cycle()),
        cost: CostRules::new(&context.options, false),
        // A set that falls back to all views would hide that the plane is not visible in any.
        view_set: ViewRules::new(&context.options, 0),
        level: context.level,
        advance,
    };
    let costs = costs.run(&planes)?;
    // The edge of a sky is no gap: a filled plane needs texture of its own.
    for &(pixel, _) in filled.0.iter().filter(|(pixel, _)| !costs.has_texture[*pixel as usize]) {
        planes[pixel as usize].validated = false;
    }
    let tolerance = depth_tolerance(context, &own);
    let confidence = cross_view::confidence(context.level, problem, tolerance, &planes, &costs.cost);
    let view = context.scaled(own.at);
    let status = status::classify(view, &planes, &costs, context.options.min_matched_views());
    let mut counts: Counts = own.counts;
    counts += costs.counts;
    Ok(ViewResult {
        width: view.camera.width,
        raw: maps_of(&planes),
        status,
        cost: costs.cost,
        confidence,
        sources: context.sources(own.view()).to_vec(),
        view_sets: costs.view_sets,
        counts,
        cycles: own.cycles,
    })
}

/// Fuses the validated pixels of all views into points (section 6 of the paper). Reads the results of the
/// views that share a sparse point with a view.
pub(super) fn fuse(
    scene: &Scene,
    options: &Options,
    results: &[ViewResult],
    progress: ProgressFn,
) -> Result<PointCloud> {
    let centers: Vec<DVec3> = scene.views().iter().map(|view| view.camera.center()).collect();
    let overlaps = fusion::overlaps(&centers, scene.points());
    let pictures: Vec<Picture> =
        scene.views().iter().map(|view| view.picture.load()).collect::<Result<_>>()?;
    let views: Vec<FusionView> = (scene.views().iter().zip(results).zip(&overlaps).zip(&pictures))
        .map(|(((view, result), overlap), picture)| FusionView {
            camera: &view.camera,
            maps: &result.raw,
            status: Some(&result.status),
            confidence: Some(&result.confidence),
            picture: Some(picture),
            overlap,
        })
        .collect();
    fusion::fuse(&views, &options.fusion, progress)
}

/// Pixels with depth and normal.
fn pixels_with_planes(pixels: &[u32], planes: &[PixelEstimate]) -> Vec<(usize, f32, glam::Vec3)> {
    let with_plane = |&pixel: &u32| {
        let PixelEstimate { depth, normal, .. } = planes[pixel as usize];
        (pixel as usize, depth, normal)
    };
    pixels.iter().map(with_plane).collect()
}
