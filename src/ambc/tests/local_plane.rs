//! Planes fitted to the depths around a pixel.

use super::*;
use crate::ambc::colony::{Colonies, color};
use crate::ambc::local_plane;
use crate::geometry::Grid;
use glam::Vec3;

const TOLERANCE: f32 = 0.01;

/// The neighbors of a pixel with the wall's depth, multiplied by a `factor` of their position, and another
/// normal.
fn depths(world: &World, pixel: (usize, usize), factor: impl Fn(usize, usize) -> f32) -> Colonies {
    let mut colonies = Colonies::new(Grid { width: 36, height: 28 }, 1);
    let others = |&(x, y): &(usize, usize)| color((x, y)) != color(pixel);
    for (x, y) in (0..28).flat_map(|y| (0..36).map(move |x| (x, y))).filter(others) {
        let at = y * colonies.row_len() + x / 2;
        colonies.foods[at] = FoodSource::new(wall(world, (x, y), factor(x, y)).depth, Vec3::NEG_Z);
    }
    colonies
}

/// The wall at a pixel, turned away from it by some 8 degrees.
fn tilted(world: &World, pixel: (usize, usize)) -> FoodSource {
    let exact = wall(world, pixel, 1.0);
    FoodSource { normal: (exact.normal + Vec3::new(0.1, -0.1, 0.0)).normalize(), validated: true, ..exact }
}

#[test]
fn the_depths_around_a_pixel_determine_the_normal() {
    let world = World::five();
    let problem = world.problem();
    for pixel in [PIXEL, (1, 1), (35, 14), (34, 26)] {
        let exact = wall(&world, pixel, 1.0);
        let found = local_plane::fit(
            &problem,
            &depths(&world, pixel, |_, _| 1.0),
            pixel,
            &tilted(&world, pixel),
            0.05,
        );
        let found = found.unwrap_or_else(|| panic!("nothing at {pixel:?}"));
        assert!((found.depth / exact.depth - 1.0).abs() < 1e-5, "{found:?} instead of {exact:?}");
        assert!((found.normal - exact.normal).length() < 1e-4, "{found:?} instead of {exact:?}");
        assert!(found.validated && found.cost == f32::INFINITY, "it is still to be matched");
    }
}

#[test]
fn neighbors_on_another_surface_have_no_weight() {
    let world = World::five();
    let (problem, exact) = (world.problem(), wall(&world, PIXEL, 1.0));
    // To the right lies another surface, and above there is nothing.
    let behind = |x: usize, y: usize| {
        if y < PIXEL.1 - 3 {
            0.0
        } else if x > PIXEL.0 + 1 {
            1.2
        } else {
            1.0
        }
    };
    let found = local_plane::fit(&problem, &depths(&world, PIXEL, behind), PIXEL, &exact, TOLERANCE).unwrap();
    assert!((found.normal - exact.normal).length() < 1e-4, "{found:?} instead of {exact:?}");
}

#[test]
fn errors_of_single_depths_average_out() {
    let world = World::five();
    let (problem, exact) = (world.problem(), wall(&world, PIXEL, 1.0));
    let noisy = |x: usize, y: usize| 1.0 + 2e-3 * ((7 * x + 11 * y) % 5) as f32 - 4e-3;
    let found = local_plane::fit(&problem, &depths(&world, PIXEL, noisy), PIXEL, &exact, TOLERANCE).unwrap();
    assert!((found.depth / exact.depth - 1.0).abs() < 1.5e-3, "{found:?} instead of {exact:?}");
}

#[test]
fn a_few_neighbors_or_a_line_of_them_determine_no_plane() {
    let world = World::five();
    let (problem, exact) = (world.problem(), wall(&world, PIXEL, 1.0));
    let fit = |factor: &dyn Fn(usize, usize) -> f32| {
        local_plane::fit(&problem, &depths(&world, PIXEL, factor), PIXEL, &exact, TOLERANCE)
    };
    let row = |_: usize, y: usize| if y == PIXEL.1 { 1.0 } else { 0.0 };
    assert_eq!(fit(&row), None);
    let corner = |x: usize, y: usize| if x < PIXEL.0 && y < PIXEL.1 { 1.0 } else { 0.0 };
    assert_eq!(fit(&corner), None);
    assert_eq!(fit(&|_, _| 0.0), None);
}
