//! When the depths of two views are those of the same surface.

use crate::options::CheckOptions;
use crate::simd::Simd;

/// Largest relative difference that the tolerance in pixels allows: at very small triangulation angles a
/// pixel more or less would be any depth.
const MAX_RELATIVE: f32 = 0.05;
/// The tolerance in pixels is at least this many times the median residual of a view: with wrong poses all
/// depths disagree.
const RESIDUALS: f32 = 5.0;
/// Largest factor by which that widens the tolerance: what disagrees more is wrong.
const MAX_WIDENING: f32 = 3.0;

/// The largest difference of depths of the same surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DepthTolerance {
    /// Relative to the depth.
    relative: f32,
    /// In pixels of the source view.
    pixels: f32,
}

impl DepthTolerance {
    /// The tolerance of these options, for a view with this median residual in px.
    pub(crate) fn new(options: &CheckOptions, median_residual: f32) -> DepthTolerance {
        DepthTolerance {
            relative: options.depth_tolerance as f32,
            pixels: options.reprojection_tolerance as f32 * widening(options, median_residual),
        }
    }

    /// This fraction of it.
    pub(crate) fn scaled(self, fraction: f32) -> DepthTolerance {
        DepthTolerance { relative: fraction * self.relative, pixels: fraction * self.pixels }
    }

    /// As a fraction of the depth, in source views with this parallax in px.
    #[inline(always)]
    pub(crate) fn relative<S: Simd>(&self, simd: S, parallax: S::F32) -> S::F32 {
        let of_pixels = simd.div(simd.splat(self.pixels), parallax);
        // The constants last: they take the place of NaN.
        let limited = simd.min(of_pixels, simd.splat(MAX_RELATIVE));
        simd.max(limited, simd.splat(self.relative))
    }
}

/// The factor by which a median residual in px widens the tolerances in pixels.
pub(crate) fn widening(options: &CheckOptions, median_residual: f32) -> f32 {
    let tolerance = options.reprojection_tolerance as f32;
    if tolerance > 0.0 { (RESIDUALS * median_residual / tolerance).clamp(1.0, MAX_WIDENING) } else { 1.0 }
}
