use super::super::contract::assert_contract;
use super::*;
use crate::ambc::Random;
use crate::geometry::Camera;
use crate::image::{PackedImage, Picture};
use crate::simd::SimdLevel;
use crate::testing::{self, RANGE, World};
use glam::Vec3;

const GRID: Grid = Grid { width: 60, height: 48 };
const SIZE: (u32, u32) = (GRID.width as u32, GRID.height as u32);

#[test]
fn keeps_the_contract() {
    assert_contract(|problem, is_textureless| Box::new(FillTextureless { problem, is_textureless }));
}

fn view<'a>(world: &'a World) -> FilteredView<'a> {
    FilteredView {
        camera: &world.cameras[0],
        image: &world.images[0],
        range: RANGE,
        level: SimdLevel::detect(),
    }
}

/// The wall in a single view; the pixels of a hole are textureless and have wrong planes that are not
/// validated.
struct WallWithHole {
    world: World,
    planes: Vec<PixelEstimate>,
    is_textureless: Vec<bool>,
}

fn wall_with_hole(is_hole: impl Fn(i32, i32) -> bool) -> WallWithHole {
    let world = World::new(&[0.0], SIZE);
    let is_textureless: Vec<bool> =
        (0..GRID.pixels()).map(|pixel| is_hole(column(pixel), row(pixel))).collect();
    let plane = |pixel: usize| match is_textureless[pixel] {
        true => wrong(),
        false => exact(&world, pixel),
    };
    WallWithHole { planes: (0..GRID.pixels()).map(plane).collect(), world, is_textureless }
}

fn wrong() -> PixelEstimate {
    PixelEstimate { depth: 3.0, normal: Vec3::NEG_Z, cost: 2.0.into(), ..PixelEstimate::default() }
}

fn exact(world: &World, pixel: usize) -> PixelEstimate {
    let camera = &world.cameras[0];
    PixelEstimate {
        depth: testing::depth(camera, pixel),
        normal: testing::normal(camera),
        cost: 0.1.into(),
        consistent_views: 0,
        validated: true,
    }
}

fn column(pixel: usize) -> i32 {
    GRID.position(pixel).0 as i32
}

fn row(pixel: usize) -> i32 {
    GRID.position(pixel).1 as i32
}

fn is_in_disc(x: i32, y: i32) -> bool {
    (x - 30).pow(2) + (y - 24).pow(2) <= 100
}

impl WallWithHole {
    /// Fills, asserts that only the hole is filled and that costs stay, and returns the filled pixels.
    fn fill(&mut self) -> Vec<usize> {
        let before = self.planes.clone();
        let problem = self.world.problem();
        let filter = FillTextureless { problem: &problem, is_textureless: &self.is_textureless };
        let filled = filter.apply(&view(&self.world), &mut self.planes);
        let filled: Vec<usize> = filled.into_iter().map(|pixel| pixel as usize).collect();
        assert!(filled.iter().all(|&pixel| self.is_textureless[pixel] && !before[pixel].validated));
        for (pixel, before) in before.iter().enumerate() {
            assert_eq!(self.planes[pixel].cost, before.cost, "filled planes are not matched");
            assert!(filled.contains(&pixel) || self.planes[pixel] == *before);
        }
        filled
    }

    fn hole(&self) -> Vec<usize> {
        (0..GRID.pixels()).filter(|&pixel| self.is_textureless[pixel]).collect()
    }

    fn assert_on_the_wall(&self, pixels: &[usize]) {
        for &pixel in pixels {
            let (found, exact) = (&self.planes[pixel], exact(&self.world, pixel));
            assert!(found.validated);
            assert!((found.depth / exact.depth - 1.0).abs() < 1e-4, "{found:?} instead of {exact:?}");
            let sine = found.normal.cross(exact.normal).length();
            assert!(sine < 0.1f32.to_radians().sin(), "{found:?} instead of {exact:?}");
        }
    }
}

#[test]
fn a_hole_gets_the_plane_around_it() {
    let mut wall = wall_with_hole(is_in_disc);
    let filled = wall.fill();
    assert_eq!(filled, wall.hole());
    wall.assert_on_the_wall(&filled);
}

#[test]
fn two_holes_get_planes_of_their_own() {
    let is_hole = |x: i32, y: i32| (x - 15).pow(2) + (y - 24).pow(2) <= 60 || (41..52).contains(&x) && y > 30;
    let mut wall = wall_with_hole(is_hole);
    for pixel in (0..GRID.pixels()).filter(|&pixel| column(pixel) > 30) {
        wall.planes[pixel].depth *= 1.3;
    }
    let filled = wall.fill();
    assert_eq!(filled, wall.hole());
    let (left, right): (Vec<usize>, Vec<usize>) = filled.into_iter().partition(|&pixel| column(pixel) < 30);
    wall.assert_on_the_wall(&left);
    for pixel in right {
        let scale = wall.planes[pixel].depth / exact(&wall.world, pixel).depth;
        assert!((scale - 1.3).abs() <= 1e-3, "{scale} at {pixel}");
    }
}

#[test]
fn another_surface_along_a_third_of_the_rim_changes_nothing() {
    let mut wall = wall_with_hole(is_in_disc);
    for pixel in 0..GRID.pixels() {
        let (x, y) = (f64::from(column(pixel) - 30), f64::from(row(pixel) - 24));
        if !wall.is_textureless[pixel] && x > 0.5 * x.hypot(y) {
            wall.planes[pixel].depth *= 0.8;
        }
    }
    let filled = wall.fill();
    assert_eq!(filled, wall.hole());
    wall.assert_on_the_wall(&filled);
}

#[test]
fn a_hole_at_the_border_is_filled_if_surfaces_surround_enough_of_it() {
    let mut surrounded = wall_with_hole(|x, y| (16..45).contains(&x) && y >= 30);
    let filled = surrounded.fill();
    assert_eq!(filled, surrounded.hole());
    surrounded.assert_on_the_wall(&filled);
    assert!(wall_with_hole(|_, y| y < 8).fill().is_empty(), "a sky");
    assert!(wall_with_hole(|_, y| y >= 12).fill().is_empty());
    assert!(wall_with_hole(|_, _| true).fill().is_empty(), "no surface around it");
}

#[test]
fn a_hole_with_no_common_plane_around_it_stays() {
    let mut wall = wall_with_hole(is_in_disc);
    for pixel in (0..GRID.pixels()).filter(|&pixel| !is_in_disc(column(pixel), row(pixel))) {
        let (x, y) = ((column(pixel) - 30) as f32, (row(pixel) - 24) as f32);
        wall.planes[pixel].depth *= 1.0 + 0.05 * (4.0 * y.atan2(x)).sin();
    }
    assert!(wall.fill().is_empty());
}

#[test]
fn pixels_with_texture_a_validated_plane_or_none_stay() {
    let mut wall = wall_with_hole(is_in_disc);
    let hole = wall.hole();
    let [textured, validated, masked] = [(30, 24), (27, 22), (33, 26)].map(|position| GRID.index(position));
    wall.is_textureless[textured] = false;
    wall.planes[validated] = exact(&wall.world, validated);
    wall.planes[masked] = PixelEstimate::default();
    let filled = wall.fill();
    let rest = hole.into_iter().filter(|pixel| ![textured, validated, masked].contains(pixel));
    assert_eq!(filled, rest.collect::<Vec<_>>());
    wall.assert_on_the_wall(&filled);
    wall.is_textureless.fill(false);
    filled.iter().for_each(|&pixel| wall.planes[pixel].validated = false);
    assert!(wall.fill().is_empty());
}

#[test]
fn pixels_whose_plane_leaves_the_depth_range_stay() {
    let mut wall = wall_with_hole(is_in_disc);
    let depths = wall.hole().into_iter().map(|pixel| exact(&wall.world, pixel).depth);
    let far = depths.clone().fold(0.0, f32::max) - 0.1;
    let count = depths.filter(|&depth| depth <= far).count();
    let mut view = view(&wall.world);
    view.range.far = f64::from(far);
    let problem = wall.world.problem();
    let filter = FillTextureless { problem: &problem, is_textureless: &wall.is_textureless };
    let filled = filter.apply(&view, &mut wall.planes);
    assert!(filled.len() < wall.hole().len() && filled.len().abs_diff(count) <= 1);
    assert!(filled.iter().all(|&pixel| wall.planes[pixel as usize].depth <= far));
}

/// A bright textureless panel with noise, in front of the wall and parallel to the first image.
const PANEL_DEPTH: f64 = 2.5;
const PANEL_GRID: Grid = Grid { width: 128, height: 96 };
const PANEL_SIZE: (u32, u32) = (PANEL_GRID.width as u32, PANEL_GRID.height as u32);

fn is_on_panel(x: f64, y: f64) -> bool {
    (x - 64.0).abs() < 36.0 && (y - 48.0).abs() < 28.0
}

/// Whether the window around a pixel is within the panel.
fn is_inside_panel(x: f64, y: f64) -> bool {
    is_on_panel(1.2 * x - 12.8, 1.25 * y - 12.0)
}

/// Gray value of the panel, or of the wall behind it, at a pixel.
fn panel_gray(first: &Camera, camera: &Camera, pixel: usize) -> f32 {
    let center = camera.unproject(testing::place(camera, pixel), 0.0);
    let on_wall = camera.unproject(testing::place(camera, pixel), f64::from(testing::depth(camera, pixel)));
    let on_plane = center + (on_wall - center) * ((PANEL_DEPTH - center.z) / (on_wall.z - center.z));
    match first.project(on_plane) {
        Some((place, _)) if is_on_panel(place.x, place.y) => 150.0,
        _ => f32::from(testing::gray(on_wall)),
    }
}

/// The panel in front of the wall, seen from these places. Its outermost pixels have validated planes, as
/// their windows match by the wall beside them: those of the wall on three sides and those of the panel on
/// the fourth.
fn fill_panel(places: &[f64]) -> Vec<PixelEstimate> {
    let mut world = World::new(places, PANEL_SIZE);
    for (view, camera) in world.cameras.iter().enumerate() {
        let noisy = |pixel| {
            let noise = testing::white(&mut Random::new(view as u64, pixel as u64));
            (panel_gray(&world.cameras[0], camera, pixel) + 1.5 * noise).round() as u8
        };
        let grays = (0..camera.pixels()).map(noisy).collect();
        world.images[view] =
            PackedImage::new(&Picture::from_gray(PANEL_SIZE.0, PANEL_SIZE.1, grays).unwrap());
    }
    let (mut planes, mut is_textureless) = (Vec::new(), Vec::new());
    for pixel in 0..PANEL_GRID.pixels() {
        let place = testing::place(&world.cameras[0], pixel);
        let is_inside = is_inside_panel(place.x, place.y);
        is_textureless.push(is_inside);
        planes.push(match (is_on_panel(place.x, place.y), is_inside, place.y > 70.0) {
            (true, true, _) => wrong(),
            (true, false, true) => {
                PixelEstimate { depth: PANEL_DEPTH as f32, normal: Vec3::NEG_Z, ..exact(&world, pixel) }
            }
            _ => exact(&world, pixel),
        });
    }
    let problem = world.problem();
    let filter = FillTextureless { problem: &problem, is_textureless: &is_textureless };
    filter.apply(&view(&world), &mut planes);
    planes
}

/// Fraction of the panel's pixels with the panel's plane.
fn fraction_on_panel(planes: &[PixelEstimate]) -> f64 {
    let is_panel = |&pixel: &usize| {
        let (x, y) = PANEL_GRID.position(pixel);
        is_on_panel(x as f64, y as f64)
    };
    let pixels: Vec<usize> = (0..planes.len()).filter(is_panel).collect();
    let is_right = |&&pixel: &&usize| {
        (f64::from(planes[pixel].depth) / PANEL_DEPTH - 1.0).abs() < 2e-3 && planes[pixel].validated
    };
    pixels.iter().filter(is_right).count() as f64 / pixels.len() as f64
}

#[test]
fn the_plane_that_matches_in_the_source_views_wins_over_the_most_frequent_one() {
    let checked = fraction_on_panel(&fill_panel(&[0.0, 0.8, -0.8, 1.4, -1.4]));
    assert!(checked > 0.94, "{checked} of the panel has its plane");
    let unchecked = fraction_on_panel(&fill_panel(&[0.0]));
    assert!(unchecked < 0.1, "{unchecked} without source views, where the most frequent plane wins");
}
