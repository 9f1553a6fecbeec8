//! Averaging between views, beyond the paper: the same surface is found in every view by itself, with errors of its own.
//! Each validated plane is averaged with those that the source views found of the same surface.

use crate::ambc::MIN_FACING;
use crate::kernels::SlantedPlane;
use crate::state::Solution;
use crate::views::{Reference, Source};
use glam::Vec3;
use rayon::prelude::*;

/// Relative difference of inverse depths up to which a source view found the same surface.
const SAME: f32 = 0.01;
/// Difference at which what it found counts for 1 / sqrt(e) of the pixel's own.
const SIGMA: f32 = 0.004;

/// Averages the validated solutions of a view whose sources show theirs; planes that would leave the depth range or turn
/// away stay.
pub fn average(reference: &Reference, solutions: &mut [Solution]) {
    let width = reference.image.width;
    solutions.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, solution) in row.iter_mut().enumerate().filter(|(_, solution)| solution.validated) {
            let at = (x as f32, y as f32);
            let ray = reference.ray(at.0, at.1);
            let own = 1.0 / solution.depth;
            let (mut inverse_depth, mut normal, mut weights) = (own, solution.normal, 1.0);
            for source in &reference.sources {
                let Some(found) = found_by(source, at, own) else { continue };
                let off = found.inverse_depth / own - 1.0;
                if off.abs() < SAME {
                    let weight = (-off * off / (2.0 * SIGMA * SIGMA)).exp();
                    inverse_depth += weight * found.inverse_depth;
                    normal += weight * found.depth_and_normal(ray, reference.inverse_focal).1;
                    weights += weight;
                }
            }
            let (depth, normal) = (weights / inverse_depth, normal.normalize_or_zero());
            let is_in_range = depth >= reference.near && depth <= reference.far;
            if weights > 1.0 && is_in_range && normal.dot(ray) < -MIN_FACING {
                *solution = Solution { depth, normal, ..*solution };
            }
        }
    });
}

/// The plane, about a pixel, that a source view found where the pixel's own solution falls.
fn found_by(source: &Source, (x, y): (f32, f32), inverse_depth: f32) -> Option<SlantedPlane> {
    let (pose, start) = (&source.pose, source.pose.at_infinity(x, y));
    let at = source.project(start + pose.epipole * inverse_depth)?;
    let (column, row) = ((at.x + 0.5) as usize, (at.y + 0.5) as usize);
    let plane = source.surface.get(row * source.image.width + column)?;
    let (slope_x, slope_y) = plane.slopes();
    // A pixel at inverse depth w is `start + w epipole` in the source view; its inverse depth there is w over the third
    // coordinate, and on the plane that is linear in the other two over the third.
    let (column, row) = (column as f32, row as f32);
    let along = |point: Vec3| {
        slope_x * (point.x - column * point.z)
            + slope_y * (point.y - row * point.z)
            + plane.inverse_depth() * point.z
    };
    let scale = 1.0 / (1.0 - along(pose.epipole));
    let found = SlantedPlane {
        inverse_depth: along(start) * scale,
        slope_x: along(pose.infinite[0]) * scale,
        slope_y: along(pose.infinite[1]) * scale,
    };
    (plane.inverse_depth() > 0.0 && found.inverse_depth > 0.0).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ambc::Random;
    use crate::state::ViewState;
    use crate::testing::{self, World};

    /// The world with the wall validated in all views, each depth times a factor of its own; the first view's solutions.
    fn spoiled(factor: impl Fn(usize, &mut Random) -> f32) -> (World, Vec<Solution>) {
        let mut world = World::five();
        let mut states = world.exact();
        for (view, state) in states.iter_mut().enumerate() {
            let mut random = Random::new(3, view as u64);
            for solution in &mut state.solutions {
                *solution = Solution {
                    validated: true,
                    depth: solution.depth * factor(view, &mut random),
                    ..*solution
                };
            }
            state.show(&world.cameras[view]);
        }
        world.surfaces = states.iter_mut().map(|state| std::mem::take(&mut state.surface)).collect();
        let first: ViewState = states.swap_remove(0);
        (world, first.solutions)
    }

    /// Root mean square of the relative errors of depth.
    fn error(world: &World, solutions: &[Solution]) -> f32 {
        let off = |(pixel, solution): (usize, &Solution)| {
            solution.depth / testing::depth(&world.cameras[0], pixel) - 1.0
        };
        let sum: f32 = solutions.iter().enumerate().map(|each| off(each).powi(2)).sum();
        (sum / solutions.len() as f32).sqrt()
    }

    #[test]
    fn exact_depths_stay() {
        let (world, mut solutions) = spoiled(|_, _| 1.0);
        let before = solutions.clone();
        average(&world.reference(), &mut solutions);
        for (solution, before) in solutions.iter().zip(&before) {
            assert!((solution.depth / before.depth - 1.0).abs() < 1e-5, "{solution:?} was {before:?}");
            assert!((solution.normal - before.normal).length() < 3e-3, "{solution:?} was {before:?}");
            let Solution { depth, normal, .. } = *solution;
            assert_eq!(*solution, Solution { depth, normal, ..*before });
        }
    }

    #[test]
    fn errors_of_five_views_average_out() {
        let (world, mut solutions) = spoiled(|_, random| 1.0 + 0.002 * random.signed());
        let before = error(&world, &solutions);
        average(&world.reference(), &mut solutions);
        let after = error(&world, &solutions);
        // One over the square root of five, and what views do not see.
        assert!(after < 0.55 * before, "{before} to {after}");
    }

    #[test]
    fn another_surface_says_nothing_and_what_is_not_validated_stays() {
        let (world, mut solutions) = spoiled(|view, _| if view > 0 { 1.03 } else { 1.001 });
        solutions[100].validated = false;
        let before = solutions.clone();
        average(&world.reference(), &mut solutions);
        assert_eq!(solutions, before);
        let (nearer, mut solutions) = spoiled(|view, _| if view > 0 { 1.003 } else { 1.0 });
        solutions[100].validated = false;
        let before = solutions.clone();
        average(&nearer.reference(), &mut solutions);
        assert_eq!(solutions[100], before[100]);
        assert!(solutions[101].depth > 1.001 * before[101].depth);
    }

    #[test]
    fn depths_stay_in_the_range() {
        let (world, mut solutions) = spoiled(|view, _| if view > 0 { 1.004 } else { 1.0 });
        let before = solutions.clone();
        let mut reference = world.reference();
        reference.far = before.iter().map(|solution| solution.depth).fold(0.0, f32::max);
        average(&reference, &mut solutions);
        assert!(solutions.iter().all(|solution| solution.depth <= reference.far));
        assert!(solutions.iter().zip(&before).any(|(solution, before)| solution == before));
        assert!(solutions.iter().zip(&before).any(|(solution, before)| solution != before));
    }
}
