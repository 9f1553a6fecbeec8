//! Filling of textureless regions: where the image has nothing but noise no search finds a surface, but the
//! surroundings suggest one.
//!
//! ```text
//! for each connected region of textureless pixels without a validated plane:
//!     skip it unless validated pixels surround most of its outline
//!     grow it by the adjacent pixels of similar gray value         (only if it ends within the image)
//!     fit planes to the validated pixels around it                 (rim_planes)
//!     score each plane by how well the outline matches the source views through it   (photo_check)
//!     give the best plane to all pixels of the region
//! ```
//!
//! Reads the validated planes, the gray values of the view and of its source views; changes depth, normal and
//! `validated` of the pixels of a region, and keeps their cost. `validated` means here that the plane comes
//! from a validated plane; the next check decides about the filled ones like about all others.
//!
//! Linear in the number of pixels, and for each region `MAX_PLANES` RANSAC searches and as many photo checks,
//! which have bounded numbers of samples.

mod halo;
mod photo_check;
mod region;
mod rim_planes;
#[cfg(test)]
mod tests;

use super::{Domain, Filter, FilteredView};
use crate::geometry::{Grid, PlaneHypothesis, SlantedPlane};
use crate::matching::Problem;
use crate::scene::PixelEstimate;
use glam::DVec3;
pub(crate) use halo::halos;
use photo_check::PhotoCheck;
use region::{PixelSet, Region};
use rim_planes::{RimPlane, RimSample, fit_rim_planes};

/// Fraction of a region's outline that must lie beside pixels on the plane, where the photo check confirms
/// the plane: a panel may touch its own surface on one side only.
const MIN_RIM_CONFIRMED: f64 = 0.2;
/// The same where too few source views see the region for a photo check: the ground below a sky is on one
/// side of it only, and must not fill it.
const MIN_RIM_UNCHECKED: f64 = 0.6;
/// Fraction of the outline that must match in the source views. Chosen on renderings.
const MIN_MATCHING: f64 = 0.8;
/// Weight of the fraction of the rim that is on a plane against the fraction of the outline that matches.
/// Measured on renderings: 0.05 loses completeness.
const RIM_WEIGHT: f64 = 0.1;

/// Fills each textureless region with the plane of its surroundings that the source views confirm.
pub(crate) struct FillTextureless<'a> {
    /// The view, as in the call, and its source views.
    pub problem: &'a Problem<'a>,
    /// Whether the window around a pixel varies no more than noise, for every pixel.
    pub is_textureless: &'a [bool],
}

impl Filter for FillTextureless<'_> {
    fn reach(&self) -> Option<usize> {
        None
    }

    /// A region grows also over validated pixels: their windows may have matched by what is beside the
    /// region.
    fn domain(&self) -> Domain {
        Domain::All
    }

    fn apply(&self, view: &FilteredView, planes: &mut [PixelEstimate]) -> Vec<u32> {
        let grid = view.grid();
        let mut scratch = PixelSet::new(grid.pixels());
        let is_enclosed = region::find_enclosed(grid, self.is_textureless);
        let mut is_traced = vec![false; grid.pixels()];
        let mut filled = Vec::new();
        let mut regions = 0;
        for pixel in 0..grid.pixels() {
            if is_traced[pixel] || !region::is_open(planes, self.is_textureless, pixel) {
                continue;
            }
            regions += 1;
            let mut region = Region::trace(grid, planes, self.is_textureless, pixel, &mut scratch);
            region.core.iter().for_each(|&pixel| is_traced[pixel] = true);
            if !region.outline.is_surrounded(region.core.len()) {
                continue;
            }
            if is_enclosed[pixel] {
                region.grow(view.image, planes, &mut scratch);
            }
            let rim = rim_samples(grid, &region.rim(planes, &mut scratch), planes);
            let photo_check = is_enclosed[pixel].then(|| {
                let band = region.outline_band(&mut scratch);
                PhotoCheck::new(view.image, &region.core, &band)
            });
            let candidates = fit_rim_planes(&rim, regions);
            let matching = |plane| photo_check.as_ref()?.matching_fraction(self.problem, plane);
            if let Some(plane) = best_plane(&candidates, region.outline.surface_fraction(), matching) {
                filled.extend(self.fill(view, &region, plane, planes));
            }
        }
        // Regions may grow over the same pixels.
        filled.sort_unstable();
        filled.dedup();
        filled
    }
}

impl FillTextureless<'_> {
    /// Gives a plane to the pixels of a region where it is usable, and returns those.
    fn fill(
        &self,
        view: &FilteredView,
        region: &Region,
        plane: DVec3,
        planes: &mut [PixelEstimate],
    ) -> Vec<u32> {
        let mut filled = Vec::new();
        for pixel in region.pixels() {
            if let Some(PlaneHypothesis { depth, normal }) = self.plane_at(view, plane, pixel) {
                planes[pixel] = PixelEstimate { depth, normal, validated: true, ..planes[pixel] };
                filled.push(pixel as u32);
            }
        }
        filled
    }

    /// A plane, as coefficients of inverse depth, at a pixel; `None` where it is not usable.
    fn plane_at(&self, view: &FilteredView, plane: DVec3, pixel: usize) -> Option<PlaneHypothesis> {
        let place = homogeneous(view.grid(), pixel);
        let ray = self.problem.ray(place.x as f32, place.y as f32);
        let slanted = SlantedPlane {
            inverse_depth: plane.dot(place) as f32,
            slope_x: plane.x as f32,
            slope_y: plane.y as f32,
        };
        let (depth, normal) = slanted.depth_and_normal(ray, self.problem.inverse_focal);
        let hypothesis = PlaneHypothesis { depth, normal };
        hypothesis.is_usable(ray, &view.range.into()).then_some(hypothesis)
    }
}

/// `[x y 1]` of a pixel: the inverse depth of a plane there is the scalar product with the plane's
/// coefficients.
fn homogeneous(grid: Grid, pixel: usize) -> DVec3 {
    let (x, y) = grid.position(pixel);
    DVec3::new(x as f64, y as f64, 1.0)
}

fn rim_samples(grid: Grid, rim: &[usize], planes: &[PixelEstimate]) -> Vec<RimSample> {
    let sample = |&pixel: &usize| RimSample {
        place: homogeneous(grid, pixel),
        inverse_depth: 1.0 / f64::from(planes[pixel].depth),
    };
    rim.iter().map(sample).collect()
}

/// The plausible plane with the best score; `surface_fraction` is that of the region's outline, `matching`
/// the result of the photo check, `None` where there is none.
fn best_plane(
    candidates: &[RimPlane],
    surface_fraction: f64,
    matching: impl Fn(DVec3) -> Option<f64>,
) -> Option<DVec3> {
    let mut best: Option<(f64, DVec3)> = None;
    for &RimPlane { plane, inlier_fraction } in candidates {
        let (matching, min_rim) = match matching(plane) {
            Some(matching) => (matching, MIN_RIM_CONFIRMED),
            None => (MIN_MATCHING, MIN_RIM_UNCHECKED),
        };
        // As if the rim went on along the border of the image, but nowhere on the plane.
        let is_plausible = inlier_fraction * surface_fraction >= min_rim && matching >= MIN_MATCHING;
        let score = matching + RIM_WEIGHT * inlier_fraction;
        // Of equal scores the last one wins.
        if is_plausible && best.is_none_or(|(best, _)| score.total_cmp(&best).is_ge()) {
            best = Some((score, plane));
        }
    }
    best.map(|(_, plane)| plane)
}
