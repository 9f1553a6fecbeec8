//! Residuals of a check: how far the depths of the source views move the projections of a view's planes.
//! Their median shows the errors of the poses and of the matching.

use super::consistency::ConsistencyCheck;
use crate::geometry::ViewSets;
use crate::matching::SourceProjector;
use crate::simd::{LANES, Simd};

/// Residuals beyond, in px, are other surfaces.
const MAX_RESIDUAL: usize = 4;
/// Bins per px of the histogram of residuals.
const BINS: usize = 50;
/// One column and row in so many take part: enough for a median.
const STEP: usize = 4;

/// The median distance, in px of the source views, between where a plane projects to and where it would with
/// the source view's own depth, over a grid of pixels and all views of their sets with a similar depth; 0
/// without any.
pub(super) fn median<S: Simd>(simd: S, check: &ConsistencyCheck) -> f32 {
    let (width, height) = (check.problem.image.width, check.problem.image.height);
    let mut histogram = [0u64; MAX_RESIDUAL * BINS];
    simd.vectorize(
        #[inline(always)]
        || {
            let mut projector = SourceProjector::with_all_sources(simd, check.problem);
            for y in (0..height).step_by(STEP) {
                for x in (0..width).step_by(STEP) {
                    let pixel = y * width + x;
                    let plane = &check.planes[pixel];
                    if plane.depth <= 0.0 {
                        continue;
                    }
                    projector.set_pixel(x as f32, y as f32);
                    let set = check.view_sets.words_of(pixel);
                    for (index, group) in projector.groups().iter().enumerate() {
                        let projections = group.project(simd, plane.depth);
                        let parallax = simd.store(group.parallax(simd, &projections, plane.depth));
                        let pixels = group.nearest_pixels(simd, &projections);
                        let inside = projections.inside & ViewSets::eight(set, index);
                        for (lane, planes) in check.sources[index * LANES..].iter().take(LANES).enumerate() {
                            let own = planes.get(pixels[lane] as usize).map_or(0.0, |own| own.depth);
                            if inside >> lane & 1 == 0 || own <= 0.0 {
                                continue;
                            }
                            let depth = projections.center[2][lane] * plane.depth;
                            let bin = (own / depth - 1.0).abs() * parallax[lane] * BINS as f32;
                            if let Some(count) = histogram.get_mut(bin as usize) {
                                *count += 1;
                            }
                        }
                    }
                }
            }
        },
    );
    let total: u64 = histogram.iter().sum();
    let mut below = 0;
    let median = histogram.iter().position(|&count| {
        below += count;
        2 * below >= total
    });
    median.filter(|_| total > 0).map_or(0.0, |bin| (bin as f32 + 0.5) / BINS as f32)
}
