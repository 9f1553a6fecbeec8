//! Comparison of maps with ground truth.

use glam::DVec3;
use skep::Maps;

/// A fraction counted over pixels, possibly of several views.
#[derive(Debug, Clone, Copy, Default)]
pub struct Share {
    pub hits: u64,
    pub count: u64,
}

impl Share {
    /// Counts one pixel.
    pub fn add(&mut self, hit: bool) {
        self.hits += u64::from(hit);
        self.count += 1;
    }

    /// The fraction, from 0 to 1; 0 of no pixels, so that no test passes without any.
    pub fn value(&self) -> f64 {
        self.hits as f64 / self.count.max(1) as f64
    }
}

/// Whether the relative error of a pixel's depth is less than `tolerance`; false where there is no estimate.
pub fn is_right(maps: &Maps, truth: &Maps, pixel: usize, tolerance: f64) -> bool {
    let (depth, truth) = (f64::from(maps.depth[pixel]), f64::from(truth.depth[pixel]));
    depth > 0.0 && (depth - truth).abs() < tolerance * truth
}

/// Fraction of the chosen pixels with a true depth whose depth is right.
pub fn share_right<'a>(
    maps: impl IntoIterator<Item = (&'a Maps, &'a Maps)>,
    tolerance: f64,
    chosen: impl Fn(usize, usize) -> bool,
) -> Share {
    let mut share = Share::default();
    for (view, (maps, truth)) in maps.into_iter().enumerate() {
        for pixel in (0..truth.depth.len()).filter(|&pixel| truth.depth[pixel] > 0.0 && chosen(view, pixel)) {
            share.add(is_right(maps, truth, pixel, tolerance));
        }
    }
    share
}

/// Angle between the normal of a pixel and the true one, in degrees.
pub fn normal_error(maps: &Maps, truth: &Maps, pixel: usize) -> f64 {
    let normal = |maps: &Maps| DVec3::from_array(maps.normal[pixel].map(f64::from));
    normal(maps).angle_between(normal(truth)).to_degrees()
}
