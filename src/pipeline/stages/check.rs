//! The check of a view, and the filters of its checked planes.

use super::search::surface;
use crate::cross_view::ConsistencyCheck;
use crate::error::Result;
use crate::image::PackedImage;
use crate::parallel::Advance;
use crate::pipeline::context::RunContext;
use crate::pipeline::estimate::{Checked, CheckedPlanes, Searched, ViewEstimate};
use crate::pipeline::sources::{PublishedSurfaces, SourcePlanes};
use crate::refine::Filter;
use crate::refine::foreground_fattening::CorrectFattening;
use crate::refine::plane_smoothing::SmoothPlanes;
use crate::scene::Verdict;

/// Checks the planes of a view against the searched planes of its sources (section 5.6 of the paper).
pub(in crate::pipeline) fn check(
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
pub(in crate::pipeline) fn apply_check(
    own: ViewEstimate<Searched>,
    (verdicts, median_residual): &(Vec<Verdict>, f32),
) -> ViewEstimate<CheckedPlanes> {
    let (mut checked, _) = own.into_stage(CheckedPlanes);
    checked.map.set_verdicts(verdicts);
    if let Some(record) = checked.cycles.last_mut() {
        record.median_residual = f64::from(*median_residual);
    }
    checked
}

/// Corrects foreground fattening where the scale may end, as far as the view knows: changes depths and
/// normals of validated pixels at edges; in the last cycle some lose their validation.
pub(in crate::pipeline) fn correct_fattening(
    context: &RunContext,
    image: &PackedImage,
    own: &mut ViewEstimate<CheckedPlanes>,
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
pub(in crate::pipeline) fn smooth_planes(
    context: &RunContext,
    image: &PackedImage,
    own: &mut ViewEstimate<CheckedPlanes>,
) {
    let filter = SmoothPlanes { passes: context.options.refine.smoothing_passes };
    filter.apply(&context.filtered_view(own.at, image), &mut own.map.planes);
}

/// Publishes the validated planes to other views, and records their number.
pub(in crate::pipeline) fn publish(
    context: &RunContext,
    own: ViewEstimate<CheckedPlanes>,
) -> ViewEstimate<Checked> {
    let surface = surface(context, &own);
    let (mut checked, CheckedPlanes) = own.into_stage(Checked { surface });
    let validated = checked.map.count_validated();
    if let Some(record) = checked.cycles.last_mut() {
        record.validated = validated;
    }
    checked
}
