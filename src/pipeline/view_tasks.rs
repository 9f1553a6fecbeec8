//! The tasks of one view: stages that follow each other without reading anything new of other views.

use super::context::RunContext;
use super::cycle::Place;
use super::estimate::{Checked, OwnEstimate, Searched, ViewEstimate};
use super::result::ViewResult;
use super::sources::{PublishedSurfaces, SourcePlanes};
use super::stages::{self, SearchInput};
use crate::error::Result;
use crate::parallel::Advance;

/// Searches a view and fills its textureless regions. Reads the published surfaces of its sources.
pub(super) fn search(
    context: &RunContext,
    at: Place,
    surfaces: PublishedSurfaces,
    input: SearchInput,
    advance: Advance,
) -> Result<ViewEstimate<Searched>> {
    let images = context.images(at)?;
    let problem = context.problem(at, &images, surfaces);
    let found = stages::search(context, at, &problem, input, advance)?;
    advance(0)?;
    let searched = stages::fill_textureless(context, &problem, found);
    Ok(stages::record_search(context, input.own, searched))
}

/// Checks a view and filters its planes. Reads the searched planes of its sources.
pub(super) fn check(
    context: &RunContext,
    own: &ViewEstimate<Searched>,
    sources: SourcePlanes<Searched>,
    advance: Advance,
) -> Result<ViewEstimate<Checked>> {
    let verdicts = stages::check(context, own, sources, advance)?;
    let image = context.image(own.at)?;
    let mut checked = stages::apply_check(own.clone(), &verdicts);
    stages::correct_fattening(context, &image, &mut checked);
    advance(0)?;
    stages::smooth_planes(context, &image, &mut checked);
    advance(0)?;
    Ok(stages::publish(context, checked))
}

/// The result of a view after the last cycle. Reads the published surfaces of its sources and their checked
/// planes.
pub(super) fn finish(
    context: &RunContext,
    at: Place,
    surfaces: PublishedSurfaces,
    own: OwnEstimate,
    sources: SourcePlanes<Checked>,
    advance: Advance,
) -> Result<ViewResult> {
    let images = context.images(at)?;
    let problem = context.problem(at, &images, surfaces);
    let mut planes = stages::average_across_views(context, &problem, own);
    advance(0)?;
    let filled = stages::fill_gaps(context, at, &images.own, &planes);
    advance(0)?;
    let filled = stages::recheck(context, &problem, filled, sources, advance)?;
    filled.write_to(&mut planes);
    stages::remove_speckles(context, at, &images.own, &mut planes);
    stages::classify(context, &problem, own, planes, &filled, advance)
}
