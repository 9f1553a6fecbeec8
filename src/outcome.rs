//! The reason for every pixel without a validated solution, so that an empty cloud explains itself.

use crate::ambc::Assessment;
use crate::image::ScaledView;
use crate::maps::Outcome;
use crate::state::ViewState;

/// A solution this close to an end of the depth range was stopped by it.
const AT_RANGE_END: f32 = 1e-3;

/// What became of each pixel of a view with this many source views.
pub fn outcomes(
    view: &ScaledView,
    state: &ViewState,
    assessment: &Assessment,
    sources: usize,
) -> Vec<Outcome> {
    let (near, far) = (view.range.near as f32, view.range.far as f32);
    let outcome = |pixel: usize| {
        let solution = &state.solutions[pixel];
        if view.mask.as_ref().is_some_and(|mask| !mask[pixel]) {
            Outcome::Masked
        } else if solution.validated {
            Outcome::Validated
        } else if sources < 2 || solution.depth <= 0.0 {
            Outcome::NoSources
        } else if !assessment.textured[pixel] {
            Outcome::NoTexture
        } else if assessment.sets.count(pixel) < 2 {
            Outcome::NoSources
        } else if solution.depth < near * (1.0 + AT_RANGE_END) || solution.depth > far * (1.0 - AT_RANGE_END)
        {
            Outcome::OutOfRange
        } else {
            Outcome::Inconsistent
        }
    };
    (0..state.solutions.len()).map(outcome).collect()
}
