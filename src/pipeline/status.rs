//! The status of every pixel: validated, or the reason why not, which explains an empty cloud.

use crate::ambc::Confidence;
use crate::geometry::SearchRange;
use crate::image::Mask;
use crate::scene::{PixelEstimate, PixelStatus, ScaledView};

/// Relative distance to an end of the depth range within which a depth counts as limited by it.
const AT_RANGE_END: f32 = 1e-3;

/// The status of each pixel of a view; a plane that is not validated and visible in fewer than
/// `min_views` source views has no sources.
pub(super) fn classify(
    view: &ScaledView,
    planes: &[PixelEstimate],
    confidence: &Confidence,
    min_views: usize,
) -> Vec<PixelStatus> {
    let SearchRange { near, far } = view.range.into();
    let is_at_end = |depth: f32| depth < near * (1.0 + AT_RANGE_END) || depth > far * (1.0 - AT_RANGE_END);
    let mask = view.mask.as_ref().map(Mask::to_vec);
    let status = |(pixel, plane): (usize, &PixelEstimate)| {
        if mask.as_ref().is_some_and(|mask| !mask[pixel]) {
            PixelStatus::Masked
        } else if plane.validated {
            PixelStatus::Validated
        } else if confidence.sources < min_views || plane.depth <= 0.0 {
            PixelStatus::NoSources
        } else if !confidence.has_texture[pixel] {
            PixelStatus::NoTexture
        } else if confidence.view_sets.count(pixel) < min_views {
            PixelStatus::NoSources
        } else if is_at_end(plane.depth) {
            PixelStatus::OutOfRange
        } else {
            PixelStatus::Inconsistent
        }
    };
    planes.iter().enumerate().map(status).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ambc::Counts;
    use crate::geometry::ViewSets;
    use crate::testing::{RANGE, World};

    #[test]
    fn every_pixel_has_the_reason_that_comes_first() {
        let world = World::five();
        let map = &mut world.exact()[0];
        let pixels = map.planes.len();
        let mut mask = vec![true; pixels];
        let mut confidence = Confidence {
            cost: vec![0.0; pixels],
            has_texture: vec![true; pixels],
            sources: 4,
            view_sets: ViewSets::full(pixels, 4),
            counts: Counts::default(),
        };
        let mut expected = vec![PixelStatus::Inconsistent; pixels];

        (mask[0], expected[0]) = (false, PixelStatus::Masked);
        map.planes[0].depth = 0.0;
        (map.planes[1].validated, expected[1]) = (true, PixelStatus::Validated);
        (confidence.has_texture[2], expected[2]) = (false, PixelStatus::NoTexture);
        (map.planes[3].depth, expected[3]) = (RANGE.near as f32, PixelStatus::OutOfRange);
        (map.planes[4].depth, expected[4]) = (RANGE.far as f32, PixelStatus::OutOfRange);
        (map.planes[5].depth, expected[5]) = (RANGE.far as f32 * 0.99, PixelStatus::Inconsistent);
        (map.planes[6].depth, expected[6]) = (0.0, PixelStatus::NoSources);
        let mut sets = ViewSets::empty(pixels, 4);
        for pixel in 0..pixels {
            (0..if pixel == 7 { 1 } else { 2 }).for_each(|source| sets.insert(pixel, source));
        }
        (confidence.view_sets, expected[7]) = (sets, PixelStatus::NoSources);
        // Validated takes precedence over all reasons.
        (map.planes[8].validated, expected[8]) = (true, PixelStatus::Validated);
        confidence.has_texture[8] = false;

        let view = ScaledView {
            camera: world.cameras[0],
            mask: Some(mask.into()),
            range: RANGE,
            likely_range: RANGE,
        };
        assert_eq!(classify(&view, &map.planes, &confidence, 2), expected);
        // With a single source no pixel can be validated, for this reason.
        map.planes.iter_mut().for_each(|plane| plane.validated = false);
        let alone = classify(&view, &map.planes, &Confidence { sources: 1, ..confidence }, 2);
        assert!(alone[0] == PixelStatus::Masked && alone[1..].iter().all(|&o| o == PixelStatus::NoSources));
    }
}
