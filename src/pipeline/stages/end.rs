//! The end of a run: averaging across views, small gaps, speckles, the maps of a view, and the cloud.

use super::pixels_with_planes;
use crate::ambc::{ConfidenceTask, CostRules};
use crate::cross_view::{self, ConsistencyCheck, DepthTolerance};
use crate::error::Result;
use crate::fusion::{self, FusionView, PointCloud};
use crate::geometry::ViewSets;
use crate::image::{PackedImage, Picture};
use crate::matching::Problem;
use crate::options::Options;
use crate::parallel::{Advance, ProgressFn};
use crate::pipeline::context::RunContext;
use crate::pipeline::cycle::Place;
use crate::pipeline::estimate::{Checked, OwnEstimate, maps_of};
use crate::pipeline::result::ViewResult;
use crate::pipeline::sources::SourcePlanes;
use crate::pipeline::status;
use crate::refine::Filter;
use crate::refine::gap_filling::FillGaps;
use crate::refine::speckles::RemoveSpeckles;
use crate::scene::{PixelEstimate, Scene, is_inside};
use crate::view_selection::{ViewRules, select_sets};
use glam::DVec3;

/// How far depths of the same surface may differ in the view after its last check.
fn depth_tolerance(context: &RunContext, own: OwnEstimate) -> DepthTolerance {
    let residual = own.cycles.last().map_or(0.0, |record| record.median_residual);
    DepthTolerance::new(&context.options.check, residual as f32)
}

/// The planes of a view, the validated ones averaged with the published surfaces of its sources.
pub(in crate::pipeline) fn average_across_views(
    context: &RunContext,
    problem: &Problem,
    own: OwnEstimate,
) -> Vec<PixelEstimate> {
    match context.options.refine.cross_view_averaging {
        true => cross_view::average(context.level, problem, depth_tolerance(context, own), own.planes),
        false => own.planes.to_vec(),
    }
}

/// Planes for pixels of small gaps.
pub(in crate::pipeline) struct FilledGaps(Vec<(u32, PixelEstimate)>);

impl FilledGaps {
    /// Writes them to the planes of their view.
    pub(in crate::pipeline) fn write_to(&self, planes: &mut [PixelEstimate]) {
        self.0.iter().for_each(|&(pixel, plane)| planes[pixel as usize] = plane);
    }
}

/// Planes, not validated yet, for the pixels of small gaps from the planes around them.
pub(in crate::pipeline) fn fill_gaps(
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
pub(in crate::pipeline) fn recheck(
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
pub(in crate::pipeline) fn remove_speckles(
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
pub(in crate::pipeline) fn classify(
    context: &RunContext,
    problem: &Problem,
    own: OwnEstimate,
    mut planes: Vec<PixelEstimate>,
    filled: &FilledGaps,
    advance: Advance,
) -> Result<ViewResult> {
    let costs = ConfidenceTask {
        problem,
        window: context.window(own.at.cycle),
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
    let tolerance = depth_tolerance(context, own);
    let confidence = cross_view::confidence(context.level, problem, tolerance, &planes, &costs.cost);
    let view = context.scaled(own.at);
    let status = status::classify(view, &planes, &costs, context.options.min_matched_views());
    let mut counts = own.counts;
    counts += costs.counts;
    Ok(ViewResult {
        width: view.camera.width,
        raw: maps_of(&planes),
        status,
        cost: costs.cost,
        confidence,
        sources: context.sources(own.at.view).to_vec(),
        view_sets: costs.view_sets,
        counts,
        cycles: own.cycles.to_vec(),
    })
}

/// Fuses the validated pixels of all views into points (section 6 of the paper). Reads the results of the
/// views that share a sparse point with a view.
pub(in crate::pipeline) fn fuse(
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
    let cloud = fusion::fuse(&views, &options.fusion, progress)?;
    Ok(match options.input.bounds()? {
        Some(bounds) => cloud.filtered(|position| is_inside(bounds, position)),
        None => cloud,
    })
}
