//! The whole search of a view.

use super::*;
use crate::ambc::{Candidate, OnlookerRules, Search};
use crate::scene::PixelEstimate;
use crate::simd::SimdLevel;
use crate::testing::{RANGE, window};
use crate::view_selection::ViewRules;

/// A search without start and iterations.
fn idle<'a>(problem: &'a Problem<'a>, window: &'a Window) -> Search<'a> {
    Search {
        problem,
        window,
        cost_rules: CostRules::new(&options(), false),
        view_rules: ViewRules::new(&options(), 2),
        mask: None,
        start: None,
        candidates: None,
        foods: 2,
        iterations: 0,
        trial_limit: 10,
        employed_foods: usize::MAX,
        onlookers: OnlookerRules { reward: 0.05, draws: 1 },
        plane_fit: 0.0,
        focused_views: 0,
        around_start: (0.0, 0.0),
        stream: 1,
        level: SimdLevel::detect(),
        cancelled: &|| false,
    }
}

#[test]
fn the_search_finds_the_wall() {
    let world = World::five();
    let (problem, window) = (world.problem(), window());
    let status = Search { foods: 6, iterations: 10, ..idle(&problem, &window) }.run().unwrap();
    let camera = &world.cameras[0];
    let right = status.best.iter().enumerate().filter(|(pixel, food)| {
        let (x, y) = (pixel % 36, pixel / 36);
        let inner = (6..30).contains(&x) && (6..22).contains(&y);
        inner && (food.depth / testing::depth(camera, *pixel) - 1.0).abs() < 0.02
    });
    let right = right.count();
    assert!(right > 24 * 16 * 9 / 10, "{right} of {}", 24 * 16);
    assert!(status.counts.ncc_evaluations > 0);
    assert_eq!(status.counts.bilinear_samples, status.counts.ncc_evaluations * window.samples());
}

#[test]
fn images_of_any_size_are_searched() {
    for size in [(1, 1), (1, 2), (2, 1), (1, 9), (9, 1), (2, 2), (3, 5), (65, 3), (4, 17)] {
        let (world, window) = (World::new(&[0.0, 0.8, -0.8], size), window());
        let problem = world.problem();
        let status = Search { foods: 3, iterations: 4, ..idle(&problem, &window) }.run().unwrap();
        assert_eq!(status.best.len(), (size.0 * size.1) as usize);
        for food in &status.best {
            assert!((RANGE.near as f32..=RANGE.far as f32).contains(&food.depth), "{size:?}: {food:?}");
        }
    }
}

#[test]
fn a_solution_to_start_from_is_kept_unless_beaten_and_an_offer_is_tried() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let exact = testing::exact(&world.cameras[0]);
    let mut wrong = exact.solutions.clone();
    wrong.iter_mut().for_each(|solution| solution.depth *= 1.5);
    let candidate =
        |solution: &PixelEstimate| Candidate { depth: solution.depth, normal: solution.normal, cost: 0.1 };
    let candidates: Vec<Candidate> = exact.solutions.iter().map(candidate).collect();
    let run = |start: &[PixelEstimate], candidates: Option<&[Candidate]>| {
        let search = Search { start: Some(start), candidates, ..idle(&problem, &window) };
        search.run().unwrap().best[PIXEL.1 * 36 + PIXEL.0].depth
    };
    let right = exact.solutions[PIXEL.1 * 36 + PIXEL.0].depth;
    assert_eq!(run(&exact.solutions, None), right);
    assert_eq!(run(&wrong, Some(&candidates)), right);
    assert_ne!(run(&wrong, None), right);
}

#[test]
fn a_cancelled_search_ends_in_an_error() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let search = Search { cancelled: &|| true, ..idle(&problem, &window) };
    assert_eq!(search.run().err(), Some(crate::Error::Cancelled));
}
