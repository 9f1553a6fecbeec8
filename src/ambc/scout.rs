//! Scout bees: random planes (section 5.5 of the paper).

use super::cost::Evaluator;
use super::food_source::FoodSource;
use super::random::Random;
use crate::simd::Simd;

/// Replaces the food source of the most failed attempts by a random one when they exceed the limit; never the
/// best one, which is first. Returns whether it did.
#[inline(always)]
pub(super) fn send<S: Simd>(
    evaluator: &mut Evaluator<S>,
    foods: &mut [FoodSource],
    trial_limit: u16,
    random: &mut Random,
) -> bool {
    let stalest = (1..foods.len()).max_by_key(|&index| (foods[index].trials, std::cmp::Reverse(index)));
    let Some(index) = stalest.filter(|&index| foods[index].trials > trial_limit) else { return false };
    let found = FoodSource::random(evaluator.problem(), evaluator.ray(), random, (0.0, 1.0));
    let cost = evaluator.cost(&found, f32::INFINITY);
    foods[index] = FoodSource { cost, ..found };
    true
}
