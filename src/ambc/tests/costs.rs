//! Costs of hypotheses over the views of a pixel.

use super::*;
use crate::ambc::food_source::fitness;
use crate::image::{PackedImage, Picture};
use crate::testing::window;

#[test]
fn the_wall_costs_less_than_planes_before_and_behind_it() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    for best_views in [0, 3] {
        let mut evaluator = at_pixel(
            &problem,
            &window,
            &changed(options(), |o| {
                o.cost.best_views = best_views;
            }),
            false,
        );
        let mut cost = |factor| evaluator.cost(&wall(&world, PIXEL, factor), f32::INFINITY);
        let right = cost(1.0);
        assert!(right < 0.03, "{right}");
        for factor in [0.8, 0.9, 0.97, 1.03, 1.1, 1.2] {
            assert!(cost(factor) > right + 0.02, "{factor}: {} and {right}", cost(factor));
        }
    }
}

#[test]
fn a_cost_is_the_sum_over_all_but_one_or_the_mean_of_the_best() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let food = wall(&world, PIXEL, 1.1);
    // Pairs of views give the costs of the single ones: (a + b) / 1.
    let cost_of = |views: &[usize], best_views| {
        let options = changed(options(), |o| {
            o.cost.best_views = best_views;
            o.check.few_views = 0;
        });
        let mut evaluator = at_pixel(&problem, &window, &options, false);
        let mut set = [0];
        views.iter().for_each(|&view| ViewSets::insert_into(&mut set, view));
        evaluator.set_pixel(PIXEL, &set);
        evaluator.cost(&food, f32::INFINITY)
    };
    let pair = |a, b| cost_of(&[a, b], 0);
    let first = (pair(0, 1) + pair(0, 2) - pair(1, 2)) / 2.0;
    let mut single: Vec<f32> =
        (0..4).map(|view| if view == 0 { first } else { pair(0, view) - first }).collect();
    assert!(single.iter().all(|cost| (0.0..=2.0).contains(cost)), "{single:?}");

    let all = cost_of(&[0, 1, 2, 3], 0);
    assert!((all - single.iter().sum::<f32>() / 3.0).abs() < 1e-5);
    single.sort_by(f32::total_cmp);
    for best in 1..=4 {
        let mean = single[..best].iter().sum::<f32>() / best as f32;
        let cost = cost_of(&[0, 1, 2, 3], best as u32);
        assert!((cost - mean).abs() < 1e-5, "the best {best}: {cost} instead of {mean}");
    }
    // More than there are: those there are.
    let cost = cost_of(&[0, 1, 2, 3], 8);
    assert!((cost - single.iter().sum::<f32>() / 4.0).abs() < 1e-5);
    for best_views in [0, 1] {
        assert_eq!(cost_of(&[1], best_views), f32::INFINITY);
        assert_eq!(cost_of(&[], best_views), f32::INFINITY);
    }
}

#[test]
fn giving_up_early_changes_no_decision() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    for best_views in [0, 2, 4] {
        let mut evaluator = at_pixel(
            &problem,
            &window,
            &changed(options(), |o| {
                o.cost.best_views = best_views;
            }),
            false,
        );
        for factor in [0.7, 0.9, 0.99, 1.0, 1.05, 1.4] {
            let food = wall(&world, PIXEL, factor);
            let cost = evaluator.cost(&food, f32::INFINITY);
            for bound in [0.0, 0.01, 0.1, 0.5, cost, cost * 1.0001, 3.0] {
                let expected = if cost < bound { cost } else { f32::INFINITY };
                assert_eq!(evaluator.cost(&food, bound), expected);
            }
        }
        assert!(evaluator.counts.early_terminations > 0);
    }
}

#[test]
fn a_view_without_the_hypothesis_in_its_image_does_not_count() {
    // The third camera sees another part of the world.
    let mut world = World::new(&[0.0, 0.8, -0.8, 0.4], (36, 28));
    let window = window();
    let options = changed(options(), |o| {
        o.cost.best_views = 8;
    });
    let cost = |world: &World| {
        let problem = world.problem();
        let mut evaluator = at_pixel(&problem, &window, &options, false);
        evaluator.cost(&wall(world, PIXEL, 1.05), f32::INFINITY)
    };
    world.cameras[3].cx += 100.0;
    let without = cost(&world);
    let pair = World::new(&[0.0, 0.8, -0.8], (36, 28));
    assert_eq!(without, cost(&pair));
}

#[test]
fn the_geometric_term_grows_up_to_a_limit() {
    let (mut world, window) = (World::five(), window());
    let options = changed(options(), |o| {
        o.cost.best_views = 8;
        o.cost.geom_consistency_weight = 0.6;
        o.cost.geom_consistency_max_error = 0.03;
        o.cost.geom_consistency_missing_error = 0.015;
    });
    let penalty = |world: &World, factor| {
        let problem = world.problem();
        let food = wall(world, PIXEL, factor);
        let [with, without] = [true, false]
            .map(|geometric| at_pixel(&problem, &window, &options, geometric).cost(&food, f32::INFINITY));
        with - without
    };
    // Nothing is validated yet: half of the limit is assumed, which costs a quarter.
    assert!((penalty(&world, 1.0) - 0.15).abs() < 1e-5);
    for view in 1..5 {
        let mut map = testing::exact(&world.cameras[view]);
        map.set_verdicts(&vec![(4, true); map.planes.len()]);
        world.surfaces[view] = map.publish(&world.cameras[view]);
    }
    assert!(penalty(&world, 1.0).abs() < 1e-3);
    let [half, one, two] = [1.005, 1.01, 1.02].map(|factor| penalty(&world, factor));
    assert!((0.04..0.09).contains(&one), "{one} for a percent");
    assert!((3.5..4.5).contains(&(one / half)) && (3.5..4.5).contains(&(two / one)), "{half}, {one}, {two}");
    assert!((penalty(&world, 1.2) - 0.6).abs() < 1e-5, "the limit of 3 percent");
}

#[test]
fn fitness_falls_as_the_cost_grows() {
    assert_eq!([0.0, 1.0, f32::INFINITY].map(fitness), [1.0, 0.5, 0.0]);
}

#[test]
fn the_views_kept_are_those_whose_surfaces_agree_or_else_those_that_match_best() {
    let (mut world, window) = (World::five(), window());
    let food = wall(&world, PIXEL, 1.0);
    let kept_views = |world: &World, geometric, food: &FoodSource| {
        let problem = world.problem();
        let mut evaluator = at_pixel(&problem, &window, &options(), geometric);
        let mut set = [0b1111];
        let cost = evaluator.keep_best_views(food, 3, &mut set);
        assert_eq!(set[0].count_ones(), 3);
        assert_eq!(cost, evaluator.cost(food, f32::INFINITY), "the cost in the views kept");
        (set[0], evaluator.counts.ncc_evaluations)
    };
    // One image shows something else.
    world.images[2] = PackedImage::new(&Picture::from_gray(36, 28, vec![7; 36 * 28]).unwrap());
    assert_eq!(kept_views(&world, false, &food), (0b1101, 4 + 3));
    // One surface lies elsewhere: it is known without any matching.
    for view in 1..5 {
        let mut map = testing::exact(&world.cameras[view]);
        if view == 4 {
            map.planes.iter_mut().for_each(|plane| plane.depth *= 1.1);
        }
        map.set_verdicts(&vec![(4, true); map.planes.len()]);
        world.surfaces[view] = map.publish(&world.cameras[view]);
    }
    assert_eq!(kept_views(&world, true, &food), (0b0111, 3 + 3));
}
