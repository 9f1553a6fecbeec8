//! The food sources a colony starts with.

use super::*;
use crate::ambc::initial_colony::{InitialColony, PixelSets};
use crate::ambc::{Candidate, Search, SearchRules};
use crate::options::Scale;
use crate::scene::PixelEstimate;
use crate::simd::SimdLevel;
use crate::testing::{RANGE, window};

const WIDTH: usize = 36;
const FOOD_SOURCES: usize = 3;
const PERTURBATION: f32 = 0.02;
/// Colonies of each test: where a random plane lies by chance does not decide.
const COLONIES: usize = 50;

/// How many food sources of the colonies of a pixel lie within the perturbation of its previous estimate, by
/// place before they are ordered by cost; the estimate is a far plane.
fn near_estimate(is_known: bool, validated: bool, with_candidate: bool) -> [usize; FOOD_SOURCES] {
    let (world, window) = (World::five(), window());
    let problem = world.problem();
    let far = PixelEstimate {
        depth: (RANGE.far * 0.95) as f32,
        validated,
        ..testing::exact(&world.cameras[0]).planes[0]
    };
    let starts = vec![far; problem.image.width * problem.image.height];
    let near = Candidate { depth: (RANGE.near * 1.1) as f32, normal: far.normal, cost: 0.1 };
    let candidates = vec![near; starts.len()];
    let options = changed(options(), |o| {
        o.search.depth_perturbation = f64::from(PERTURBATION);
        o.cost.max_views_per_pixel = 0;
    });
    let scale = Scale {
        downscale: 1,
        food_sources: FOOD_SOURCES as u32,
        first_iterations: 0,
        cycles: 0,
        cycle_iterations: 0,
    };
    let mut counts = [0; FOOD_SOURCES];
    for random_stream in 0..COLONIES as u64 {
        let search = Search {
            problem: &problem,
            window: &window,
            evidence_window: &window,
            rules: SearchRules::new(&options, &scale, 0, false),
            mask: None,
            start: is_known.then_some(&starts[..]),
            candidates: with_candidate.then_some(&candidates[..]),
            random_stream,
            level: SimdLevel::Scalar,
            advance: &|_| Ok(()),
        };
        let mut colony = vec![FoodSource::new(0.0, far.normal); FOOD_SOURCES];
        let (mut visible, mut matched) = (vec![0b1111], vec![0b1111]);
        let sets = PixelSets { visible: &mut visible, matched: &mut matched };
        let index = PIXEL.1 * WIDTH + PIXEL.0;
        assert!(!InitialColony::new(Scalar, &search).fill(PIXEL, index, &mut colony, sets));
        assert!(colony.iter().all(|food| food.cost >= colony[0].cost), "best first: {colony:?}");
        colony.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        for (count, food) in counts.iter_mut().zip(&colony) {
            *count += usize::from((far.depth / food.depth - 1.0).abs() <= PERTURBATION);
        }
        assert_eq!(colony.iter().any(|food| food.depth == near.depth), with_candidate);
        assert_eq!(colony.iter().any(|food| food.depth == far.depth), is_known);
    }
    counts
}

#[test]
fn around_a_validated_estimate_all_food_sources_but_the_candidate_are_perturbations_of_it() {
    assert_eq!(near_estimate(true, true, false), [COLONIES; 3]);
    assert_eq!(near_estimate(true, true, true), [COLONIES, COLONIES, 0]);
}

#[test]
fn without_a_validated_estimate_the_second_food_source_is_near_it_unless_it_is_a_candidate() {
    assert_eq!(near_estimate(true, false, false), [COLONIES, COLONIES, 0]);
    let [estimate, second, candidate] = near_estimate(true, false, true);
    assert_eq!([estimate, candidate], [COLONIES, 0]);
    assert!(second < COLONIES / 4, "a random plane is seldom near the estimate: {second} of {COLONIES}");
}

#[test]
fn without_an_estimate_food_sources_are_random() {
    for with_candidate in [false, true] {
        let counts = near_estimate(false, false, with_candidate);
        assert!(counts.iter().all(|&count| count < COLONIES / 4), "{counts:?}");
    }
}
