//! Averaging across views, beyond the paper: every view finds a surface with errors of its own. Each
//! validated plane is averaged with those that the source views published of the same surface.
//!
//! ```text
//! 1/d = (1/d_0 + sum w_i / d_i) / (1 + sum w_i)     w_i = (1 - e_i^2)^2 for e_i < 1, else 0 (Tukey)
//! n   = n_0 + sum w_i n_i, normalized               e_i = (d_0 / d_i - 1) / 0.01
//! ```
//!
//! with `d_i`, `n_i` the plane of source view i transferred to the pixel.

use super::DepthTolerance;
use crate::geometry::PlaneHypothesis;
use crate::matching::{Problem, SourceProjector};
use crate::scene::PixelEstimate;
use crate::simd::{Simd, SimdLevel, Task, dispatch};
use glam::Vec3;
use rayon::prelude::*;

/// Averages the validated planes of a view with the published surfaces of its sources; planes whose average
/// is not usable stay. Returns the planes; the others are as they were.
pub(crate) fn average(
    level: SimdLevel,
    problem: &Problem,
    tolerance: DepthTolerance,
    planes: &[PixelEstimate],
) -> Vec<PixelEstimate> {
    let mut averaged = planes.to_vec();
    dispatch(level, AverageTask { problem, tolerance, planes: &mut averaged });
    averaged
}

struct AverageTask<'a> {
    problem: &'a Problem<'a>,
    tolerance: DepthTolerance,
    planes: &'a mut [PixelEstimate],
}

impl Task for AverageTask<'_> {
    type Output = ();

    fn run<S: Simd>(self, simd: S) {
        let AverageTask { problem, tolerance, planes } = self;
        let rows = planes.par_chunks_mut(problem.image.width).enumerate();
        rows.for_each(|(y, row)| {
            simd.vectorize(
                #[inline(always)]
                || {
                    let mut projector = SourceProjector::with_all_sources(simd, problem);
                    for (x, plane) in row.iter_mut().enumerate().filter(|(_, own)| own.validated) {
                        let (x, y) = (x as f32, y as f32);
                        projector.set_pixel(x, y);
                        average_pixel(simd, problem, tolerance, &projector, problem.ray(x, y), plane);
                    }
                },
            );
        });
    }
}

/// Averages the plane of the projector's pixel.
#[inline(always)]
fn average_pixel<S: Simd>(
    simd: S,
    problem: &Problem,
    tolerance: DepthTolerance,
    projector: &SourceProjector<'_, S>,
    ray: Vec3,
    plane: &mut PixelEstimate,
) {
    let own = 1.0 / plane.depth;
    let zero = simd.splat(0.0);
    let (mut weights, mut inverse_depths, mut normals) = (zero, zero, [zero; 3]);
    for group in projector.groups() {
        let projections = group.project(simd, plane.depth);
        let found = group.transfer_planes(simd, &projections);
        let difference = simd.sub(simd.mul(found.inverse_depth, simd.splat(plane.depth)), simd.splat(1.0));
        let parallax = group.parallax(simd, &projections, plane.depth);
        let relative = simd.div(difference, tolerance.relative(simd, parallax));
        let root = simd.sub(simd.splat(1.0), simd.mul(relative, relative));
        let same = projections.inside & found.known & simd.simd_ge(root, simd.splat(f32::MIN_POSITIVE));
        if same == 0 {
            continue;
        }
        // Numbers also in the lanes without weight.
        let weight = simd.select(same, simd.mul(root, root), zero);
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
    let [x, y, z] = normals.map(|axis| simd.reduce_sum(axis));
    let normal = (plane.normal + Vec3::new(x, y, z)).normalize_or_zero();
    if weights > 1.0 && (PlaneHypothesis { depth, normal }).is_usable(ray, &problem.range) {
        *plane = PixelEstimate { depth, normal, ..*plane };
    }
}

/// Unit normals of planes about the pixel of a ray, by the formula of
/// [`SlantedPlane::depth_and_normal`](crate::geometry::SlantedPlane::depth_and_normal).
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
    use crate::options::Options;
    use crate::testing::{self, World};

    /// The world with the wall validated in all views, each depth times a factor of its own; the first view's
    /// planes.
    fn disturbed(factor: impl Fn(usize, &mut Random) -> f32) -> (World, Vec<PixelEstimate>) {
        let mut world = World::five();
        let mut maps = world.exact();
        for (view, map) in maps.iter_mut().enumerate() {
            let mut random = Random::new(3, view as u64);
            for plane in &mut map.planes {
                *plane = PixelEstimate {
                    validated: true,
                    depth: plane.depth * factor(view, &mut random),
                    ..*plane
                };
            }
        }
        world.surfaces = maps.iter().zip(&world.cameras).map(|(map, camera)| map.publish(camera)).collect();
        (world, maps.swap_remove(0).planes)
    }

    fn averaged(problem: &Problem, planes: &[PixelEstimate]) -> Vec<PixelEstimate> {
        let tolerance = DepthTolerance::new(&Options::paper().check, 0.0);
        average(SimdLevel::detect(), problem, tolerance, planes)
    }

    /// Root mean square of the relative errors of depth.
    fn error(world: &World, planes: &[PixelEstimate]) -> f32 {
        let error = |(pixel, plane): (usize, &PixelEstimate)| {
            plane.depth / testing::depth(&world.cameras[0], pixel) - 1.0
        };
        let sum: f32 = planes.iter().enumerate().map(|each| error(each).powi(2)).sum();
        (sum / planes.len() as f32).sqrt()
    }

    #[test]
    fn exact_depths_stay() {
        let (world, before) = disturbed(|_, _| 1.0);
        for (plane, before) in averaged(&world.problem(), &before).iter().zip(&before) {
            assert!((plane.depth / before.depth - 1.0).abs() < 1e-5, "{plane:?} was {before:?}");
            assert!((plane.normal - before.normal).length() < 3e-3, "{plane:?} was {before:?}");
            let PixelEstimate { depth, normal, .. } = *plane;
            assert_eq!(*plane, PixelEstimate { depth, normal, ..*before });
        }
    }

    #[test]
    fn errors_of_five_views_average_out() {
        let (world, planes) = disturbed(|_, random| 1.0 + 0.002 * random.signed());
        let (before, after) = (error(&world, &planes), error(&world, &averaged(&world.problem(), &planes)));
        // One over the square root of five, and what views do not see.
        assert!(after < 0.55 * before, "{before} to {after}");
    }

    #[test]
    fn another_surface_has_no_weight_and_planes_that_are_not_validated_stay() {
        let (world, mut planes) = disturbed(|view, _| if view > 0 { 1.03 } else { 1.001 });
        planes[100].validated = false;
        assert_eq!(averaged(&world.problem(), &planes), planes);
        let (nearer, mut planes) = disturbed(|view, _| if view > 0 { 1.003 } else { 1.0 });
        planes[100].validated = false;
        let after = averaged(&nearer.problem(), &planes);
        assert_eq!(after[100], planes[100]);
        assert!(after[101].depth > 1.001 * planes[101].depth);
    }

    #[test]
    fn depths_stay_in_the_range() {
        let (world, before) = disturbed(|view, _| if view > 0 { 1.004 } else { 1.0 });
        let mut problem = world.problem();
        problem.range.far = before.iter().map(|plane| plane.depth).fold(0.0, f32::max);
        let after = averaged(&problem, &before);
        assert!(after.iter().all(|plane| plane.depth <= problem.range.far));
        assert!(after.iter().zip(&before).any(|(after, before)| after == before));
        assert!(after.iter().zip(&before).any(|(after, before)| after != before));
    }
}
