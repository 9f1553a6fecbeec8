//! Smoothing, beyond the paper: each validated plane is averaged with the validated planes around it that continue the
//! same surface. Windows of neighboring pixels share samples but not their errors of search, which average out.

use crate::geometry::Camera;
use crate::geometry::DepthRange;
use crate::geometry::MIN_FACING;
use crate::image::PackedImage;
use crate::refine::stencil::Padded;
use crate::scene::{PixelEstimate, surface};
use glam::{DVec2, Vec3};
use rayon::prelude::*;

/// Half side of the neighborhood and distance between the neighbors that are looked at, in pixels.
const RADIUS: usize = 4;
const STEP: usize = 2;
/// Relative difference of inverse depth at which a neighbor's plane counts for 1 / sqrt(e).
const DEPTH_SIGMA: f32 = 0.004;
/// `1 - cos` of the angle between normals at which it counts for 1 / e: 30 degrees.
const NORMAL_SCALE: f32 = 0.134;
/// Difference of gray values at which it counts for 1 / sqrt(e).
const GRAY_SIGMA: f32 = 10.0;
/// Distance in pixels at which it counts for 1 / sqrt(e).
const SPATIAL_SIGMA: f32 = 2.7;

/// What the neighbors are asked for; planes as inverse depth, 0 where nothing is validated.
struct Surface {
    inverse_depth: Padded,
    slope: [Padded; 2],
    normal: [Padded; 3],
    gray: Padded,
}

/// The weighted sums of a row.
struct Sums {
    weight: Vec<f32>,
    inverse_depth: Vec<f32>,
    normal: [Vec<f32>; 3],
}

/// Smooths the validated solutions of a view; planes that would leave the depth range or turn away stay.
pub fn smooth(camera: &Camera, image: &PackedImage, range: DepthRange, solutions: &mut [PixelEstimate]) {
    let (width, height) = (image.width, image.height);
    let ray = |x: usize, y: usize| camera.ray(DVec2::new(x as f64, y as f64)).as_vec3();
    let surface = {
        let planes = surface(camera, solutions);
        let padded =
            |value: &(dyn Fn(usize) -> f32 + Sync)| Padded::new((width, height), (RADIUS, 0.0), value);
        Surface {
            inverse_depth: padded(&|pixel| planes[pixel].inverse_depth),
            slope: [padded(&|pixel| planes[pixel].slope_x), padded(&|pixel| planes[pixel].slope_y)],
            normal: std::array::from_fn(|axis| padded(&|pixel| solutions[pixel].normal[axis])),
            gray: padded(&|pixel| f32::from(image.gray(pixel % width, pixel / width))),
        }
    };
    solutions.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let sums = surface.sum_row(y, width);
        for (x, solution) in row.iter_mut().enumerate().filter(|(_, solution)| solution.validated) {
            let depth = sums.weight[x] / sums.inverse_depth[x];
            let normal = Vec3::from_array(std::array::from_fn(|axis| sums.normal[axis][x]));
            let normal = normal.normalize_or_zero();
            let in_range = depth >= range.near as f32 && depth <= range.far as f32;
            if in_range && normal.dot(ray(x, y)) < -MIN_FACING {
                (solution.depth, solution.normal) = (depth, normal);
            }
        }
    });
}

impl Surface {
    fn sum_row(&self, y: usize, width: usize) -> Sums {
        let zeros = || vec![0.0; width];
        let mut sums =
            Sums { weight: zeros(), inverse_depth: zeros(), normal: std::array::from_fn(|_| zeros()) };
        let radius = RADIUS as i32;
        for dy in (-radius..=radius).step_by(STEP) {
            for dx in (-radius..=radius).step_by(STEP) {
                if dx * dx + dy * dy <= radius * radius + 1 {
                    self.add(&mut sums, y, (dx, dy));
                }
            }
        }
        sums
    }

    /// Adds what the neighbors at an offset say to the sums of a row.
    fn add(&self, sums: &mut Sums, y: usize, offset: (i32, i32)) {
        let width = sums.weight.len();
        let center = self.inverse_depth.row(y, (0, 0), width);
        let [cx, cy, cz] = [0, 1, 2].map(|axis| self.normal[axis].row(y, (0, 0), width));
        let gray = self.gray.row(y, (0, 0), width);
        let inverse_depth = self.inverse_depth.row(y, offset, width);
        let [slope_x, slope_y] = [0, 1].map(|axis| self.slope[axis].row(y, offset, width));
        let [nx, ny, nz] = [0, 1, 2].map(|axis| self.normal[axis].row(y, offset, width));
        let other_gray = self.gray.row(y, offset, width);
        let (dx, dy) = (offset.0 as f32, offset.1 as f32);
        let far = (dx * dx + dy * dy) / (2.0 * SPATIAL_SIGMA * SPATIAL_SIGMA);
        let [sum_x, sum_y, sum_z] = &mut sums.normal;
        let (weights, depths) = (&mut sums.weight[..width], &mut sums.inverse_depth[..width]);
        let (sum_x, sum_y, sum_z) = (&mut sum_x[..width], &mut sum_y[..width], &mut sum_z[..width]);
        for x in 0..width {
            let predicted = inverse_depth[x] - slope_x[x] * dx - slope_y[x] * dy;
            // Where there is no own plane the sums are not looked at.
            let depth = (predicted - center[x]) / (center[x] * DEPTH_SIGMA);
            let normal = (1.0 - (nx[x] * cx[x] + ny[x] * cy[x] + nz[x] * cz[x])) * (1.0 / NORMAL_SCALE);
            let color = (other_gray[x] - gray[x]) * (1.0 / GRAY_SIGMA);
            let exponent = 0.5 * (depth * depth + color * color) + normal + far;
            // exp, near enough, and 0 from 8 on.
            let root = 1.0 - exponent * 0.125;
            let root = if root > 0.0 { root } else { 0.0 };
            let root = if inverse_depth[x] > 0.0 { root } else { 0.0 };
            let square = root * root;
            let fourth = square * square;
            let weight = fourth * fourth;
            weights[x] += weight;
            depths[x] += weight * predicted;
            sum_x[x] += weight * nx[x];
            sum_y[x] += weight * ny[x];
            sum_z[x] += weight * nz[x];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ambc::Random;
    use crate::image::Picture;
    use crate::testing::{self, RANGE};

    const SIZE: (u32, u32) = (44, 36);

    fn camera() -> Camera {
        testing::camera(0.0, SIZE)
    }

    /// The wall, validated everywhere.
    fn wall() -> Vec<PixelEstimate> {
        let validated = |solution: PixelEstimate| PixelEstimate { validated: true, ..solution };
        testing::exact(&camera()).solutions.into_iter().map(validated).collect()
    }

    fn smooth_gray(range: DepthRange, solutions: &mut [PixelEstimate]) {
        let gray = vec![100; solutions.len()];
        let image = PackedImage::new(&Picture::from_gray(SIZE.0, SIZE.1, gray).unwrap());
        smooth(&camera(), &image, range, solutions);
    }

    fn ray(pixel: usize) -> Vec3 {
        let camera = camera();
        camera.ray(testing::place(&camera, pixel)).as_vec3()
    }

    fn signed(random: &mut Random) -> Vec3 {
        Vec3::new(random.signed(), random.signed(), random.signed())
    }

    fn assert_same_planes(solutions: &[PixelEstimate], expected: &[PixelEstimate]) {
        for (solution, expected) in solutions.iter().zip(expected) {
            assert!((solution.depth / expected.depth - 1.0).abs() < 1e-5, "{solution:?}, {expected:?}");
            assert!((solution.normal - expected.normal).length() < 1e-5, "{solution:?}, {expected:?}");
        }
    }

    /// Root mean square errors of the depth, relative, and of the normal.
    fn errors(solutions: &[PixelEstimate], truth: &[PixelEstimate]) -> (f32, f32) {
        let (mut depth, mut normal) = (0.0, 0.0);
        for (solution, truth) in solutions.iter().zip(truth) {
            depth += (solution.depth / truth.depth - 1.0).powi(2);
            normal += (solution.normal - truth.normal).length_squared();
        }
        ((depth / truth.len() as f32).sqrt(), (normal / truth.len() as f32).sqrt())
    }

    #[test]
    fn an_exact_plane_stays() {
        let mut solutions = wall();
        smooth_gray(RANGE, &mut solutions);
        assert_same_planes(&solutions, &wall());
    }

    #[test]
    fn errors_of_depth_and_normal_average_out() {
        let truth = wall();
        let mut solutions = truth.clone();
        for (pixel, solution) in solutions.iter_mut().enumerate() {
            let mut random = Random::new(3, pixel as u64);
            solution.depth *= 1.0 + 0.003 * random.signed();
            solution.normal = (solution.normal + 0.02 * signed(&mut random)).normalize();
        }
        let before = errors(&solutions, &truth);
        smooth_gray(RANGE, &mut solutions);
        let after = errors(&solutions, &truth);
        assert!(after.0 < 0.5 * before.0, "depths off by {} and before by {}", after.0, before.0);
        assert!(after.1 < 0.5 * before.1, "normals off by {} and before by {}", after.1, before.1);
    }

    #[test]
    fn surfaces_before_each_other_do_not_mix() {
        let mut truth = wall();
        for (pixel, solution) in truth.iter_mut().enumerate() {
            if testing::place(&camera(), pixel).x > 20.0 {
                solution.depth *= 1.03;
            }
        }
        let mut solutions = truth.clone();
        smooth_gray(RANGE, &mut solutions);
        assert_same_planes(&solutions, &truth);
    }

    #[test]
    fn neighbors_of_another_gray_value_do_not_count() {
        let mut solutions = wall();
        let is_right = |pixel: usize| testing::place(&camera(), pixel).x > 20.0;
        for (pixel, solution) in solutions.iter_mut().enumerate() {
            // Near enough to be taken for the same surface.
            solution.depth *= if is_right(pixel) { 1.002 } else { 1.0 };
        }
        let before = solutions.clone();
        let grays = (0..solutions.len()).map(|pixel| if is_right(pixel) { 160 } else { 100 }).collect();
        let image = PackedImage::new(&Picture::from_gray(SIZE.0, SIZE.1, grays).unwrap());
        smooth(&camera(), &image, RANGE, &mut solutions);
        assert_same_planes(&solutions, &before);
        smooth_gray(RANGE, &mut solutions);
        assert!(errors(&solutions, &before).0 > 1e-4, "where they look alike they do");
    }

    #[test]
    fn what_is_not_validated_stays_and_has_no_say() {
        let mut solutions = wall();
        for (pixel, solution) in solutions.iter_mut().enumerate().filter(|(pixel, _)| pixel % 3 == 0) {
            solution.validated = false;
            solution.depth *= if pixel % 2 == 0 { 1.001 } else { 0.0 };
        }
        let before = solutions.clone();
        smooth_gray(RANGE, &mut solutions);
        for (solution, before) in solutions.iter().zip(&before).filter(|(_, before)| !before.validated) {
            assert_eq!((solution.depth, solution.normal), (before.depth, before.normal));
        }
        let validated = |solutions: &[PixelEstimate]| {
            solutions.iter().copied().filter(|s| s.validated).collect::<Vec<_>>()
        };
        assert_same_planes(&validated(&solutions), &validated(&before));
    }

    #[test]
    fn no_plane_leaves_the_depth_range_or_turns_away() {
        let range = DepthRange { near: 4.99, far: 5.01 };
        let mut moved = 0;
        for tilt in [0.1, 1.0, 3.0] {
            let mut solutions = wall();
            for (pixel, solution) in solutions.iter_mut().enumerate() {
                let mut random = Random::new(4, pixel as u64);
                solution.depth = 5.0 + 0.0099 * random.signed();
                let steep = ray(pixel).cross(Vec3::Y).normalize() - 0.03 * ray(pixel).normalize();
                let normal = (steep + tilt * signed(&mut random)).normalize();
                let is_facing = normal.dot(ray(pixel)) < -MIN_FACING;
                solution.normal = if is_facing { normal } else { steep.normalize() };
            }
            let before = solutions.clone();
            smooth_gray(range, &mut solutions);
            for (pixel, solution) in solutions.iter().enumerate() {
                assert!((range.near as f32..=range.far as f32).contains(&solution.depth), "{solution:?}");
                assert!(solution.normal.is_normalized() && solution.normal.dot(ray(pixel)) < -MIN_FACING);
                moved += usize::from(solution.depth != before[pixel].depth);
            }
        }
        assert!(moved > 1000, "{moved} planes moved");
    }
}
