//! The reason for every pixel without a validated solution, so that an empty cloud explains itself.

use crate::ambc::Assessment;
use crate::image::ScaledView;
use crate::maps::Outcome;
use crate::state::Solution;

/// A solution this close to an end of the depth range was stopped by it.
const AT_RANGE_END: f32 = 1e-3;

/// What became of each pixel of a view with this many source views, of which a solution must be seen in `needed`.
pub fn outcomes(
    view: &ScaledView,
    solutions: &[Solution],
    assessment: &Assessment,
    sources: usize,
    needed: usize,
) -> Vec<Outcome> {
    let (near, far) = (view.range.near as f32, view.range.far as f32);
    let outcome = |pixel: usize| {
        let solution = &solutions[pixel];
        if view.mask.as_ref().is_some_and(|mask| !mask[pixel]) {
            Outcome::Masked
        } else if solution.validated {
            Outcome::Validated
        } else if sources < needed || solution.depth <= 0.0 {
            Outcome::NoSources
        } else if !assessment.textured[pixel] {
            Outcome::NoTexture
        } else if assessment.sets.count(pixel) < needed {
            Outcome::NoSources
        } else if solution.depth < near * (1.0 + AT_RANGE_END) || solution.depth > far * (1.0 - AT_RANGE_END)
        {
            Outcome::OutOfRange
        } else {
            Outcome::Inconsistent
        }
    };
    (0..solutions.len()).map(outcome).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::Counts;
    use crate::testing::{RANGE, World};
    use crate::views::ViewSets;

    #[test]
    fn every_pixel_has_the_reason_that_comes_first() {
        let world = World::five();
        let mut states = world.exact();
        let state = &mut states[0];
        let pixels = state.solutions.len();
        let mut mask = vec![true; pixels];
        let mut assessment = Assessment {
            cost: vec![0.0; pixels],
            textured: vec![true; pixels],
            sets: ViewSets::full(pixels, 4),
            counts: Counts::default(),
        };
        let mut expected = vec![Outcome::Inconsistent; pixels];

        (mask[0], expected[0]) = (false, Outcome::Masked);
        state.solutions[0].depth = 0.0;
        (state.solutions[1].validated, expected[1]) = (true, Outcome::Validated);
        (assessment.textured[2], expected[2]) = (false, Outcome::NoTexture);
        (state.solutions[3].depth, expected[3]) = (RANGE.near as f32, Outcome::OutOfRange);
        (state.solutions[4].depth, expected[4]) = (RANGE.far as f32, Outcome::OutOfRange);
        (state.solutions[5].depth, expected[5]) = (RANGE.far as f32 * 0.99, Outcome::Inconsistent);
        (state.solutions[6].depth, expected[6]) = (0.0, Outcome::NoSources);
        let mut sets = ViewSets::empty(pixels, 4);
        for pixel in 0..pixels {
            (0..if pixel == 7 { 1 } else { 2 }).for_each(|source| sets.insert(pixel, source));
        }
        (assessment.sets, expected[7]) = (sets, Outcome::NoSources);
        // Validated is validated, whatever else.
        (state.solutions[8].validated, expected[8]) = (true, Outcome::Validated);
        assessment.textured[8] = false;

        let view = ScaledView {
            camera: world.cameras[0],
            image: world.images[0].clone(),
            mask: Some(mask),
            range: RANGE,
        };
        assert_eq!(outcomes(&view, &state.solutions, &assessment, 4, 2), expected);
        // With a single source no pixel can be validated: that is the reason.
        state.solutions.iter_mut().for_each(|solution| solution.validated = false);
        let lonely = outcomes(&view, &state.solutions, &assessment, 1, 2);
        assert!(lonely[0] == Outcome::Masked && lonely[1..].iter().all(|&o| o == Outcome::NoSources));
    }
}
