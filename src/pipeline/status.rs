//! The reason for every pixel without a validated solution, so that an empty cloud explains itself.

use crate::ambc::Assessment;
use crate::scene::PixelEstimate;
use crate::scene::PixelStatus;
use crate::scene::ScaledView;

/// A solution this close to an end of the depth range was stopped by it.
const AT_RANGE_END: f32 = 1e-3;

/// What became of each pixel of a view with this many source views, of which a solution must be seen in `needed`.
pub fn classify(
    view: &ScaledView,
    solutions: &[PixelEstimate],
    assessment: &Assessment,
    sources: usize,
    needed: usize,
) -> Vec<PixelStatus> {
    let (near, far) = (view.range.near as f32, view.range.far as f32);
    let status = |pixel: usize| {
        let solution = &solutions[pixel];
        if view.mask.as_ref().is_some_and(|mask| !mask[pixel]) {
            PixelStatus::Masked
        } else if solution.validated {
            PixelStatus::Validated
        } else if sources < needed || solution.depth <= 0.0 {
            PixelStatus::NoSources
        } else if !assessment.textured[pixel] {
            PixelStatus::NoTexture
        } else if assessment.sets.count(pixel) < needed {
            PixelStatus::NoSources
        } else if solution.depth < near * (1.0 + AT_RANGE_END) || solution.depth > far * (1.0 - AT_RANGE_END)
        {
            PixelStatus::OutOfRange
        } else {
            PixelStatus::Inconsistent
        }
    };
    (0..solutions.len()).map(status).collect()
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
        let mut estimates = world.exact();
        let estimate = &mut estimates[0];
        let pixels = estimate.solutions.len();
        let mut mask = vec![true; pixels];
        let mut assessment = Assessment {
            cost: vec![0.0; pixels],
            textured: vec![true; pixels],
            sets: ViewSets::full(pixels, 4),
            counts: Counts::default(),
        };
        let mut expected = vec![PixelStatus::Inconsistent; pixels];

        (mask[0], expected[0]) = (false, PixelStatus::Masked);
        estimate.solutions[0].depth = 0.0;
        (estimate.solutions[1].validated, expected[1]) = (true, PixelStatus::Validated);
        (assessment.textured[2], expected[2]) = (false, PixelStatus::NoTexture);
        (estimate.solutions[3].depth, expected[3]) = (RANGE.near as f32, PixelStatus::OutOfRange);
        (estimate.solutions[4].depth, expected[4]) = (RANGE.far as f32, PixelStatus::OutOfRange);
        (estimate.solutions[5].depth, expected[5]) = (RANGE.far as f32 * 0.99, PixelStatus::Inconsistent);
        (estimate.solutions[6].depth, expected[6]) = (0.0, PixelStatus::NoSources);
        let mut sets = ViewSets::empty(pixels, 4);
        for pixel in 0..pixels {
            (0..if pixel == 7 { 1 } else { 2 }).for_each(|source| sets.insert(pixel, source));
        }
        (assessment.sets, expected[7]) = (sets, PixelStatus::NoSources);
        // Validated is validated, whatever else.
        (estimate.solutions[8].validated, expected[8]) = (true, PixelStatus::Validated);
        assessment.textured[8] = false;

        let view = ScaledView {
            camera: world.cameras[0],
            image: world.images[0].clone(),
            mask: Some(mask),
            range: RANGE,
        };
        assert_eq!(classify(&view, &estimate.solutions, &assessment, 4, 2), expected);
        // With a single source no pixel can be validated: that is the reason.
        estimate.solutions.iter_mut().for_each(|solution| solution.validated = false);
        let lonely = classify(&view, &estimate.solutions, &assessment, 1, 2);
        assert!(lonely[0] == PixelStatus::Masked && lonely[1..].iter().all(|&o| o == PixelStatus::NoSources));
    }
}
