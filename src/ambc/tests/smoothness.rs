//! What the neighbours of a pixel say of it.

use super::*;
use crate::ambc::colony::Colonies;
use crate::ambc::smoothness::{SmoothnessRules, Surroundings};
use crate::testing::window;

const RULES: SmoothnessRules = SmoothnessRules { weight: 0.1, depth_scale: 0.01, normal_scale: 0.2 };

/// The colonies of the neighbours of a pixel: the wall, its depth multiplied, where `planes` says so.
fn colonies(world: &World, (x, y): (usize, usize), planes: [Option<f32>; 4]) -> Colonies {
    let mut colonies = Colonies::new(36, 28, 2);
    let places = [(x + 1, y), (x.wrapping_sub(1), y), (x, y + 1), (x, y.wrapping_sub(1))];
    for ((x, y), factor) in places.into_iter().zip(planes) {
        if let Some(factor) = factor.filter(|_| x < 36 && y < 28) {
            let best = y * colonies.row_len() + x / 2 * 2;
            colonies.foods[best] = FoodSource { validated: true, ..wall(world, (x, y), factor) };
        }
    }
    colonies
}

fn middle(
    world: &World,
    rules: SmoothnessRules,
    pixel: (usize, usize),
    planes: [Option<f32>; 4],
) -> Option<FoodSource> {
    let reference = world.reference();
    let mut surroundings = Surroundings::new(rules);
    surroundings.look(&reference, &window(), &colonies(world, pixel, planes), pixel);
    surroundings.middle(reference.ray(pixel.0 as f32, pixel.1 as f32))
}

#[test]
fn the_middle_of_neighbours_on_a_plane_is_that_plane() {
    let world = World::five();
    let all = [Some(1.0); 4];
    for (pixel, planes) in [
        (PIXEL, all),
        (PIXEL, [Some(1.0), None, None, Some(1.0)]),
        ((0, 0), all),
        ((35, 27), all),
        ((0, 14), [Some(1.0), Some(1.0), Some(1.0), None]),
    ] {
        let (found, exact) = (middle(&world, RULES, pixel, planes).unwrap(), wall(&world, pixel, 1.0));
        assert!((found.depth / exact.depth - 1.0).abs() < 1e-5, "{found:?} instead of {exact:?}");
        assert!((found.normal - exact.normal).length() < 1e-6, "{found:?} instead of {exact:?}");
        assert!(found.validated && found.cost == f32::INFINITY, "it is still to be matched");
    }
}

#[test]
fn the_middle_lies_between_neighbours_that_differ() {
    let world = World::five();
    let exact = wall(&world, PIXEL, 1.0);
    let found = middle(&world, RULES, PIXEL, [Some(0.99), Some(1.0), None, Some(1.01)]).unwrap();
    let off = found.depth / exact.depth - 1.0;
    assert!(off.abs() < 0.009 && off != 0.0, "{off}");
}

#[test]
fn there_is_no_middle_of_fewer_than_two_validated_neighbours_or_without_smoothness() {
    let world = World::five();
    assert_eq!(middle(&world, RULES, PIXEL, [None; 4]), None);
    assert_eq!(middle(&world, RULES, PIXEL, [None, Some(1.0), None, None]), None);
    let none = SmoothnessRules { weight: 0.0, ..RULES };
    assert_eq!(middle(&world, none, PIXEL, [Some(1.0); 4]), None);

    let reference = world.reference();
    let mut neighbours = colonies(&world, PIXEL, [Some(1.0); 4]);
    neighbours.foods.iter_mut().for_each(|food| food.validated = false);
    let mut surroundings = Surroundings::new(RULES);
    surroundings.look(&reference, &window(), &neighbours, PIXEL);
    assert_eq!(surroundings.middle(reference.ray(PIXEL.0 as f32, PIXEL.1 as f32)), None);
}
