//! The contract of [`Filter`], as one test that every filter passes.

use super::{Filter, FilteredView};
use crate::ambc::Random;
use crate::geometry::{Camera, DepthRange, Grid, MIN_FACING, Position, SearchRange};
use crate::image::{PackedImage, Picture};
use crate::matching::Problem;
use crate::parallel::JoinedPool;
use crate::scene::PixelEstimate;
use crate::simd::SimdLevel;
use crate::testing::{self, RANGE};
use glam::Vec3;

/// Makes a filter for a view without source views and with these textureless pixels.
pub(super) type MakeFilter = for<'a> fn(&'a Problem<'a>, &'a [bool]) -> Box<dyn Filter + 'a>;

/// Large enough for an estimate of the image's noise.
const SIZE: Grid = Grid { width: 72, height: 64 };
/// Parts of the image that are filtered by themselves: at a corner, at a border, and inside.
const CROPS: [Rectangle; 3] = [
    Rectangle { left: 0, top: 0, size: Grid { width: 13, height: 11 } },
    Rectangle { left: 52, top: 20, size: Grid { width: 20, height: 9 } },
    Rectangle { left: 29, top: 26, size: Grid { width: 17, height: 15 } },
];

/// Asserts that a filter keeps what the documentation of [`Filter`] promises.
pub(super) fn assert_contract(make: MakeFilter) {
    let mut changed = 0;
    // Depths of the scene are 3.4 to 7: the second range cuts them.
    for range in [RANGE, DepthRange { near: 3.9, far: 5.3 }] {
        for seed in 0..3 {
            let scene = Scene::random(seed, SIZE, range);
            let result = scene.filtered(make);
            scene.assert_valid_result(make, &result);
            scene.assert_independent_of_threads(make, &result);
            CROPS.iter().for_each(|crop| scene.assert_independent_of_distant_pixels(make, &result, crop));
            changed += scene.changed_pixels(&result).len();
        }
    }
    assert!(changed > 50, "no test of a filter that changes {changed} pixels");
    assert_exact_planes_stay(make);
    for (width, height) in [(1, 1), (5, 3), (1, 9), (17, 2)] {
        let small = Scene::random(9, Grid { width, height }, RANGE);
        small.assert_valid_result(make, &small.filtered(make));
    }
    let mut empty = Scene::random(9, SIZE, RANGE);
    empty.planes.fill(PixelEstimate::default());
    assert_eq!(empty.filtered(make).replaced, [0u32; 0]);
}

/// A part of an image.
struct Rectangle {
    left: usize,
    top: usize,
    size: Grid,
}

impl Rectangle {
    /// With a margin on all sides as far as there are pixels.
    fn expanded(&self, margin: usize) -> Rectangle {
        let (left, top) = (self.left.saturating_sub(margin), self.top.saturating_sub(margin));
        let right = (self.left + self.size.width + margin).min(SIZE.width);
        let bottom = (self.top + self.size.height + margin).min(SIZE.height);
        Rectangle { left, top, size: Grid { width: right - left, height: bottom - top } }
    }

    fn positions(&self) -> impl Iterator<Item = Position> + '_ {
        (0..self.size.pixels()).map(|pixel| {
            let (x, y) = self.size.position(pixel);
            (self.left + x, self.top + y)
        })
    }
}

/// What a filter returns and leaves.
struct Filtered {
    replaced: Vec<u32>,
    planes: Vec<PixelEstimate>,
}

/// A strip before a slanted wall, with errors of search, outliers, pixels without a plane, a fattened edge,
/// and textureless discs without validated planes.
struct Scene {
    grid: Grid,
    camera: Camera,
    range: DepthRange,
    grays: Vec<u8>,
    planes: Vec<PixelEstimate>,
    is_textureless: Vec<bool>,
}

/// Whether a position is in one of some discs, each of which covers another surface or an edge.
fn is_in_disc((x, y): Position) -> bool {
    let distance = |cx: f64, cy: f64| (x as f64 - cx).hypot(y as f64 - cy);
    distance(13.0, 15.0) < 6.0 || distance(40.0, 44.0) < 8.0 || distance(57.0, 16.0) < 7.0
}

impl Scene {
    fn random(seed: u64, grid: Grid, range: DepthRange) -> Scene {
        let camera = testing::camera(0.0, (grid.width as u32, grid.height as u32));
        let mut scene =
            Scene { grid, camera, range, grays: Vec::new(), planes: Vec::new(), is_textureless: Vec::new() };
        for pixel in 0..grid.pixels() {
            let (x, y) = grid.position(pixel);
            let mut random = Random::new(seed, pixel as u64);
            let is_textureless = is_in_disc((x, y));
            let surface_gray = if (24..36).contains(&x) { 70.0 } else { 150.0 };
            scene.grays.push((surface_gray + 1.5 * testing::white(&mut random)) as u8);
            scene.is_textureless.push(is_textureless);
            // The strip is too wide by 3 pixels.
            let scale = if (24..39).contains(&x) { 0.8 } else { 1.0 };
            let kind = random.unit();
            scene.planes.push(match is_textureless || kind < 0.1 {
                _ if kind < 0.03 => PixelEstimate::default(),
                true => scene.outlier(pixel, &mut random),
                false => scene.with_error(pixel, scale, &mut random),
            });
        }
        scene
    }

    fn search_range(&self) -> SearchRange {
        self.range.into()
    }

    fn ray(&self, pixel: usize) -> Vec3 {
        self.camera.ray(testing::place(&self.camera, pixel)).as_vec3()
    }

    fn outlier(&self, pixel: usize, random: &mut Random) -> PixelEstimate {
        let depth = self.search_range().clamp(2.0 + 6.0 * random.unit());
        let normal = (random.facing_normal(self.ray(pixel)) - 0.1 * self.ray(pixel)).normalize();
        PixelEstimate { depth, normal, cost: 1.5.into(), consistent_views: 1, validated: false }
    }

    /// A validated plane near the wall, or the wall moved towards the camera.
    fn with_error(&self, pixel: usize, scale: f32, random: &mut Random) -> PixelEstimate {
        let depth = testing::depth(&self.camera, pixel) * scale * (1.0 + 0.001 * random.signed());
        let tilt = 0.02 * Vec3::new(random.signed(), random.signed(), random.signed());
        PixelEstimate {
            depth: self.search_range().clamp(depth),
            normal: (testing::normal(&self.camera) + tilt).normalize(),
            cost: 0.1.into(),
            consistent_views: 4,
            validated: true,
        }
    }

    /// The part of the scene inside a rectangle, as a scene of its own.
    fn crop(&self, rectangle: &Rectangle) -> Scene {
        let pixels: Vec<usize> = rectangle.positions().map(|position| self.grid.index(position)).collect();
        Scene {
            grid: rectangle.size,
            camera: Camera {
                width: rectangle.size.width as u32,
                height: rectangle.size.height as u32,
                cx: self.camera.cx - rectangle.left as f64,
                cy: self.camera.cy - rectangle.top as f64,
                ..self.camera
            },
            range: self.range,
            grays: pixels.iter().map(|&pixel| self.grays[pixel]).collect(),
            planes: pixels.iter().map(|&pixel| self.planes[pixel]).collect(),
            is_textureless: pixels.iter().map(|&pixel| self.is_textureless[pixel]).collect(),
        }
    }

    /// Calls a function with the filter for this scene and its view.
    fn with_filter<R>(&self, make: MakeFilter, call: impl FnOnce(&dyn Filter, &FilteredView) -> R) -> R {
        let (width, height) = (self.camera.width, self.camera.height);
        let image = PackedImage::new(&Picture::from_gray(width, height, self.grays.clone()).unwrap());
        let problem = Problem::new(&self.camera, &image, self.range);
        let filter = make(&problem, &self.is_textureless);
        call(
            &*filter,
            &FilteredView {
                camera: &self.camera,
                image: &image,
                range: self.range,
                level: SimdLevel::detect(),
            },
        )
    }

    fn filtered(&self, make: MakeFilter) -> Filtered {
        let mut planes = self.planes.clone();
        let replaced = self.with_filter(make, |filter, view| filter.apply(view, &mut planes));
        Filtered { replaced, planes }
    }

    fn changed_pixels(&self, result: &Filtered) -> Vec<u32> {
        let changed = (0u32..).zip(self.planes.iter().zip(&result.planes));
        changed.filter(|(_, (before, after))| bits(before) != bits(after)).map(|(pixel, _)| pixel).collect()
    }

    /// Only planes of the domain are replaced, all of them are returned, and the new ones are usable.
    fn assert_valid_result(&self, make: MakeFilter, result: &Filtered) {
        let domain = self.with_filter(make, |filter, _| filter.domain());
        assert!(result.replaced.is_sorted_by(|one, next| one < next), "ascending, each once");
        for &pixel in &result.replaced {
            let pixel = pixel as usize;
            assert!(domain.includes(&self.planes[pixel]), "{pixel}: {:?}", self.planes[pixel]);
            let PixelEstimate { depth, normal, .. } = result.planes[pixel];
            assert!(self.search_range().contains(depth), "{pixel}: depth {depth}");
            // The ray of a filter may be rounded differently.
            assert!(normal.dot(self.ray(pixel)) < -0.999 * MIN_FACING, "{pixel}: normal {normal}");
            assert!((normal.length() - 1.0).abs() < 1e-5, "{pixel}: normal {normal}");
        }
        for pixel in self.changed_pixels(result) {
            assert!(result.replaced.binary_search(&pixel).is_ok(), "{pixel} changed and is not returned");
        }
    }

    fn assert_independent_of_threads(&self, make: MakeFilter, result: &Filtered) {
        for threads in [1, 3] {
            let other = JoinedPool::new(threads).unwrap().install(|| self.filtered(make));
            assert_eq!(other.replaced, result.replaced, "{threads} threads");
            assert!(other.planes.iter().map(bits).eq(result.planes.iter().map(bits)), "{threads} threads");
        }
    }

    /// Inside a rectangle the result is the same if only the pixels within the reach of it are there.
    fn assert_independent_of_distant_pixels(&self, make: MakeFilter, result: &Filtered, inner: &Rectangle) {
        let Some(reach) = self.with_filter(make, |filter, _| filter.reach()) else { return };
        let outer = inner.expanded(reach);
        let cropped = self.crop(&outer).filtered(make);
        for (x, y) in inner.positions() {
            let pixel = self.grid.index((x, y));
            let cropped_pixel = outer.size.index((x - outer.left, y - outer.top));
            let (whole, part) = (&result.planes[pixel], &cropped.planes[cropped_pixel]);
            assert_eq!(bits(whole), bits(part), "({x}, {y}): {whole:?} and, cropped, {part:?}");
            let is_replaced = |pixels: &[u32], pixel: usize| pixels.binary_search(&(pixel as u32)).is_ok();
            assert_eq!(
                is_replaced(&result.replaced, pixel),
                is_replaced(&cropped.replaced, cropped_pixel),
                "({x}, {y})"
            );
        }
    }
}

/// The exact wall, some of it not validated, stays up to rounding.
fn assert_exact_planes_stay(make: MakeFilter) {
    let mut scene = Scene::random(0, SIZE, RANGE);
    scene.planes = testing::exact(&scene.camera).planes;
    for (pixel, plane) in scene.planes.iter_mut().enumerate() {
        let mut random = Random::new(1, pixel as u64);
        plane.validated = !scene.is_textureless[pixel] && random.unit() < 0.9;
    }
    let result = scene.filtered(make);
    for (after, before) in result.planes.iter().zip(&scene.planes) {
        assert!((after.depth / before.depth - 1.0).abs() < 1e-5, "{after:?} instead of {before:?}");
        assert!((after.normal - before.normal).length() < 1e-5, "{after:?} instead of {before:?}");
    }
}

/// The parts of an estimate as they can be compared to the bit.
fn bits(estimate: &PixelEstimate) -> ([u32; 5], u8, bool) {
    let PixelEstimate { depth, normal, cost, consistent_views, validated } = *estimate;
    let floats = [depth, normal.x, normal.y, normal.z, cost.into()].map(f32::to_bits);
    (floats, consistent_views, validated)
}
