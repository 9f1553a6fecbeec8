//! The bees and the search one by one, before a wall of which everything is known.

mod bees;
mod costs;
mod initial_colony;
mod local_plane;
mod planes;
mod search;

use super::CostRules;
use super::cost::Evaluator;
use super::food_source::FoodSource;
use crate::geometry::ViewSets;
use crate::matching::Problem;
use crate::matching::Window;
use crate::options::Options;
use crate::simd::Scalar;
use crate::testing::changed;
use crate::testing::{self, World};

/// A pixel that all views see.
const PIXEL: (usize, usize) = (18, 14);

fn options() -> Options {
    changed(Options::default(), |o| {
        o.cost.best_views = 3;
    })
}

/// An evaluator of the pixel with all sources in its set.
fn at_pixel<'a>(
    problem: &'a Problem<'a>,
    window: &'a Window,
    options: &Options,
    with_geometric_term: bool,
) -> Evaluator<'a, Scalar> {
    let mut evaluator = Evaluator::new(Scalar, problem, window, CostRules::new(options, with_geometric_term));
    let mut set = vec![0; problem.sources.len().div_ceil(32)];
    ViewSets::fill_words(&mut set, problem.sources.len());
    evaluator.set_pixel(PIXEL, &set);
    evaluator
}

/// The wall at a pixel, its depth multiplied.
fn wall(world: &World, (x, y): (usize, usize), factor: f32) -> FoodSource {
    let camera = &world.cameras[0];
    FoodSource::new(testing::depth(camera, y * camera.width as usize + x) * factor, testing::normal(camera))
}

fn evaluated(evaluator: &mut Evaluator<Scalar>, food: FoodSource) -> FoodSource {
    FoodSource { cost: evaluator.cost(&food, f32::INFINITY), ..food }
}
