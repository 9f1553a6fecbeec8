//! What a part without texture looks like in the source views. Inside it any plane fits, but by a wrong one its outline
//! falls somewhere else.

use super::place;
use super::region::Part;
use crate::image::{blurred, deviation};
use crate::matching::{Problem, Source};
use glam::DVec3;

/// Difference of blurred gray values up to which a pixel looks the same, in deviations of the noise and gray values.
const SAME: (f32, f32) = (1.2, 0.5);
/// Source views that must see the part.
const MIN_VIEWS: usize = 2;
/// Pixels inside by which views are brought to the same brightness.
const INNER_PIXELS: usize = 200;

/// Pixels of a part with their blurred gray values.
pub struct Looks {
    /// Along its outline.
    band: Vec<(DVec3, f32)>,
    /// Within it.
    inner: Vec<(DVec3, f32)>,
    tolerance: f32,
}

impl Looks {
    pub fn new(problem: &Problem, part: &Part, band: Vec<usize>) -> Looks {
        let look = |pixel: usize| (place(pixel, problem.image.width), blurred(problem.image, pixel, 1));
        let every = part.core.len().div_ceil(INNER_PIXELS);
        Looks {
            band: band.into_iter().map(look).collect(),
            inner: part.core.iter().copied().step_by(every).map(look).collect(),
            tolerance: SAME.0 * deviation(problem.image, part.core[0]) + SAME.1,
        }
    }

    /// Share of the band that looks the same in the source views if the part lies on this plane: the mean of the better
    /// half of the views, since something may hide it from the others. `None` where too few views see it.
    pub fn share(&self, problem: &Problem, plane: DVec3) -> Option<f64> {
        let mut shares: Vec<f64> =
            problem.sources.iter().filter_map(|source| self.share_in(source, plane)).collect();
        if shares.len() < MIN_VIEWS {
            return None;
        }
        shares.sort_unstable_by(|one, other| other.total_cmp(one));
        let better = &shares[..shares.len().div_ceil(2)];
        Some(better.iter().sum::<f64>() / better.len() as f64)
    }

    fn share_in(&self, source: &Source, plane: DVec3) -> Option<f64> {
        let difference = |&(place, gray): &(DVec3, f32)| {
            let inverse_depth = Some(plane.dot(place) as f32).filter(|&inverse_depth| inverse_depth > 0.0)?;
            let at_infinity = source.pose.at_infinity(place.x as f32, place.y as f32);
            let at = source.project(at_infinity + source.pose.epipole * inverse_depth)?;
            let nearest = (at.y + 0.5) as usize * source.image.width + (at.x + 0.5) as usize;
            Some(blurred(source.image, nearest, 1) - gray)
        };
        let mut inner: Vec<f32> = self.inner.iter().filter_map(difference).collect();
        let band: Vec<f32> = self.band.iter().filter_map(difference).collect();
        if inner.is_empty() || 2 * band.len() < self.band.len().max(1) {
            return None;
        }
        let middle = inner.len() / 2;
        let brighter = *inner.select_nth_unstable_by(middle, f32::total_cmp).1;
        let same = band.iter().filter(|&&difference| (difference - brighter).abs() < self.tolerance).count();
        Some(same as f64 / band.len() as f64)
    }
}
