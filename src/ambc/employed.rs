//! Employed bees: perturbation within a colony (section 5.3 of the paper).

use super::cost::Evaluator;
use super::food_source::FoodSource;
use super::random::Random;
use crate::geometry::MIN_FACING;
use crate::simd::Simd;

/// Perturbs the first `count` food sources towards or away from another one of the colony, `y' = y + R(-1,1)
/// (y_n - y)`, in depth or in normal with equal chance, and keeps the better of both.
#[inline(always)]
pub(super) fn send<S: Simd>(
    evaluator: &mut Evaluator<S>,
    foods: &mut [FoodSource],
    count: usize,
    random: &mut Random,
) {
    for index in 0..foods.len().min(count) {
        let other = (index + 1 + random.below(foods.len() - 1)) % foods.len();
        let (food, other) = (foods[index], foods[other]);
        // No closure around what evaluates: one that is not inlined is not compiled for the instruction set.
        let is_improved = match perturb(evaluator, &food, &other, random) {
            Some(trial) => evaluator.replace_if_better(&mut foods[index], &trial, 0.0),
            None => false,
        };
        if !is_improved {
            foods[index].trials = food.trials.saturating_add(1);
        }
    }
}

/// The perturbed food source, `None` when it is the same one or turns away from the camera.
#[inline(always)]
fn perturb<S: Simd>(
    evaluator: &Evaluator<S>,
    food: &FoodSource,
    other: &FoodSource,
    random: &mut Random,
) -> Option<FoodSource> {
    let is_depth = random.below(2) == 0;
    let amount = random.signed();
    if is_depth {
        let range = &evaluator.problem().range;
        let depth = range.clamp(food.depth + amount * (other.depth - food.depth));
        (depth != food.depth).then(|| FoodSource::new(depth, food.normal))
    } else {
        let normal = (food.normal + amount * (other.normal - food.normal)).normalize_or_zero();
        let is_valid = normal.dot(evaluator.ray()) < -MIN_FACING && normal != food.normal;
        is_valid.then(|| FoodSource::new(food.depth, normal))
    }
}
