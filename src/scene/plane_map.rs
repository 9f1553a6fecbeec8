//! The planes estimated for the pixels of one view on one scale.

use super::CompactPlane;
use crate::geometry::{Camera, DepthRange, Grid, MIN_FACING, SlantedPlane};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// The estimate of a pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct PixelEstimate {
    /// Depth at the pixel, 0 where there is none.
    pub depth: f32,
    /// Unit normal in the camera frame, facing the camera.
    pub normal: Vec3,
    /// Aggregated cost of the search that found the plane.
    pub cost: RankingCost,
    /// Source views that the last check found consistent with the plane, at most 255; 0 before a check.
    pub consistent_views: u8,
    /// Whether that check validated the plane; `false` before a check.
    pub validated: bool,
}

/// A cost in two bytes: between searches it only ranks the planes that views propagate to each other. The
/// upper 16 bits of an f32, a relative error of at most 2^-8.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RankingCost(u16);

impl From<f32> for RankingCost {
    fn from(cost: f32) -> RankingCost {
        // Rounds to nearest; the carry does not go beyond infinity.
        RankingCost((cost.to_bits().saturating_add(0x8000) >> 16) as u16)
    }
}

impl From<RankingCost> for f32 {
    fn from(cost: RankingCost) -> f32 {
        f32::from_bits(u32::from(cost.0) << 16)
    }
}

/// The number of source views consistent with a plane, at most 255, and whether they validate it.
pub(crate) type Verdict = (u8, bool);

/// The planes of all pixels of a view, row by row.
#[derive(Debug, Clone, Default)]
pub(crate) struct PlaneMap {
    /// One for each pixel.
    pub planes: Vec<PixelEstimate>,
}

impl PlaneMap {
    /// Writes the verdicts of a check, one for each pixel.
    pub(crate) fn set_verdicts(&mut self, verdicts: &[Verdict]) {
        self.planes.par_iter_mut().zip(verdicts).for_each(|(plane, &(consistent_views, validated))| {
            (plane.consistent_views, plane.validated) = (consistent_views, validated);
        });
    }

    /// Number of validated planes.
    pub(crate) fn count_validated(&self) -> u64 {
        self.planes.iter().filter(|plane| plane.validated).count() as u64
    }

    /// The validated planes as other views read them, with inverse depth 0 elsewhere.
    pub(crate) fn publish(&self, camera: &Camera) -> Vec<CompactPlane> {
        slanted(camera, &self.planes).map(CompactPlane::from).collect()
    }

    /// The map on the next finer scale: each fine pixel takes the plane, cost and verdict of its coarse
    /// pixel. A plane that leaves the depth range at the fine pixel keeps the depth of the coarse one.
    pub(crate) fn upsample(&self, coarse: &Camera, fine: &Camera, range: DepthRange) -> PlaneMap {
        let (grid, coarse_grid) = (fine.grid(), coarse.grid());
        let refine = |index: usize| {
            let (x, y) = grid.position(index);
            let (coarse_x, coarse_y) =
                ((x / 2).min(coarse_grid.width - 1), (y / 2).min(coarse_grid.height - 1));
            let plane = self.planes[coarse_grid.index((coarse_x, coarse_y))];
            if plane.depth <= 0.0 {
                return plane;
            }
            let center = DVec2::new(coarse_x as f64, coarse_y as f64);
            let normal = plane.normal.as_dvec3();
            let on_plane = normal.dot(coarse.ray(center)) * f64::from(plane.depth);
            let ray = fine.ray(DVec2::new(x as f64, y as f64));
            let depth = on_plane / normal.dot(ray);
            let is_in_range = depth >= range.near && depth <= range.far;
            PixelEstimate {
                depth: if is_in_range { depth as f32 } else { plane.depth },
                normal: turned_to(normal, ray).as_vec3(),
                ..plane
            }
        };
        PlaneMap { planes: (0..grid.pixels()).into_par_iter().map(refine).collect() }
    }
}

/// The normal, changed as little as necessary to face the ray: a grazing one may face the coarse pixel's ray
/// only.
fn turned_to(normal: DVec3, ray: DVec3) -> DVec3 {
    let away = normal.dot(ray) + f64::from(MIN_FACING);
    if away <= 0.0 { normal } else { (normal - ray * (away / ray.length_squared())).normalize() }
}

/// The validated planes as inverse depth about their pixels, with inverse depth 0 elsewhere.
pub(crate) fn validated_planes(camera: &Camera, planes: &[PixelEstimate]) -> Vec<SlantedPlane> {
    slanted(camera, planes).collect()
}

fn slanted(camera: &Camera, planes: &[PixelEstimate]) -> impl IndexedParallelIterator<Item = SlantedPlane> {
    let grid: Grid = camera.grid();
    let inverse_focal = ((1.0 / camera.fx) as f32, (1.0 / camera.fy) as f32);
    let plane = move |(index, plane): (usize, &PixelEstimate)| {
        if !plane.validated {
            return SlantedPlane { inverse_depth: 0.0, slope_x: 0.0, slope_y: 0.0 };
        }
        let (x, y) = grid.position(index);
        let ray = camera.ray(DVec2::new(x as f64, y as f64)).as_vec3();
        SlantedPlane::new(plane.depth, plane.normal, ray, inverse_focal)
    };
    planes.par_iter().enumerate().map(plane)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, RANGE};

    #[test]
    fn costs_are_kept_to_a_256th_and_in_their_order() {
        let costs = [0.0, 1e-3, 0.1, 0.101, 0.9, 2.0, 2.3, f32::INFINITY];
        let kept = costs.map(|cost| f32::from(RankingCost::from(cost)));
        assert!(kept.is_sorted());
        for (cost, kept) in costs.into_iter().zip(kept) {
            assert!(kept == cost || (kept - cost).abs() <= cost / 256.0, "{kept} for {cost}");
        }
        assert_eq!(size_of::<PixelEstimate>(), 20, "the cost fits into the padding");
    }

    #[test]
    fn upsampling_keeps_a_plane_also_at_odd_sizes() {
        for size in [(36, 28), (35, 27), (5, 3), (2, 1), (1, 1)] {
            let fine = testing::camera(0.7, size);
            let coarse = fine.halved();
            let upsampled = testing::exact(&coarse).upsample(&coarse, &fine, RANGE);
            assert_eq!(upsampled.planes.len(), fine.pixels());
            for (pixel, plane) in upsampled.planes.iter().enumerate() {
                let depth = testing::depth(&fine, pixel);
                assert!((plane.depth / depth - 1.0).abs() < 1e-6, "{} instead of {depth}", plane.depth);
                assert_eq!(plane.normal, testing::normal(&fine));
                assert_eq!(plane.consistent_views, 1);
            }
        }
    }

    #[test]
    fn four_fine_pixels_take_the_plane_of_their_coarse_one() {
        let fine = testing::camera(0.0, (6, 4));
        let coarse = fine.halved();
        let mut map = testing::exact(&coarse);
        let none = 3 + 1;
        map.planes[none] = PixelEstimate::default();
        map.planes[none + 1].validated = true;
        let upsampled = map.upsample(&coarse, &fine, RANGE);
        let surface = upsampled.publish(&fine);
        for (pixel, (plane, published)) in upsampled.planes.iter().zip(&surface).enumerate() {
            let parent = pixel / 6 / 2 * 3 + pixel % 6 / 2;
            assert_eq!(plane.depth == 0.0, parent == none);
            assert_eq!(plane.validated, parent == none + 1);
            assert_eq!(published.inverse_depth() > 0.0, parent == none + 1);
        }
    }

    #[test]
    fn a_plane_that_leaves_the_range_between_pixels_keeps_its_depth() {
        let fine = testing::camera(0.0, (6, 4));
        let coarse = fine.halved();
        let map = testing::exact(&coarse);
        let depths = || map.planes.iter().map(|plane| f64::from(plane.depth));
        // Exactly the range of the coarse depths.
        let range = DepthRange { near: depths().fold(f64::MAX, f64::min), far: depths().fold(0.0, f64::max) };
        for plane in map.upsample(&coarse, &fine, range).planes {
            assert!((range.near as f32..=range.far as f32).contains(&plane.depth));
        }
    }

    #[test]
    fn an_upsampled_normal_faces_the_camera_in_every_fine_pixel() {
        let fine = testing::camera(0.0, (36, 28));
        let coarse = fine.halved();
        let mut map = testing::exact(&coarse);
        let ray = |camera: &Camera, pixel: usize| {
            let width = camera.width as usize;
            camera.ray(DVec2::new((pixel % width) as f64, (pixel / width) as f64))
        };
        for (pixel, plane) in map.planes.iter_mut().enumerate() {
            let along = ray(&coarse, pixel).cross(DVec3::Y).normalize();
            plane.normal = (along - 1e-4 * ray(&coarse, pixel)).normalize().as_vec3();
        }
        for (pixel, plane) in map.upsample(&coarse, &fine, RANGE).planes.iter().enumerate() {
            assert!(plane.normal.is_normalized());
            assert!(plane.normal.dot(ray(&fine, pixel).as_vec3()) < -0.9 * MIN_FACING);
            assert!((RANGE.near as f32..=RANGE.far as f32).contains(&plane.depth));
        }
    }

    #[test]
    fn a_map_publishes_its_validated_planes() {
        let camera = testing::camera(0.0, (6, 4));
        let mut map = testing::exact(&camera);
        let verdicts: Vec<(u8, bool)> = (0..24).map(|pixel| (pixel, pixel % 3 == 0)).collect();
        map.set_verdicts(&verdicts);
        assert_eq!(map.count_validated(), 8);
        let surface = map.publish(&camera);
        for (pixel, plane) in map.planes.iter().enumerate() {
            assert_eq!((plane.consistent_views, plane.validated), verdicts[pixel]);
            let published = &surface[pixel];
            let inverse_depth = if pixel % 3 == 0 { 1.0 / plane.depth } else { 0.0 };
            assert_eq!(published.inverse_depth(), inverse_depth);
            if plane.validated && pixel % 6 < 5 {
                let right = 1.0 / (published.inverse_depth() + published.slopes().0);
                assert!((right / testing::depth(&camera, pixel + 1) - 1.0).abs() < 1e-5);
            }
        }
    }
}
