//! What a view keeps between cycles: its solutions and what is known of them. Colonies live for one search only.

use crate::geometry::Camera;
use crate::geometry::DepthRange;
use crate::geometry::MIN_FACING;
use crate::geometry::SlantedPlane;
use crate::geometry::ViewSets;
use crate::scene::CompactPlane;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// A pixel's solution.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PixelEstimate {
    /// Depth at the pixel, 0 where there is none.
    pub depth: f32,
    /// Unit normal in the camera frame, facing the camera.
    pub normal: Vec3,
    /// Aggregated cost of the search that found it.
    pub cost: ShortCost,
    /// Source views the last check found consistent with it.
    pub consistent: u8,
    /// Whether that check validated it.
    pub validated: bool,
}

/// A cost in two bytes, since it does no more between searches than rank what views candidate each other: the upper half of
/// an f32's bits, a relative error of 2^-8 at most.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ShortCost(u16);

impl From<f32> for ShortCost {
    fn from(cost: f32) -> ShortCost {
        // To the nearest: what is added carries no number beyond infinity.
        ShortCost((cost.to_bits().saturating_add(0x8000) >> 16) as u16)
    }
}

impl From<ShortCost> for f32 {
    fn from(cost: ShortCost) -> f32 {
        f32::from_bits(u32::from(cost.0) << 16)
    }
}

/// The solutions of one view on one scale.
#[derive(Debug, Clone, Default)]
pub struct PlaneMap {
    /// Row by row.
    pub solutions: Vec<PixelEstimate>,
    /// The view set each was matched with.
    pub sets: ViewSets,
    /// The validated solutions as other views look them up.
    pub surface: Vec<CompactPlane>,
}

impl PlaneMap {
    /// Marks each solution by what the check says of it, and brings the surface up to date.
    pub fn mark(&mut self, camera: &Camera, consistent: &[(u8, bool)]) {
        self.judge(consistent);
        self.show(camera);
    }

    /// Marks each solution by what the check says of it.
    pub fn judge(&mut self, consistent: &[(u8, bool)]) {
        self.solutions.par_iter_mut().zip(consistent).for_each(|(solution, &(count, validated))| {
            (solution.consistent, solution.validated) = (count, validated);
        });
    }

    /// Brings the surface up to date with the solutions.
    pub fn show(&mut self, camera: &Camera) {
        self.surface = shown(camera, &self.solutions);
    }

    /// Number of validated solutions.
    pub fn validated(&self) -> u64 {
        self.solutions.iter().filter(|solution| solution.validated).count() as u64
    }

    /// The map handed up to the next finer scale: each fine pixel gets the plane, cost and view set of its coarse pixel.
    pub fn refined(&self, coarse: &Camera, fine: &Camera, range: DepthRange) -> PlaneMap {
        let (width, coarse_width) = (fine.width as usize, coarse.width as usize);
        let parent = |pixel: usize| {
            let (x, y) = (pixel % width, pixel / width);
            (y / 2).min(coarse.height as usize - 1) * coarse_width + (x / 2).min(coarse_width - 1)
        };
        let refine = |pixel: usize| {
            let (x, y) = (pixel % width, pixel / width);
            let source = parent(pixel);
            let solution = self.solutions[source];
            if solution.depth <= 0.0 {
                return solution;
            }
            let center = DVec2::new((source % coarse_width) as f64, (source / coarse_width) as f64);
            let normal = solution.normal.as_dvec3();
            let on_plane = normal.dot(coarse.ray(center)) * f64::from(solution.depth);
            let ray = fine.ray(DVec2::new(x as f64, y as f64));
            let depth = on_plane / normal.dot(ray);
            let is_usable = depth >= range.near && depth <= range.far;
            PixelEstimate {
                depth: if is_usable { depth as f32 } else { solution.depth },
                normal: facing(normal, ray).as_vec3(),
                ..solution
            }
        };
        let solutions: Vec<PixelEstimate> = (0..fine.pixels()).into_par_iter().map(refine).collect();
        let surface = shown(fine, &solutions);
        let sets = match self.sets.is_clear() {
            true => self.sets.clone(),
            false => self.sets.of((0..fine.pixels()).map(parent)),
        };
        PlaneMap { solutions, sets, surface }
    }
}

/// The normal, turned as little as makes it face the ray: a grazing one may face the coarse pixel's ray alone.
fn facing(normal: DVec3, ray: DVec3) -> DVec3 {
    let away = normal.dot(ray) + f64::from(MIN_FACING);
    if away <= 0.0 { normal } else { (normal - ray * (away / ray.length_squared())).normalize() }
}

fn shown(camera: &Camera, solutions: &[PixelEstimate]) -> Vec<CompactPlane> {
    planes(camera, solutions).map(CompactPlane::from).collect()
}

/// The validated solutions as planes, inverse depth 0 elsewhere.
pub fn surface(camera: &Camera, solutions: &[PixelEstimate]) -> Vec<SlantedPlane> {
    planes(camera, solutions).collect()
}

fn planes(camera: &Camera, solutions: &[PixelEstimate]) -> impl IndexedParallelIterator<Item = SlantedPlane> {
    let width = camera.width as usize;
    let inverse_focal = ((1.0 / camera.fx) as f32, (1.0 / camera.fy) as f32);
    let plane = move |(pixel, solution): (usize, &PixelEstimate)| {
        if !solution.validated {
            return SlantedPlane { inverse_depth: 0.0, slope_x: 0.0, slope_y: 0.0 };
        }
        let ray = camera.ray(DVec2::new((pixel % width) as f64, (pixel / width) as f64)).as_vec3();
        SlantedPlane::new(solution.depth, solution.normal, ray, inverse_focal)
    };
    solutions.par_iter().enumerate().map(plane)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, RANGE};

    #[test]
    fn costs_are_kept_to_a_256th_and_in_their_order() {
        let costs = [0.0, 1e-3, 0.1, 0.101, 0.9, 2.0, 2.3, f32::INFINITY];
        let kept = costs.map(|cost| f32::from(ShortCost::from(cost)));
        assert!(kept.is_sorted());
        for (cost, kept) in costs.into_iter().zip(kept) {
            assert!(kept == cost || (kept - cost).abs() <= cost / 256.0, "{kept} for {cost}");
        }
        assert_eq!(size_of::<PixelEstimate>(), 20, "the cost takes no room of its own");
    }

    #[test]
    fn a_plane_is_handed_up_exactly_also_to_odd_sizes() {
        for size in [(36, 28), (35, 27), (5, 3), (2, 1), (1, 1)] {
            let fine = testing::camera(0.7, size);
            let coarse = fine.halved();
            let refined = testing::exact(&coarse).refined(&coarse, &fine, RANGE);
            assert_eq!(refined.solutions.len(), fine.pixels());
            for (pixel, solution) in refined.solutions.iter().enumerate() {
                let depth = testing::depth(&fine, pixel);
                assert!((solution.depth / depth - 1.0).abs() < 1e-6, "{} instead of {depth}", solution.depth);
                assert_eq!(solution.normal, testing::normal(&fine));
                assert_eq!(solution.consistent, 1);
            }
        }
    }

    #[test]
    fn four_fine_pixels_follow_their_coarse_one() {
        let fine = testing::camera(0.0, (6, 4));
        let coarse = fine.halved();
        let mut map = testing::exact(&coarse);
        let none = 3 + 1;
        map.solutions[none] = PixelEstimate::default();
        map.solutions[none + 1].validated = true;
        let refined = map.refined(&coarse, &fine, RANGE);
        for pixel in 0..24 {
            let parent = pixel / 6 / 2 * 3 + pixel % 6 / 2;
            assert_eq!(refined.solutions[pixel].depth == 0.0, parent == none);
            assert_eq!(refined.solutions[pixel].validated, parent == none + 1);
            assert_eq!(refined.surface[pixel].inverse_depth() > 0.0, parent == none + 1);
        }
    }

    #[test]
    fn a_plane_that_leaves_the_range_between_pixels_keeps_its_depth() {
        let fine = testing::camera(0.0, (6, 4));
        let coarse = fine.halved();
        let map = testing::exact(&coarse);
        let depths = || map.solutions.iter().map(|solution| f64::from(solution.depth));
        // No more than the coarse depths themselves.
        let range = DepthRange { near: depths().fold(f64::MAX, f64::min), far: depths().fold(0.0, f64::max) };
        for solution in map.refined(&coarse, &fine, range).solutions {
            assert!((range.near as f32..=range.far as f32).contains(&solution.depth));
        }
    }

    #[test]
    fn a_normal_that_is_handed_up_faces_the_camera_in_every_fine_pixel() {
        let fine = testing::camera(0.0, (36, 28));
        let coarse = fine.halved();
        let mut map = testing::exact(&coarse);
        let ray = |camera: &Camera, pixel: usize| {
            let width = camera.width as usize;
            camera.ray(DVec2::new((pixel % width) as f64, (pixel / width) as f64))
        };
        for (pixel, solution) in map.solutions.iter_mut().enumerate() {
            let along = ray(&coarse, pixel).cross(DVec3::Y).normalize();
            solution.normal = (along - 1e-4 * ray(&coarse, pixel)).normalize().as_vec3();
        }
        for (pixel, solution) in map.refined(&coarse, &fine, RANGE).solutions.iter().enumerate() {
            assert!(solution.normal.is_normalized());
            assert!(solution.normal.dot(ray(&fine, pixel).as_vec3()) < -0.9 * MIN_FACING);
            assert!((RANGE.near as f32..=RANGE.far as f32).contains(&solution.depth));
        }
    }

    #[test]
    fn marking_shows_the_validated_solutions_to_other_views() {
        let camera = testing::camera(0.0, (6, 4));
        let mut map = testing::exact(&camera);
        let verdicts: Vec<(u8, bool)> = (0..24).map(|pixel| (pixel, pixel % 3 == 0)).collect();
        map.mark(&camera, &verdicts);
        assert_eq!(map.validated(), 8);
        for (pixel, solution) in map.solutions.iter().enumerate() {
            assert_eq!((solution.consistent, solution.validated), verdicts[pixel]);
            let plane = &map.surface[pixel];
            let shown = if pixel % 3 == 0 { 1.0 / solution.depth } else { 0.0 };
            assert_eq!(plane.inverse_depth(), shown);
            if solution.validated && pixel % 6 < 5 {
                let right = 1.0 / (plane.inverse_depth() + plane.slopes().0);
                assert!((right / testing::depth(&camera, pixel + 1) - 1.0).abs() < 1e-5);
            }
        }
    }
}
