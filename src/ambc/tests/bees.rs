//! Each kind of bee.

use super::*;
use crate::ambc::colony::{Colonies, color};
use crate::ambc::food_source::cost_to_beat;
use crate::ambc::random::Random;
use crate::ambc::rules::OnlookerRules;
use crate::ambc::{employed, onlooker, scout};
use crate::geometry::Grid;
use crate::geometry::MIN_FACING;
use crate::testing::window;
use glam::Vec3;

// Employed bees.

/// On all food sources.
const ALL: usize = usize::MAX;

#[test]
fn employed_bees_keep_only_what_is_better_and_count_their_trials() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let mut foods = [1.0, 1.1, 0.7, 1.5].map(|factor| evaluated(&mut evaluator, wall(&world, PIXEL, factor)));
    let mut random = Random::new(1, 2);
    let mut improved = 0;
    for _ in 0..100 {
        let before = foods;
        employed::send(&mut evaluator, &mut foods, ALL, &mut random);
        for (before, after) in before.iter().zip(&foods) {
            if after == &(FoodSource { trials: before.trials + 1, ..*before }) {
                continue;
            }
            improved += 1;
            assert!(after.cost < before.cost && after.trials == 0);
            assert_eq!(after.cost, evaluator.cost(after, f32::INFINITY), "the cost kept is the true one");
            let in_one_group = (after.depth == before.depth) != (after.normal == before.normal);
            assert!(in_one_group, "depth or normal moves, not both");
        }
    }
    assert!(improved > 10);
    assert!(foods.iter().all(|food| food.cost < 0.2), "{foods:?}");
}

#[test]
fn employed_bees_stay_in_the_depth_range_and_on_the_visible_side() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let ray = evaluator.ray();
    let grazing = [Vec3::new(-0.99, 0.0, -0.2), Vec3::new(0.99, 0.1, -0.2)].map(|normal| normal.normalize());
    let mut kept = 0;
    for seed in 0..2000 {
        // Costs that anything improves on: every valid trial is kept.
        let mut foods = [
            FoodSource { cost: 9.0, ..FoodSource::new(problem.range.near, grazing[0]) },
            FoodSource { cost: 9.0, ..FoodSource::new(problem.range.far, grazing[1]) },
        ];
        employed::send(&mut evaluator, &mut foods, ALL, &mut Random::new(7, seed));
        for food in foods {
            assert!((problem.range.near..=problem.range.far).contains(&food.depth), "{food:?}");
            assert!(food.normal.dot(ray) < -MIN_FACING, "{food:?}");
            assert!((food.normal.length() - 1.0).abs() < 1e-5);
            kept += usize::from(food.cost < 9.0);
        }
    }
    assert!(kept > 500, "{kept} trials were kept");
}

#[test]
fn employed_bees_work_on_the_first_food_sources_only_where_they_are_told_so() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let before = [1.0, 1.1, 0.7].map(|factor| evaluated(&mut evaluator, wall(&world, PIXEL, factor)));
    let mut foods = before;
    employed::send(&mut evaluator, &mut foods, 1, &mut Random::new(1, 2));
    assert_ne!(foods[0], before[0]);
    assert_eq!(foods[1..], before[1..]);
}

// Onlooker bees.

/// Onlookers that visit the first random neighbor.
fn plain(reward: f32) -> OnlookerRules {
    OnlookerRules { reward, tournament_size: 1 }
}

/// Colonies in which every pixel of the other color has the wall as its best, its depth multiplied.
fn neighbors(world: &World, factor: f32, validated: bool) -> Colonies {
    let (width, height) = (world.images[0].width, world.images[0].height);
    let mut colonies = Colonies::new(Grid { width, height }, 1);
    let other = 1 - color(PIXEL);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        if color((x, y)) == other {
            let at = y * colonies.row_len() + x / 2;
            colonies.foods[at] = FoodSource { validated, cost: 0.0, ..wall(world, (x, y), factor) };
        }
    }
    colonies
}

#[test]
fn onlookers_transfer_a_neighbor_s_plane_to_the_pixel() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let neighbors = neighbors(&world, 1.0, false);
    let wrong = evaluated(&mut evaluator, wall(&world, PIXEL, 1.2));
    for seed in 0..100 {
        let mut foods = [FoodSource { trials: 5, ..wrong }];
        onlooker::send(&mut evaluator, &mut foods, &neighbors, PIXEL, plain(0.0), &mut Random::new(3, seed));
        let [food] = foods;
        // The wall is slanted: a neighbor's depth is another one.
        assert!((food.depth / wall(&world, PIXEL, 1.0).depth - 1.0).abs() < 1e-5, "{food:?}");
        assert_eq!((food.normal, food.trials), (testing::normal(&world.cameras[0]), 0));
        assert_eq!(food.cost, evaluator.cost(&food, f32::INFINITY));
    }
}

#[test]
fn of_the_neighbors_drawn_the_one_of_the_plane_of_lowest_cost_is_visited() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    // The neighbors to the left have the wall, the others a plane of higher cost.
    let mut neighbors = neighbors(&world, 1.0, false);
    for (x, y) in (0..28).flat_map(|y| (PIXEL.0..36).map(move |x| (x, y))) {
        let at = y * neighbors.row_len() + x / 2;
        if neighbors.foods[at].depth > 0.0 {
            neighbors.foods[at] = FoodSource { cost: 1.5, ..wall(&world, (x, y), 1.1) };
        }
    }
    let wrong = evaluated(&mut evaluator, wall(&world, PIXEL, 1.2));
    let mut found_by = |draws: u32| {
        let finds = |seed: &u64| {
            let (mut foods, rules) = ([wrong], OnlookerRules { reward: 0.0, tournament_size: draws });
            onlooker::send(&mut evaluator, &mut foods, &neighbors, PIXEL, rules, &mut Random::new(3, *seed));
            (foods[0].depth / wall(&world, PIXEL, 1.0).depth - 1.0).abs() < 1e-5
        };
        (0..200).filter(finds).count()
    };
    // Eight of the twenty neighbors lie to the left.
    let [one, three, many] = [1, 3, 20].map(&mut found_by);
    assert!((50..110).contains(&one), "{one} of 200 by one draw");
    assert!((135..180).contains(&three), "{three} of 200 by three draws");
    assert_eq!(many, 200);
}

#[test]
fn of_planes_of_equal_cost_the_one_of_the_neighbor_that_is_most_similar_is_visited() {
    let world = World::five();
    let window = Window::new(5, 2, 5.0, 0.03, 1e-5);
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let place = |(dx, dy): (i32, i32)| {
        (PIXEL.0.wrapping_add_signed(dx as isize), PIXEL.1.wrapping_add_signed(dy as isize))
    };
    let difference =
        |(x, y): (usize, usize)| problem.image.gray(x, y).abs_diff(problem.image.gray(PIXEL.0, PIXEL.1));
    let most_similar = onlooker::OFFSETS.into_iter().map(place).min_by_key(|&at| difference(at)).unwrap();
    let mut neighbors = neighbors(&world, 1.1, false);
    let at = most_similar.1 * neighbors.row_len() + most_similar.0 / 2;
    neighbors.foods[at] = FoodSource { cost: 0.0, ..wall(&world, most_similar, 1.0) };
    let wrong = evaluated(&mut evaluator, wall(&world, PIXEL, 1.2));
    for seed in 0..20 {
        let (mut foods, rules) = ([wrong], OnlookerRules { reward: 0.0, tournament_size: 300 });
        onlooker::send(&mut evaluator, &mut foods, &neighbors, PIXEL, rules, &mut Random::new(3, seed));
        let off = foods[0].depth / wall(&world, PIXEL, 1.0).depth - 1.0;
        assert!(off.abs() < 1e-5, "{off} after seed {seed}");
    }
}

#[test]
fn a_slightly_dearer_plane_is_taken_from_a_validated_neighbor_only_and_at_its_true_cost() {
    const REWARD: f32 = 0.05;
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let own = evaluated(&mut evaluator, wall(&world, PIXEL, 1.0));
    let mut cost = |factor| evaluator.cost(&wall(&world, PIXEL, factor), f32::INFINITY);
    let dearer = |cost: f32| (own.cost + 0.01..cost_to_beat(own.cost, REWARD) - 0.01).contains(&cost);
    let factors = || (1..400).map(|step| 1.0 + step as f32 * 5e-4);
    let slightly = factors().find(|&factor| dearer(cost(factor))).expect("a plane slightly dearer");
    let far_off = factors().find(|&factor| cost(factor) > cost_to_beat(own.cost, REWARD) + 0.05);
    let far_off = far_off.expect("a plane much dearer");

    let mut after = |factor: f32, validated: bool, reward: f32| {
        let neighbors = neighbors(&world, factor, validated);
        let mut foods = [own];
        onlooker::send(&mut evaluator, &mut foods, &neighbors, PIXEL, plain(reward), &mut Random::new(3, 4));
        (foods[0], evaluator.cost(&foods[0], f32::INFINITY))
    };
    let kept = FoodSource { trials: 1, ..own };
    let (taken, true_cost) = after(slightly, true, REWARD);
    assert!(taken.validated && taken.depth > own.depth && taken.cost > own.cost, "{taken:?}");
    assert_eq!(taken.cost, true_cost, "the reward is not stored");
    assert_eq!(after(slightly, false, REWARD).0, kept);
    assert_eq!(after(slightly, true, 0.0).0, kept);
    assert_eq!(after(far_off, true, REWARD).0, kept);
}

#[test]
fn neighbors_that_were_never_searched_propose_nothing() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let own = evaluated(&mut evaluator, wall(&world, PIXEL, 1.3));
    let mut foods = [own];
    let empty = Colonies::new(Grid { width: 36, height: 28 }, 1);
    onlooker::send(&mut evaluator, &mut foods, &empty, PIXEL, plain(0.1), &mut Random::new(3, 4));
    assert_eq!(foods, [FoodSource { trials: 1, ..own }]);
}

#[test]
fn onlookers_visit_the_other_color_only() {
    let mut offsets = onlooker::OFFSETS.to_vec();
    assert!(offsets.iter().all(|(x, y)| (x + y) % 2 != 0));
    offsets.sort_unstable();
    offsets.dedup();
    assert_eq!(offsets.len(), 20);
    // Mirroring at a border is a visit too.
    assert!(offsets.iter().all(|&(x, y)| offsets.contains(&(-x, y)) && offsets.contains(&(x, -y))));
}

// Scout bees.

#[test]
fn a_scout_replaces_the_stalest_beyond_the_limit_and_never_the_best() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let mut evaluator = at_pixel(&problem, &window, &options(), false);
    let mut random = Random::new(5, 6);
    let food = evaluated(&mut evaluator, wall(&world, PIXEL, 1.1));
    let mut foods = [50, 11, 13, 10, 13].map(|trials| FoodSource { trials, ..food });
    let mut replaced = Vec::new();
    for _ in 0..5 {
        let before = foods;
        scout::send(&mut evaluator, &mut foods, 10, &mut random);
        let changed: Vec<usize> = (0..foods.len()).filter(|&index| foods[index] != before[index]).collect();
        for &index in &changed {
            let food = foods[index];
            assert!((problem.range.near..=problem.range.far).contains(&food.depth));
            assert_eq!((food.trials, food.validated), (0, false));
            assert_eq!(food.cost, evaluator.cost(&food, f32::INFINITY), "found planes are kept at any cost");
        }
        replaced.push(changed);
    }
    assert_eq!(replaced, [vec![2], vec![4], vec![1], vec![], vec![]]);
}

#[test]
fn the_best_is_first_with_its_trials_and_of_equals_the_earlier() {
    let food = |cost, trials| FoodSource { cost, trials, ..FoodSource::new(1.0, Vec3::NEG_Z) };
    let mut foods = [food(0.5, 1), food(0.2, 2), food(0.2, 3)];
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let evaluator = at_pixel(&problem, &window, &options(), false);
    evaluator.best_first(&mut foods);
    assert_eq!(foods, [food(0.2, 2), food(0.5, 1), food(0.2, 3)]);
    let mut unevaluated = [food(f32::INFINITY, 1), food(f32::INFINITY, 2)];
    evaluator.best_first(&mut unevaluated);
    assert_eq!(unevaluated[0].trials, 1);
}

// The smoothness term.

#[test]
fn a_plane_that_continues_the_validated_neighbors_is_preferred_and_others_cost_up_to_a_limit() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let smooth = changed(options(), |o| {
        o.cost.smoothness_weight = 0.2;
        o.cost.smoothness_max_depth_error = 0.01;
        o.cost.smoothness_max_normal_error = 40.0;
        o.window.sigma_color = 1e3;
    });
    let food = |cost, factor| FoodSource { cost, ..wall(&world, PIXEL, factor) };
    // The plane of higher cost is first exactly if it saves more in smoothness.
    let prefers_wall = |validated, factor, extra: f32| {
        let mut evaluator = at_pixel(&problem, &window, &smooth, false);
        evaluator.load_neighbors(&neighbors(&world, 1.0, validated), PIXEL);
        let mut foods = [food(0.1, factor), food(0.1 + extra, 1.0)];
        evaluator.best_first(&mut foods);
        foods[0] == food(0.1 + extra, 1.0)
    };
    assert!(!prefers_wall(false, 1.05, 0.001), "neighbors that are not validated have no weight");
    assert!(
        prefers_wall(true, 1.005, 0.03) && !prefers_wall(true, 1.005, 0.07),
        "half of the limit, by square"
    );
    assert!(prefers_wall(true, 1.05, 0.15) && !prefers_wall(true, 1.05, 0.25), "the limit");
    assert!(prefers_wall(true, 1.5, 0.15) && !prefers_wall(true, 1.5, 0.25), "no more than the limit");
}

#[test]
fn neighbors_of_another_gray_have_no_weight() {
    let mut world = World::five();
    let gray = |x: usize, y: usize| if (x, y) == PIXEL { 255 } else { 90 };
    let (width, height) = (world.images[0].width, world.images[0].height);
    let grays = (0..width * height).map(|pixel| gray(pixel % width, pixel / width)).collect();
    let picture = crate::image::Picture::from_gray(width as u32, height as u32, grays).unwrap();
    world.images[0] = crate::image::PackedImage::new(&picture);
    let (problem, window) = (world.problem(), window());
    let smooth = changed(options(), |o| {
        o.cost.smoothness_weight = 0.2;
    });
    let mut evaluator = at_pixel(&problem, &window, &smooth, false);
    evaluator.load_neighbors(&neighbors(&world, 1.0, true), PIXEL);
    let food = |cost, factor| FoodSource { cost, ..wall(&world, PIXEL, factor) };
    let mut foods = [food(0.1, 1.05), food(0.12, 1.0)];
    evaluator.best_first(&mut foods);
    assert_eq!(foods[0], food(0.1, 1.05));
}
