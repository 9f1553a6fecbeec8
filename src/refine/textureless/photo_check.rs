//! Photometric check of a plane for a textureless region: inside the region any plane matches, but through a
//! wrong one the outline falls on something else in the source views.

use super::homogeneous;
use crate::geometry::Grid;
use crate::image::{PackedImage, blurred, deviation};
use crate::matching::{Problem, Source};
use glam::DVec3;

/// Largest difference of blurred gray values that matches, in deviations of the view's noise: two and a half
/// times 0.47, the deviation of a difference of two 3 x 3 means.
const MAX_DIFFERENCE_NOISE: f32 = 1.2;
/// Allowance on top of it, in gray values: rounding and small changes of brightness.
const MAX_DIFFERENCE_OFFSET: f32 = 0.5;
/// Fewest source views that must see the region: one alone may match by chance.
const MIN_VIEWS: usize = 2;
/// Most samples inside the region, whose median difference is that of the brightness of two views: enough for
/// a median.
const INNER_SAMPLES: usize = 200;
/// Radius in pixels of the box blur against noise: 3 x 3 pixels.
const BLUR_RADIUS: usize = 1;

/// Samples of a region with their blurred gray values.
pub(super) struct PhotoCheck {
    /// Along its outline.
    band: Vec<GraySample>,
    /// Inside it.
    inner: Vec<GraySample>,
    max_difference: f32,
}

struct GraySample {
    place: DVec3,
    gray: f32,
}

impl PhotoCheck {
    /// The samples of a region's core and of the band along its outline.
    pub(super) fn new(image: &PackedImage, core: &[usize], band: &[usize]) -> PhotoCheck {
        let grid = Grid { width: image.width, height: image.height };
        let sample = |&pixel: &usize| GraySample {
            place: homogeneous(grid, pixel),
            gray: blurred(image, pixel, BLUR_RADIUS),
        };
        let step = core.len().div_ceil(INNER_SAMPLES);
        PhotoCheck {
            band: band.iter().map(sample).collect(),
            inner: core.iter().step_by(step).map(sample).collect(),
            max_difference: MAX_DIFFERENCE_NOISE * deviation(image, core[0]) + MAX_DIFFERENCE_OFFSET,
        }
    }

    /// Fraction of the band that matches in the source views through a plane: the mean of the better half of
    /// the views, as the region may be occluded in the others. `None` where too few views see it.
    pub(super) fn matching_fraction(&self, problem: &Problem, plane: DVec3) -> Option<f64> {
        let mut fractions: Vec<f64> =
            problem.sources.iter().filter_map(|source| self.matching_fraction_in(source, plane)).collect();
        if fractions.len() < MIN_VIEWS {
            return None;
        }
        fractions.sort_unstable_by(|one, other| other.total_cmp(one));
        let better = &fractions[..fractions.len().div_ceil(2)];
        Some(better.iter().sum::<f64>() / better.len() as f64)
    }

    fn matching_fraction_in(&self, source: &Source, plane: DVec3) -> Option<f64> {
        let difference = |sample: &GraySample| sample.difference(source, plane);
        let mut inner: Vec<f32> = self.inner.iter().filter_map(difference).collect();
        let band: Vec<f32> = self.band.iter().filter_map(difference).collect();
        if inner.is_empty() || 2 * band.len() < self.band.len().max(1) {
            return None;
        }
        let middle = inner.len() / 2;
        let brightness = *inner.select_nth_unstable_by(middle, f32::total_cmp).1;
        let matches = |&&difference: &&f32| (difference - brightness).abs() < self.max_difference;
        Some(band.iter().filter(matches).count() as f64 / band.len() as f64)
    }
}

impl GraySample {
    /// Blurred gray value in a source view through a plane, less that in the view; `None` outside the source
    /// view.
    fn difference(&self, source: &Source, plane: DVec3) -> Option<f32> {
        let inverse_depth =
            Some(plane.dot(self.place) as f32).filter(|&inverse_depth| inverse_depth > 0.0)?;
        let at_infinity = source.pose.at_infinity(self.place.x as f32, self.place.y as f32);
        let projection = source.project(at_infinity + source.pose.epipole * inverse_depth)?;
        let nearest = (projection.y + 0.5) as usize * source.image.width + (projection.x + 0.5) as usize;
        Some(blurred(source.image, nearest, BLUR_RADIUS) - self.gray)
    }
}
