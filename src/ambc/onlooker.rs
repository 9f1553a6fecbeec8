//! Onlooker bees: bring the best plane of a neighboring colony (section 5.4 of the paper).

use super::colony::Colonies;
use super::cost::Evaluator;
use super::food_source::FoodSource;
use super::random::Random;
use crate::simd::Simd;

/// The neighbors an onlooker may visit, all of the other color: 1, 3 and 5 pixels along the axes, and a knight's move
/// away.
pub const OFFSETS: [(i32, i32); 20] = [
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

/// How onlookers choose.
#[derive(Debug, Clone, Copy)]
pub struct OnlookerRules {
    /// Fitness reward of validated planes (section 5.6).
    pub reward: f32,
    /// Random neighbors of which the one of the cheapest plane is visited; the paper's onlookers take the first.
    pub draws: u32,
}

/// Candidates every food source the best plane of a random neighbor of the other color, transferred to this pixel, and
/// keeps what is better. A validated plane is rewarded in that comparison (section 5.6).
#[inline(always)]
pub fn send<S: Simd>(
    evaluator: &mut Evaluator<S>,
    foods: &mut [FoodSource],
    neighbors: &Colonies,
    (x, y): (usize, usize),
    rules: OnlookerRules,
    random: &mut Random,
) {
    for food in foods {
        let candidate = draw_best(evaluator, neighbors, (x, y), rules.draws, random)
            .and_then(|(dx, dy)| brought(evaluator, neighbors, (x, y), (dx, dy)))
            .filter(|candidate| !is_same_plane(food, candidate));
        let improved = match candidate {
            Some(candidate) => {
                evaluator.challenge(food, &candidate, if candidate.validated { rules.reward } else { 0.0 })
            }
            None => false,
        };
        if !improved {
            food.trials = food.trials.saturating_add(1);
        }
    }
}

/// The offset of the cheapest plane among so many random neighbors; of equals the first. Those that look different are
/// reckoned dearer: where one surface has more texture than the next, its planes are the cheaper ones on both.
#[inline(always)]
fn draw_best<S: Simd>(
    evaluator: &Evaluator<S>,
    colonies: &Colonies,
    (x, y): (usize, usize),
    draws: u32,
    random: &mut Random,
) -> Option<(i32, i32)> {
    let mut best = draw_neighbor(colonies, x, y, random)?;
    let cost = |(dx, dy): (i32, i32)| {
        let (x, y) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
        let food = colonies.best(x, y);
        // A neighbor that is masked or was never evaluated has nothing to candidate.
        if food.depth > 0.0 { food.cost + 1.0 - evaluator.likeness(x, y) } else { f32::INFINITY }
    };
    for _ in 1..draws {
        if let Some(other) = draw_neighbor(colonies, x, y, random)
            && cost(other) < cost(best)
        {
            best = other;
        }
    }
    Some(best)
}

/// A random offset to a pixel inside the image: at a border the offset is mirrored, in tiny images there may be none.
#[inline(always)]
fn draw_neighbor(colonies: &Colonies, x: usize, y: usize, random: &mut Random) -> Option<(i32, i32)> {
    let (dx, dy) = OFFSETS[random.below(OFFSETS.len())];
    let mirrored = |at: usize, offset: i32, size: usize| {
        let inside = |offset: i32| at.checked_add_signed(offset as isize).is_some_and(|to| to < size);
        [offset, -offset].into_iter().find(|&offset| inside(offset))
    };
    Some((mirrored(x, dx, colonies.width)?, mirrored(y, dy, colonies.height)?))
}

/// The best plane of the neighbor at this offset, moved to the pixel.
#[inline(always)]
fn brought<S: Simd>(
    evaluator: &Evaluator<S>,
    neighbors: &Colonies,
    (x, y): (usize, usize),
    (dx, dy): (i32, i32),
) -> Option<FoodSource> {
    let (nx, ny) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
    let best = neighbors.best(nx, ny);
    // A neighbor that is masked or was never evaluated has nothing to candidate.
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
    (a.depth - b.depth).abs() <= 1e-6 * b.depth && a.normal == b.normal
}
