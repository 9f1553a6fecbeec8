//! What filling promises.

use super::*;
use crate::ambc::Random;
use crate::geometry::Camera;
use crate::image::{PackedImage, Picture};
use crate::testing::{self, World};
use glam::Vec3;

const SIZE: (u32, u32) = (60, 48);
const WIDTH: usize = SIZE.0 as usize;
const PIXELS: usize = WIDTH * SIZE.1 as usize;

/// The wall seen by one camera; the pixels of a hole have wrong planes that are not validated.
struct Holed {
    world: World,
    planes: Vec<FoodSource>,
    weak: Vec<bool>,
}

fn holed(is_hole: impl Fn(i32, i32) -> bool) -> Holed {
    let world = World::new(&[0.0], SIZE);
    let weak: Vec<bool> = (0..PIXELS).map(|pixel| is_hole(column(pixel), row(pixel))).collect();
    let plane = |pixel: usize| match weak[pixel] {
        true => FoodSource { cost: 2.0, ..FoodSource::new(3.0, Vec3::NEG_Z) },
        false => FoodSource { validated: true, cost: 0.1, ..exact(&world, pixel) },
    };
    Holed { planes: (0..PIXELS).map(plane).collect(), world, weak }
}

fn exact(world: &World, pixel: usize) -> FoodSource {
    FoodSource::new(testing::depth(&world.cameras[0], pixel), testing::normal(&world.cameras[0]))
}

fn column(pixel: usize) -> i32 {
    (pixel % WIDTH) as i32
}

fn row(pixel: usize) -> i32 {
    (pixel / WIDTH) as i32
}

fn is_in_disc(x: i32, y: i32) -> bool {
    (x - 30).pow(2) + (y - 24).pow(2) <= 100
}

impl Holed {
    /// Fills, and checks that what is not filled is as it was.
    fn fill(&mut self) -> Vec<usize> {
        let before = self.planes.clone();
        let mut filled = fill(&self.world.problem(), &mut self.planes, &self.weak);
        filled.sort_unstable();
        for (pixel, before) in before.iter().enumerate() {
            assert_eq!(self.planes[pixel].cost, before.cost, "filling does not match");
            match filled.binary_search(&pixel) {
                Ok(_) => assert!(self.weak[pixel] && !before.validated && before.depth > 0.0),
                Err(_) => assert_eq!(self.planes[pixel], *before),
            }
        }
        filled
    }

    fn hole(&self) -> Vec<usize> {
        (0..PIXELS).filter(|&pixel| self.weak[pixel]).collect()
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
fn a_hole_is_filled_with_the_plane_around_it() {
    let mut holed = holed(is_in_disc);
    let filled = holed.fill();
    assert_eq!(filled, holed.hole());
    holed.assert_on_the_wall(&filled);
}

#[test]
fn each_part_is_filled_by_itself() {
    let mut holed = holed(|x, y| (x - 15).pow(2) + (y - 24).pow(2) <= 60 || (41..52).contains(&x) && y > 30);
    for pixel in (0..PIXELS).filter(|&pixel| column(pixel) > 30) {
        holed.planes[pixel].depth *= 1.3;
    }
    let filled = holed.fill();
    assert_eq!(filled, holed.hole());
    let left: Vec<usize> = filled.iter().copied().filter(|&pixel| column(pixel) < 30).collect();
    holed.assert_on_the_wall(&left);
    let mut right: Vec<usize> = filled.into_iter().filter(|&pixel| column(pixel) > 30).collect();
    right.retain(|&pixel| (holed.planes[pixel].depth / exact(&holed.world, pixel).depth - 1.3).abs() > 1e-3);
    assert_eq!(right, []);
}

#[test]
fn something_before_a_third_of_the_rim_does_not_spoil_it() {
    let mut holed = holed(is_in_disc);
    for pixel in 0..PIXELS {
        let (x, y) = (f64::from(column(pixel) - 30), f64::from(row(pixel) - 24));
        if !holed.weak[pixel] && x > 0.5 * x.hypot(y) {
            holed.planes[pixel].depth *= 0.8;
        }
    }
    let filled = holed.fill();
    assert_eq!(filled, holed.hole());
    holed.assert_on_the_wall(&filled);
}

#[test]
fn a_hole_at_the_border_is_filled_unless_it_is_framed_too_little() {
    let mut framed = holed(|x, y| (16..45).contains(&x) && y >= 30);
    let filled = framed.fill();
    assert_eq!(filled, framed.hole());
    framed.assert_on_the_wall(&filled);
    assert_eq!(holed(|_, y| y < 8).fill(), [], "a sky");
    assert_eq!(holed(|_, y| y >= 12).fill(), []);
    assert_eq!(holed(|_, _| true).fill(), [], "nothing is around it");
}

#[test]
fn a_hole_whose_rim_lies_on_no_common_plane_stays() {
    let mut holed = holed(is_in_disc);
    for pixel in (0..PIXELS).filter(|&pixel| !is_in_disc(column(pixel), row(pixel))) {
        let (x, y) = ((column(pixel) - 30) as f32, (row(pixel) - 24) as f32);
        holed.planes[pixel].depth *= 1.0 + 0.05 * (4.0 * y.atan2(x)).sin();
    }
    assert_eq!(holed.fill(), []);
}

#[test]
fn pixels_that_can_be_matched_are_validated_or_masked_stay() {
    let mut holed = holed(is_in_disc);
    let hole = holed.hole();
    let at = |x: usize, y: usize| y * WIDTH + x;
    // Not validated, but matched; validated, but weak; left out by a mask.
    let (matched, validated, masked) = (at(30, 24), at(27, 22), at(33, 26));
    holed.weak[matched] = false;
    holed.planes[validated] = FoodSource { validated: true, ..exact(&holed.world, validated) };
    holed.planes[masked] = FoodSource::new(0.0, Vec3::ZERO);
    let filled = holed.fill();
    let rest = hole.into_iter().filter(|pixel| ![matched, validated, masked].contains(pixel));
    assert_eq!(filled, rest.collect::<Vec<_>>());
    holed.assert_on_the_wall(&filled);
    holed.weak.fill(false);
    filled.iter().for_each(|&pixel| holed.planes[pixel].validated = false);
    assert_eq!(holed.fill(), []);
}

#[test]
fn a_pixel_whose_plane_leaves_the_depth_range_stays() {
    let mut holed = holed(is_in_disc);
    let depths = holed.hole().into_iter().map(|pixel| exact(&holed.world, pixel).depth);
    let far = depths.clone().fold(0.0, f32::max) - 0.1;
    let count = depths.filter(|&depth| depth <= far).count();
    let mut problem = holed.world.problem();
    problem.range.far = far;
    let filled = fill(&problem, &mut holed.planes, &holed.weak);
    assert!(filled.len() < holed.hole().len() && filled.len().abs_diff(count) <= 1);
    assert!(filled.iter().all(|&pixel| holed.planes[pixel].depth <= far));
}

/// A bright panel that shows nothing but noise, well before the wall and parallel to the first image.
const PANEL_DEPTH: f64 = 2.5;
const PANEL_SIZE: (u32, u32) = (128, 96);

fn is_on_panel(x: f64, y: f64) -> bool {
    (x - 64.0).abs() < 36.0 && (y - 48.0).abs() < 28.0
}

/// The gray value of the panel or the wall behind it at a pixel.
fn panel_gray(first: &Camera, camera: &Camera, pixel: usize) -> f32 {
    let center = camera.unproject(testing::place(camera, pixel), 0.0);
    let on_wall = camera.unproject(testing::place(camera, pixel), f64::from(testing::depth(camera, pixel)));
    let on_plane = center + (on_wall - center) * ((PANEL_DEPTH - center.z) / (on_wall.z - center.z));
    match first.project(on_plane) {
        Some((place, _)) if is_on_panel(place.x, place.y) => 150.0,
        _ => f32::from(testing::gray(on_wall)),
    }
}

/// The panel before the wall, in these views; its outermost pixels are validated, by what their windows show of the wall,
/// as the wall on three sides and as the panel on the fourth.
fn fill_panel(places: &[f64]) -> Vec<FoodSource> {
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
    let weak = |x: f64, y: f64| is_on_panel(1.2 * x - 12.8, 1.25 * y - 12.0);
    let (mut planes, mut is_weak) = (Vec::new(), Vec::new());
    for pixel in 0..world.cameras[0].pixels() {
        let at = testing::place(&world.cameras[0], pixel);
        is_weak.push(weak(at.x, at.y));
        planes.push(match (is_on_panel(at.x, at.y), weak(at.x, at.y), at.y > 70.0) {
            (true, true, _) => FoodSource { cost: 2.0, ..FoodSource::new(3.0, Vec3::NEG_Z) },
            (true, false, true) => panel(),
            _ => FoodSource { validated: true, cost: 0.1, ..exact(&world, pixel) },
        });
    }
    fill(&world.problem(), &mut planes, &is_weak);
    planes
}

fn panel() -> FoodSource {
    FoodSource { validated: true, cost: 0.1, ..FoodSource::new(PANEL_DEPTH as f32, Vec3::NEG_Z) }
}

/// Share of the panel that lies on it.
fn share_on_panel(planes: &[FoodSource]) -> f64 {
    let width = PANEL_SIZE.0 as usize;
    let on_panel = |&pixel: &usize| is_on_panel((pixel % width) as f64, (pixel / width) as f64);
    let all: Vec<usize> = (0..planes.len()).filter(on_panel).collect();
    let right = |&&pixel: &&usize| {
        (f64::from(planes[pixel].depth) / PANEL_DEPTH - 1.0).abs() < 2e-3 && planes[pixel].validated
    };
    all.iter().filter(right).count() as f64 / all.len() as f64
}

#[test]
fn the_plane_by_which_a_part_looks_the_same_in_the_sources_is_taken_against_most_of_what_is_around() {
    let found = share_on_panel(&fill_panel(&[0.0, 0.8, -0.8, 1.4, -1.4]));
    assert!(found > 0.94, "{found} of the panel is filled with its plane");
    // A view alone has nothing but the surroundings to tell by.
    let alone = share_on_panel(&fill_panel(&[0.0]));
    assert!(alone < 0.1, "{alone}");
}
