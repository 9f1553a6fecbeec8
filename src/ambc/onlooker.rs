//! Onlooker bees: planes of neighboring colonies (section 5.4 of the paper).

use super::colony::Colonies;
use super::cost::Evaluator;
use super::food_source::FoodSource;
use super::random::Random;
use super::rules::OnlookerRules;
use crate::geometry::{Offset, Position};
use crate::simd::Simd;

/// The neighbors an onlooker may visit, all of the other checkerboard color: 1, 3 and 5 pixels along the
/// axes, and a knight's move away.
pub(super) const OFFSETS: [Offset; 20] = [
    (1, 0),
    (-1, 0),
    (0, 1),
    (0, -1),
    (3, 0),
    (-3, 0),
    (0, 3),
    (0, -3),
    (5, 0),
    (-5, 0),
    (0, 5),
    (0, -5),
    (1, 2),
    (2, 1),
    (-1, 2),
    (-2, 1),
    (1, -2),
    (2, -1),
    (-1, -2),
    (-2, -1),
];

/// Relative depth difference up to which two planes of the same normal are the same.
const SAME_DEPTH: f32 = 1e-6;

/// Tries, for every food source, the best plane of a random neighbor of the other color, transferred to this
/// pixel, and keeps the better of both. A validated plane has a bonus in that comparison (section 5.6 of the
/// paper).
#[inline(always)]
pub(super) fn send<S: Simd>(
    evaluator: &mut Evaluator<S>,
    foods: &mut [FoodSource],
    neighbors: &Colonies,
    at: Position,
    rules: OnlookerRules,
    random: &mut Random,
) {
    for food in foods {
        let trial = best_of_tournament(evaluator, neighbors, at, rules.tournament_size, random)
            .and_then(|offset| transferred(evaluator, neighbors, at, offset))
            .filter(|trial| !is_same_plane(food, trial));
        let is_improved = match trial {
            Some(trial) => {
                let reward = if trial.validated { rules.reward } else { 0.0 };
                evaluator.replace_if_better(food, &trial, reward)
            }
            None => false,
        };
        if !is_improved {
            food.trials = food.trials.saturating_add(1);
        }
    }
}

/// The offset of the neighbor of lowest cost among so many random ones; of equals the first. Different gray
/// values raise the cost: where one surface has more texture than the next, its planes have the lower costs
/// on both.
#[inline(always)]
fn best_of_tournament<S: Simd>(
    evaluator: &Evaluator<S>,
    colonies: &Colonies,
    (x, y): Position,
    tournament_size: u32,
    random: &mut Random,
) -> Option<Offset> {
    let mut best = random_neighbor(colonies, (x, y), random)?;
    if tournament_size == 1 {
        return Some(best);
    }
    let cost = |(dx, dy): Offset| {
        let at = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
        let food = colonies.best(at);
        // A neighbor that is masked or was never evaluated has no plane.
        if food.depth > 0.0 { food.cost + 1.0 - evaluator.gray_similarity(at) } else { f32::INFINITY }
    };
    let mut lowest = cost(best);
    for _ in 1..tournament_size {
        let Some(other) = random_neighbor(colonies, (x, y), random) else { continue };
        let other_cost = cost(other);
        if other_cost < lowest {
            (best, lowest) = (other, other_cost);
        }
    }
    Some(best)
}

/// A random offset to a pixel inside the image: at a border the offset is mirrored; in tiny images there may
/// be none.
#[inline(always)]
fn random_neighbor(colonies: &Colonies, (x, y): Position, random: &mut Random) -> Option<Offset> {
    let (dx, dy) = OFFSETS[random.below(OFFSETS.len())];
    let mirrored = |at: usize, offset: i32, size: usize| {
        let is_inside = |offset: i32| at.checked_add_signed(offset as isize).is_some_and(|to| to < size);
        [offset, -offset].into_iter().find(|&offset| is_inside(offset))
    };
    Some((mirrored(x, dx, colonies.grid.width)?, mirrored(y, dy, colonies.grid.height)?))
}

/// The best plane of the neighbor at this offset, transferred to the pixel.
#[inline(always)]
fn transferred<S: Simd>(
    evaluator: &Evaluator<S>,
    neighbors: &Colonies,
    (x, y): Position,
    (dx, dy): Offset,
) -> Option<FoodSource> {
    let (nx, ny) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
    let best = neighbors.best((nx, ny));
    if best.depth <= 0.0 {
        return None;
    }
    let problem = evaluator.problem();
    let from = problem.ray(nx as f32, ny as f32);
    let moved = best.transferred(problem, from, evaluator.ray(), (-dx as f32, -dy as f32))?;
    Some(FoodSource { validated: best.validated, ..moved })
}

#[inline(always)]
fn is_same_plane(a: &FoodSource, b: &FoodSource) -> bool {
    (a.depth - b.depth).abs() <= SAME_DEPTH * b.depth && a.normal == b.normal
}
