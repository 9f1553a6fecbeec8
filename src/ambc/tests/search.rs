//! The whole search of a view.

use super::*;
use crate::ambc::{Candidate, Search, SearchRules};
use crate::options::Scale;
use crate::scene::PixelEstimate;
use crate::simd::SimdLevel;
use crate::testing::{RANGE, window};

/// Rules of a search without iterations, whose food sources start at random.
fn rules(food_sources: u32, iterations: u32) -> SearchRules {
    let scale =
        Scale { downscale: 1, food_sources, first_iterations: iterations, cycles: 0, cycle_iterations: 0 };
    let options = changed(options(), |o| {
        o.search.depth_perturbation = 0.0;
        o.search.onlooker_tournament_size = 1;
        o.search.local_plane_tolerance = 0.0;
        o.cost.max_views_per_pixel = 0;
    });
    SearchRules::new(&options, &scale, 0, false)
}

fn search<'a>(problem: &'a Problem<'a>, window: &'a Window, rules: SearchRules) -> Search<'a> {
    Search {
        problem,
        window,
        evidence_window: window,
        rules,
        mask: None,
        start: None,
        candidates: None,
        random_stream: 1,
        level: SimdLevel::detect(),
        advance: &|_| Ok(()),
    }
}

#[test]
fn the_search_finds_the_wall() {
    let world = World::five();
    let (problem, window) = (world.problem(), window());
    let found = search(&problem, &window, rules(6, 10)).run().unwrap();
    let camera = &world.cameras[0];
    let right = found.planes.iter().enumerate().filter(|(pixel, plane)| {
        let (x, y) = (pixel % 36, pixel / 36);
        let is_inner = (6..30).contains(&x) && (6..22).contains(&y);
        is_inner && (plane.depth / testing::depth(camera, *pixel) - 1.0).abs() < 0.02
    });
    let right = right.count();
    assert!(right > 24 * 16 * 9 / 10, "{right} of {}", 24 * 16);
    assert!(found.counts.ncc_evaluations > 0);
    assert_eq!(found.counts.bilinear_samples, found.counts.ncc_evaluations * window.samples());
}

#[test]
fn images_of_any_size_are_searched() {
    for size in [(1, 1), (1, 2), (2, 1), (1, 9), (9, 1), (2, 2), (3, 5), (65, 3), (4, 17)] {
        let (world, window) = (World::new(&[0.0, 0.8, -0.8], size), window());
        let problem = world.problem();
        let found = search(&problem, &window, rules(3, 4)).run().unwrap();
        assert_eq!(found.planes.len(), (size.0 * size.1) as usize);
        for plane in &found.planes {
            assert!((RANGE.near as f32..=RANGE.far as f32).contains(&plane.depth), "{size:?}: {plane:?}");
        }
    }
}

#[test]
fn a_previous_estimate_is_kept_unless_another_is_better_and_a_candidate_is_tried() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let exact = testing::exact(&world.cameras[0]).planes;
    let mut wrong = exact.clone();
    wrong.iter_mut().for_each(|plane| plane.depth *= 1.5);
    let candidate = |plane: &PixelEstimate| Candidate { depth: plane.depth, normal: plane.normal, cost: 0.1 };
    let candidates: Vec<Candidate> = exact.iter().map(candidate).collect();
    let middle = PIXEL.1 * 36 + PIXEL.0;
    let depth = |start: &[PixelEstimate], candidates: Option<&[Candidate]>| {
        let search = Search { start: Some(start), candidates, ..search(&problem, &window, rules(2, 0)) };
        search.run().unwrap().planes[middle].depth
    };
    let right = exact[middle].depth;
    assert_eq!(depth(&exact, None), right);
    assert_eq!(depth(&wrong, Some(&candidates)), right);
    assert_ne!(depth(&wrong, None), right);
}

#[test]
fn a_cancelled_search_ends_in_an_error() {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let advance = |_| Err(crate::Error::Cancelled);
    let search = Search { advance: &advance, ..search(&problem, &window, rules(2, 0)) };
    assert_eq!(search.run().err(), Some(crate::Error::Cancelled));
}
