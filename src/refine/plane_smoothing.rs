//! Bilateral smoothing of planes: each validated plane is averaged with the validated planes around it that
//! continue the same surface. Matching windows of neighboring pixels overlap, but their errors of search are
//! independent and average out.
//!
//! Let a neighbor at `(dx, dy)` have the inverse depth `w'`, slopes `s'` and unit normal `n'`, and the pixel
//! `w` and `n`. The neighbor's plane has the inverse depth `p = w' - s'.x dx - s'.y dy` at the pixel, and its
//! weight is
//!
//! ```text
//! exp(-((p - w) / (w DEPTH_SIGMA))^2 / 2 - (1 - n . n') / NORMAL_SCALE
//!     - (difference of gray values / GRAY_SIGMA)^2 / 2 - (dx^2 + dy^2) / (2 SPATIAL_SIGMA^2))
//! ```
//!
//! with `(1 - e / 8)^8` for `exp(-e)`. The new inverse depth is the weighted mean of `p`, the new normal that
//! of `n'`. Reads the validated planes and the gray values; changes depth and normal of validated planes.
//! Each pass visits 12 neighbors of each pixel, for eight pixels of a row at a time.
//!
//! Source: the bilateral filter (Tomasi and Manduchi, 1998), on planes.

use super::{Domain, Filter, FilteredView, marked_pixels};
use crate::geometry::{Border, Offset, PaddedMap, PlaneHypothesis, Position};
use crate::scene::{PixelEstimate, validated_planes};
use crate::simd::{LANES, Simd, Task, dispatch};
use glam::Vec3;
use rayon::prelude::*;

/// Radius of the neighborhood in pixels, about 1.5 `SPATIAL_SIGMA`: neighbors farther away weigh less than a
/// third.
const RADIUS: usize = 4;
/// Spacing of the sampled neighbors along x and y, in pixels: windows of adjacent pixels share most of their
/// samples, so that the neighbors between add work and little information.
const STEP: usize = 2;
/// Relative difference of inverse depths with weight 1 / sqrt(e): above the errors of search, below the steps
/// between surfaces. Chosen on renderings.
const DEPTH_SIGMA: f32 = 0.004;
/// `1 - cos` of the angle between normals with weight 1 / e, 30 degrees: wide, as a window determines its
/// normal far less precisely than its depth.
const NORMAL_SCALE: f32 = 0.134;
/// Difference of gray values (0 to 255) with weight 1 / sqrt(e): several deviations of a photograph's noise.
const GRAY_SIGMA: f32 = 10.0;
/// Distance in pixels with weight 1 / sqrt(e): errors are independent beyond about that distance, as windows
/// no longer share most of their samples.
const SPATIAL_SIGMA: f32 = 2.7;

/// Replaces each validated plane by the bilateral mean of the validated planes around it; planes whose mean
/// is not usable stay.
pub(crate) struct SmoothPlanes {
    /// How many times the planes are smoothed, each time reading the result of the pass before.
    pub passes: u32,
}

impl Filter for SmoothPlanes {
    fn reach(&self) -> Option<usize> {
        Some(self.passes as usize * RADIUS)
    }

    fn domain(&self) -> Domain {
        Domain::Validated
    }

    fn apply(&self, view: &FilteredView, planes: &mut [PixelEstimate]) -> Vec<u32> {
        let mut is_replaced = vec![false; planes.len()];
        for _ in 0..self.passes {
            smooth_once(view, planes, &mut is_replaced);
        }
        marked_pixels(&is_replaced)
    }
}

fn smooth_once(view: &FilteredView, planes: &mut [PixelEstimate], is_replaced: &mut [bool]) {
    let maps = PlaneMaps::new(view, planes);
    dispatch(view.level, SmoothTask { view, maps, planes, is_replaced });
}

/// A pass over all rows.
struct SmoothTask<'a> {
    view: &'a FilteredView<'a>,
    maps: PlaneMaps,
    planes: &'a mut [PixelEstimate],
    is_replaced: &'a mut [bool],
}

impl Task for SmoothTask<'_> {
    type Output = ();

    fn run<S: Simd>(self, simd: S) {
        let SmoothTask { view, maps, planes, is_replaced } = self;
        let width = view.image.width;
        let rows = planes.par_chunks_mut(width).zip(is_replaced.par_chunks_mut(width));
        rows.enumerate().for_each(|(y, (row, is_replaced))| {
            simd.vectorize(
                #[inline(always)]
                || {
                    for left in (0..width).step_by(LANES) {
                        let sums = maps.sum((left, y));
                        for (lane, estimate) in row[left..].iter_mut().take(LANES).enumerate() {
                            let (x, mean) = (left + lane, sums.mean(lane));
                            if estimate.validated && view.is_usable(mean, (x, y)) {
                                (estimate.depth, estimate.normal) = (mean.depth, mean.normal);
                                is_replaced[x] = true;
                            }
                        }
                    }
                },
            );
        });
    }
}

/// The input of a pass by component.
struct PlaneMaps {
    /// 0 where there is no validated plane.
    inverse_depth: PaddedMap,
    slope: [PaddedMap; 2],
    normal: [PaddedMap; 3],
    gray: PaddedMap,
}

/// The weighted sums of adjacent pixels of a row, one in each lane. They are arrays of a known size, not
/// slices, so that the compiler keeps them in vector registers and vectorizes the loops over lanes.
#[derive(Default)]
struct Sums {
    weight: [f32; LANES],
    inverse_depth: [f32; LANES],
    normal: [[f32; LANES]; 3],
}

impl Sums {
    /// The mean plane of a lane; NaN without any weight.
    fn mean(&self, lane: usize) -> PlaneHypothesis {
        let normal = Vec3::from_array(self.normal.map(|component| component[lane]));
        let depth = self.weight[lane] / self.inverse_depth[lane];
        PlaneHypothesis { depth, normal: normal.normalize_or_zero() }
    }
}

impl PlaneMaps {
    fn new(view: &FilteredView, estimates: &[PixelEstimate]) -> PlaneMaps {
        let grid = view.grid();
        let planes = validated_planes(view.camera, estimates);
        let border = Border { width: RADIUS, value: 0.0 };
        let padded = |value: &(dyn Fn(usize) -> f32 + Sync)| PaddedMap::new(grid, border, value);
        PlaneMaps {
            inverse_depth: padded(&|pixel| planes[pixel].inverse_depth),
            slope: [padded(&|pixel| planes[pixel].slope_x), padded(&|pixel| planes[pixel].slope_y)],
            normal: std::array::from_fn(|axis| padded(&|pixel| estimates[pixel].normal[axis])),
            gray: padded(&|pixel| {
                let (x, y) = grid.position(pixel);
                f32::from(view.image.gray(x, y))
            }),
        }
    }

    /// The sums over the neighbors of `LANES` pixels from this one on.
    #[inline(always)]
    fn sum(&self, at: Position) -> Sums {
        let mut sums = Sums::default();
        let radius = RADIUS as i32;
        for dy in (-radius..=radius).step_by(STEP) {
            for dx in (-radius..=radius).step_by(STEP) {
                if dx * dx + dy * dy <= radius * radius + 1 {
                    self.add_neighbors(&mut sums, at, (dx, dy));
                }
            }
        }
        sums
    }

    /// Adds the neighbors at an offset.
    #[inline(always)]
    fn add_neighbors(&self, sums: &mut Sums, at: Position, offset: Offset) {
        let center = self.inverse_depth.lanes(at, (0, 0));
        let [cx, cy, cz] = [0, 1, 2].map(|axis| self.normal[axis].lanes(at, (0, 0)));
        let gray = self.gray.lanes(at, (0, 0));
        let inverse_depth = self.inverse_depth.lanes(at, offset);
        let [slope_x, slope_y] = [0, 1].map(|axis| self.slope[axis].lanes(at, offset));
        let [nx, ny, nz] = [0, 1, 2].map(|axis| self.normal[axis].lanes(at, offset));
        let other_gray = self.gray.lanes(at, offset);
        let (dx, dy) = (offset.0 as f32, offset.1 as f32);
        let distance = (dx * dx + dy * dy) / (2.0 * SPATIAL_SIGMA * SPATIAL_SIGMA);
        for x in 0..LANES {
            let predicted = inverse_depth[x] - slope_x[x] * dx - slope_y[x] * dy;
            // Infinite or NaN where the pixel itself has no validated plane: its sums are not used.
            let depth = (predicted - center[x]) / (center[x] * DEPTH_SIGMA);
            let normal = (1.0 - (nx[x] * cx[x] + ny[x] * cy[x] + nz[x] * cz[x])) * (1.0 / NORMAL_SCALE);
            let color = (other_gray[x] - gray[x]) * (1.0 / GRAY_SIGMA);
            let exponent = 0.5 * (depth * depth + color * color) + normal + distance;
            // exp(-e) as (1 - e / 8)^8: 0 from e = 8 on, and a few multiplications instead of a call.
            let root = 1.0 - exponent * 0.125;
            let root = if root > 0.0 { root } else { 0.0 };
            let root = if inverse_depth[x] > 0.0 { root } else { 0.0 };
            let square = root * root;
            let fourth = square * square;
            let weight = fourth * fourth;
            sums.weight[x] += weight;
            sums.inverse_depth[x] += weight * predicted;
            sums.normal[0][x] += weight * nx[x];
            sums.normal[1][x] += weight * ny[x];
            sums.normal[2][x] += weight * nz[x];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::contract::assert_contract;
    use super::*;
    use crate::ambc::Random;
    use crate::geometry::{Camera, DepthRange, MIN_FACING};
    use crate::image::{PackedImage, Picture};
    use crate::simd::SimdLevel;
    use crate::testing::{self, RANGE};

    const SIZE: (u32, u32) = (44, 36);

    #[test]
    fn keeps_the_contract() {
        assert_contract(|_, _| Box::new(SmoothPlanes { passes: 1 }));
        assert_contract(|_, _| Box::new(SmoothPlanes { passes: 2 }));
    }

    fn camera() -> Camera {
        testing::camera(0.0, SIZE)
    }

    fn is_right(pixel: usize) -> bool {
        testing::place(&camera(), pixel).x > 20.0
    }

    /// The wall, validated everywhere.
    fn wall() -> Vec<PixelEstimate> {
        let validated = |exact: PixelEstimate| PixelEstimate { validated: true, ..exact };
        testing::exact(&camera()).planes.into_iter().map(validated).collect()
    }

    fn smooth(gray: impl Fn(usize) -> u8, range: DepthRange, planes: &mut [PixelEstimate]) {
        let grays = (0..planes.len()).map(gray).collect();
        let image = PackedImage::new(&Picture::from_gray(SIZE.0, SIZE.1, grays).unwrap());
        let view = FilteredView { camera: &camera(), image: &image, range, level: SimdLevel::detect() };
        SmoothPlanes { passes: 1 }.apply(&view, planes);
    }

    fn ray(pixel: usize) -> Vec3 {
        let camera = camera();
        camera.ray(testing::place(&camera, pixel)).as_vec3()
    }

    fn signed(random: &mut Random) -> Vec3 {
        Vec3::new(random.signed(), random.signed(), random.signed())
    }

    fn assert_same_planes(planes: &[PixelEstimate], expected: &[PixelEstimate]) {
        for (plane, expected) in planes.iter().zip(expected) {
            assert!((plane.depth / expected.depth - 1.0).abs() < 1e-5, "{plane:?}, {expected:?}");
            assert!((plane.normal - expected.normal).length() < 1e-5, "{plane:?}, {expected:?}");
        }
    }

    /// Root mean square errors.
    struct Errors {
        /// Relative.
        depth: f32,
        normal: f32,
    }

    fn errors(planes: &[PixelEstimate], truth: &[PixelEstimate]) -> Errors {
        let (mut depth, mut normal) = (0.0, 0.0);
        for (plane, truth) in planes.iter().zip(truth) {
            depth += (plane.depth / truth.depth - 1.0).powi(2);
            normal += (plane.normal - truth.normal).length_squared();
        }
        let count = truth.len() as f32;
        Errors { depth: (depth / count).sqrt(), normal: (normal / count).sqrt() }
    }

    #[test]
    fn independent_errors_of_depth_and_normal_are_halved() {
        let truth = wall();
        let mut planes = truth.clone();
        for (pixel, plane) in planes.iter_mut().enumerate() {
            let mut random = Random::new(3, pixel as u64);
            plane.depth *= 1.0 + 0.003 * random.signed();
            plane.normal = (plane.normal + 0.02 * signed(&mut random)).normalize();
        }
        let before = errors(&planes, &truth);
        smooth(|_| 100, RANGE, &mut planes);
        let after = errors(&planes, &truth);
        assert!(after.depth < 0.5 * before.depth, "depth: {} after {}", after.depth, before.depth);
        assert!(after.normal < 0.5 * before.normal, "normal: {} after {}", after.normal, before.normal);
    }

    #[test]
    fn surfaces_at_different_depths_do_not_mix() {
        let mut truth = wall();
        for (_, plane) in truth.iter_mut().enumerate().filter(|(pixel, _)| is_right(*pixel)) {
            plane.depth *= 1.03;
        }
        let mut planes = truth.clone();
        smooth(|_| 100, RANGE, &mut planes);
        assert_same_planes(&planes, &truth);
    }

    #[test]
    fn neighbors_with_another_gray_value_have_no_weight() {
        let mut planes = wall();
        for (_, plane) in planes.iter_mut().enumerate().filter(|(pixel, _)| is_right(*pixel)) {
            // Close enough to count as the same surface.
            plane.depth *= 1.002;
        }
        let before = planes.clone();
        smooth(|pixel| if is_right(pixel) { 160 } else { 100 }, RANGE, &mut planes);
        assert_same_planes(&planes, &before);
        smooth(|_| 100, RANGE, &mut planes);
        assert!(errors(&planes, &before).depth > 1e-4, "with equal gray values they have");
    }

    #[test]
    fn planes_that_are_not_validated_stay_and_have_no_weight() {
        let mut planes = wall();
        for (pixel, plane) in planes.iter_mut().enumerate().filter(|(pixel, _)| pixel % 3 == 0) {
            plane.validated = false;
            plane.depth *= if pixel % 2 == 0 { 1.001 } else { 0.0 };
        }
        let before = planes.clone();
        smooth(|_| 100, RANGE, &mut planes);
        for (plane, before) in planes.iter().zip(&before).filter(|(_, before)| !before.validated) {
            assert_eq!(plane, before);
        }
        let validated = |planes: &[PixelEstimate]| -> Vec<PixelEstimate> {
            planes.iter().copied().filter(|plane| plane.validated).collect()
        };
        assert_same_planes(&validated(&planes), &validated(&before));
    }

    #[test]
    fn planes_stay_in_the_depth_range_and_keep_facing_the_camera() {
        let range = DepthRange { near: 4.99, far: 5.01 };
        let mut moved = 0;
        for tilt in [0.1, 1.0, 3.0] {
            let mut planes = wall();
            for (pixel, plane) in planes.iter_mut().enumerate() {
                let mut random = Random::new(4, pixel as u64);
                plane.depth = 5.0 + 0.0099 * random.signed();
                let steep = ray(pixel).cross(Vec3::Y).normalize() - 0.03 * ray(pixel).normalize();
                let normal = (steep + tilt * signed(&mut random)).normalize();
                let is_facing = normal.dot(ray(pixel)) < -MIN_FACING;
                plane.normal = if is_facing { normal } else { steep.normalize() };
            }
            let before = planes.clone();
            smooth(|_| 100, range, &mut planes);
            for (pixel, plane) in planes.iter().enumerate() {
                assert!((range.near as f32..=range.far as f32).contains(&plane.depth), "{plane:?}");
                assert!(plane.normal.is_normalized() && plane.normal.dot(ray(pixel)) < -MIN_FACING);
                moved += usize::from(plane.depth != before[pixel].depth);
            }
        }
        assert!(moved > 1000, "{moved} planes moved");
    }
}
