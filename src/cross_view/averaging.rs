//! Averaging between views, beyond the paper: the same surface is found in every view by itself, with errors of its own.
//! Each validated plane is averaged with those that the source views found of the same surface.

use crate::geometry::MIN_FACING;
use crate::matching::{Problem, SourceProjector};
use crate::scene::PixelEstimate;
use crate::simd::{Simd, SimdLevel, Task, dispatch};
use glam::Vec3;
use rayon::prelude::*;

/// Relative difference of inverse depths up to which a source view found the same surface. What it found counts the less
/// the more it differs, by Tukey's biweight.
const SAME: f32 = 0.01;

/// Averages the validated solutions of a view whose sources show theirs; planes that would leave the depth range or turn
/// away stay.
pub fn average(level: SimdLevel, problem: &Problem, solutions: &mut [PixelEstimate]) {
    dispatch(level, AverageTask { problem, solutions });
}

struct AverageTask<'a> {
    problem: &'a Problem<'a>,
    solutions: &'a mut [PixelEstimate],
}

impl Task for AverageTask<'_> {
    type Output = ();

    fn run<S: Simd>(self, simd: S) {
        let AverageTask { problem, solutions } = self;
        let rows = solutions.par_chunks_mut(problem.image.width).enumerate();
        rows.for_each(|(y, row)| {
            simd.vectorize(
                #[inline(always)]
                || {
                    let mut projector = SourceProjector::with_all_sources(simd, problem);
                    for (x, solution) in row.iter_mut().enumerate().filter(|(_, own)| own.validated) {
                        let (x, y) = (x as f32, y as f32);
                        projector.set_pixel(x, y);
                        average_pixel(simd, problem, &projector, problem.ray(x, y), solution);
                    }
                },
            );
        });
    }
}

/// Averages the solution of the pixel at which the sources are projections.
#[inline(always)]
fn average_pixel<S: Simd>(
    simd: S,
    problem: &Problem,
    projector: &SourceProjector<'_, S>,
    ray: Vec3,
    solution: &mut PixelEstimate,
) {
    let own = 1.0 / solution.depth;
    let zero = simd.splat(0.0);
    let (mut weights, mut inverse_depths, mut normals) = (zero, zero, [zero; 3]);
    for group in projector.groups() {
        let projections = group.project(simd, solution.depth);
        let found = group.transfer_planes(simd, &projections);
        let off = simd.sub(simd.mul(found.inverse_depth, simd.splat(solution.depth)), simd.splat(1.0));
        let share = simd.mul(off, simd.splat(1.0 / SAME));
        let left = simd.sub(simd.splat(1.0), simd.mul(share, share));
        let same = projections.inside & found.known & simd.simd_ge(left, simd.splat(f32::MIN_POSITIVE));
        if same == 0 {
            continue;
        }
        // Numbers also in the lanes that count for nothing.
        let weight = simd.select(same, simd.mul(left, left), zero);
        let inverse_depth = simd.select(same, found.inverse_depth, simd.splat(own));
        weights = simd.add(weights, weight);
        inverse_depths = simd.mul_add(weight, inverse_depth, inverse_depths);
        let slopes = [simd.select(same, found.slope_x, zero), simd.select(same, found.slope_y, zero)];
        let normal = facing_normals(simd, problem, ray, inverse_depth, slopes);
        for (sum, axis) in normals.iter_mut().zip(normal) {
            *sum = simd.mul_add(weight, axis, *sum);
        }
    }
    let weights = 1.0 + simd.reduce_sum(weights);
    let depth = weights / (own + simd.reduce_sum(inverse_depths));
    let [x, y, z] = normals;
    let normal = solution.normal + Vec3::new(simd.reduce_sum(x), simd.reduce_sum(y), simd.reduce_sum(z));
    let normal = normal.normalize_or_zero();
    let is_in_range = depth >= problem.range.near && depth <= problem.range.far;
    if weights > 1.0 && is_in_range && normal.dot(ray) < -MIN_FACING {
        *solution = PixelEstimate { depth, normal, ..*solution };
    }
}

/// Unit normals of planes about the pixel of a ray, as [`SlantedPlane::depth_and_normal`](crate::matching::SlantedPlane::depth_and_normal)
/// has them.
#[inline(always)]
fn facing_normals<S: Simd>(
    simd: S,
    problem: &Problem,
    ray: Vec3,
    inverse_depth: S::F32,
    [slope_x, slope_y]: [S::F32; 2],
) -> [S::F32; 3] {
    let depth = simd.div(simd.splat(1.0), inverse_depth);
    // The normals over their products with the ray.
    let x = simd.mul(simd.mul(slope_x, depth), simd.splat(1.0 / problem.inverse_focal.0));
    let y = simd.mul(simd.mul(slope_y, depth), simd.splat(1.0 / problem.inverse_focal.1));
    let z = simd.sub(simd.splat(1.0), simd.mul_add(x, simd.splat(ray.x), simd.mul(y, simd.splat(ray.y))));
    let square = simd.mul_add(x, x, simd.mul_add(y, y, simd.mul(z, z)));
    let scale = simd.div(simd.splat(-1.0), simd.sqrt(square));
    [simd.mul(x, scale), simd.mul(y, scale), simd.mul(z, scale)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ambc::Random;
    use crate::scene::PlaneMap;
    use crate::testing::{self, World};

    /// The world with the wall validated in all views, each depth times a factor of its own; the first view's solutions.
    fn spoiled(factor: impl Fn(usize, &mut Random) -> f32) -> (World, Vec<PixelEstimate>) {
        let mut world = World::five();
        let mut maps = world.exact();
        for (view, map) in maps.iter_mut().enumerate() {
            let mut random = Random::new(3, view as u64);
            for solution in &mut map.solutions {
                *solution = PixelEstimate {
                    validated: true,
                    depth: solution.depth * factor(view, &mut random),
                    ..*solution
                };
            }
            map.show(&world.cameras[view]);
        }
        world.surfaces = maps.iter_mut().map(|map| std::mem::take(&mut map.surface)).collect();
        let first: PlaneMap = maps.swap_remove(0);
        (world, first.solutions)
    }

    /// Root mean square of the relative errors of depth.
    fn error(world: &World, solutions: &[PixelEstimate]) -> f32 {
        let off = |(pixel, solution): (usize, &PixelEstimate)| {
            solution.depth / testing::depth(&world.cameras[0], pixel) - 1.0
        };
        let sum: f32 = solutions.iter().enumerate().map(|each| off(each).powi(2)).sum();
        (sum / solutions.len() as f32).sqrt()
    }

    #[test]
    fn exact_depths_stay() {
        let (world, mut solutions) = spoiled(|_, _| 1.0);
        let before = solutions.clone();
        average(SimdLevel::detect(), &world.problem(), &mut solutions);
        for (solution, before) in solutions.iter().zip(&before) {
            assert!((solution.depth / before.depth - 1.0).abs() < 1e-5, "{solution:?} was {before:?}");
            assert!((solution.normal - before.normal).length() < 3e-3, "{solution:?} was {before:?}");
            let PixelEstimate { depth, normal, .. } = *solution;
            assert_eq!(*solution, PixelEstimate { depth, normal, ..*before });
        }
    }

    #[test]
    fn errors_of_five_views_average_out() {
        let (world, mut solutions) = spoiled(|_, random| 1.0 + 0.002 * random.signed());
        let before = error(&world, &solutions);
        average(SimdLevel::detect(), &world.problem(), &mut solutions);
        let after = error(&world, &solutions);
        // One over the square root of five, and what views do not see.
        assert!(after < 0.55 * before, "{before} to {after}");
    }

    #[test]
    fn another_surface_says_nothing_and_what_is_not_validated_stays() {
        let (world, mut solutions) = spoiled(|view, _| if view > 0 { 1.03 } else { 1.001 });
        solutions[100].validated = false;
        let before = solutions.clone();
        average(SimdLevel::detect(), &world.problem(), &mut solutions);
        assert_eq!(solutions, before);
        let (nearer, mut solutions) = spoiled(|view, _| if view > 0 { 1.003 } else { 1.0 });
        solutions[100].validated = false;
        let before = solutions.clone();
        average(SimdLevel::detect(), &nearer.problem(), &mut solutions);
        assert_eq!(solutions[100], before[100]);
        assert!(solutions[101].depth > 1.001 * before[101].depth);
    }

    #[test]
    fn depths_stay_in_the_range() {
        let (world, mut solutions) = spoiled(|view, _| if view > 0 { 1.004 } else { 1.0 });
        let before = solutions.clone();
        let mut problem = world.problem();
        problem.range.far = before.iter().map(|solution| solution.depth).fold(0.0, f32::max);
        average(SimdLevel::detect(), &problem, &mut solutions);
        assert!(solutions.iter().all(|solution| solution.depth <= problem.range.far));
        assert!(solutions.iter().zip(&before).any(|(solution, before)| solution == before));
        assert!(solutions.iter().zip(&before).any(|(solution, before)| solution != before));
    }
}
