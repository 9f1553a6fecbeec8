//! Food sources: the planes of a colony.

use super::random::Random;
use super::rules::Perturbation;
use crate::geometry::{MIN_FACING, PlaneHypothesis, SlantedPlane};
use crate::matching::Problem;
use glam::Vec3;

/// One in so many random planes is drawn beyond the likely range, where there is a wider one.
const OUTER_DRAWS: f32 = 16.0;

/// A plane at a pixel and what it costs there. It is stored as depth at its pixel and normal: the same plane
/// at another pixel is a transfer, and clamping to the depth range is exact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FoodSource {
    /// Depth at the pixel.
    pub depth: f32,
    /// Unit normal in the camera frame, facing the camera.
    pub normal: Vec3,
    /// Aggregated matching cost; infinite where it cannot be evaluated.
    pub cost: f32,
    /// Consecutive failed attempts to improve it.
    pub trials: u16,
    /// Whether the plane comes from a validated estimate.
    pub validated: bool,
}

impl FoodSource {
    /// A plane that is not evaluated yet.
    #[inline(always)]
    pub(super) fn new(depth: f32, normal: Vec3) -> FoodSource {
        FoodSource { depth, normal, cost: f32::INFINITY, trials: 0, validated: false }
    }

    /// A random plane: uniform in inverse depth within the given part (0 to 1) of the likely range, and over
    /// the visible hemisphere (section 5.1 of the paper). Where depths may lie beyond that range, one plane
    /// in [`OUTER_DRAWS`] does, nearer and farther ones alike.
    #[inline(always)]
    pub(super) fn random(problem: &Problem, ray: Vec3, random: &mut Random, part: (f32, f32)) -> FoodSource {
        let share = part.0 + (part.1 - part.0) * random.unit();
        let (likely, range) = (&problem.likely_range, &problem.range);
        let (mut nearest, mut farthest) = (1.0 / likely.near, 1.0 / likely.far);
        if range != likely && random.unit() * OUTER_DRAWS < 1.0 {
            (nearest, farthest) = match random.unit() < 0.5 {
                true => (farthest, 1.0 / range.far),
                false => (1.0 / range.near, nearest),
            };
        }
        let inverse_depth = farthest + (nearest - farthest) * share;
        let depth = problem.range.clamp(1.0 / inverse_depth);
        FoodSource::new(depth, random.facing_normal(ray))
    }

    /// A plane near this one.
    #[inline(always)]
    pub(super) fn perturbed(
        &self,
        problem: &Problem,
        ray: Vec3,
        random: &mut Random,
        perturbation: Perturbation,
    ) -> FoodSource {
        let depth = problem.range.clamp(self.depth / (1.0 + perturbation.depth * random.signed()));
        let offset = Vec3::new(random.signed(), random.signed(), random.signed());
        let normal = (self.normal + perturbation.normal * offset).normalize_or_zero();
        let is_facing = normal.dot(ray) < -MIN_FACING;
        FoodSource::new(depth, if is_facing { normal } else { self.normal })
    }

    /// The food source of a plane about the pixel with this ray, not evaluated yet; `None` where it is not
    /// usable.
    #[inline(always)]
    pub(super) fn of_plane(problem: &Problem, ray: Vec3, plane: &SlantedPlane) -> Option<FoodSource> {
        let (depth, normal) = plane.depth_and_normal(ray, problem.inverse_focal);
        let is_usable = PlaneHypothesis { depth, normal }.is_usable(ray, &problem.range);
        is_usable.then(|| FoodSource::new(depth, normal))
    }

    /// Its plane written as inverse depth about its pixel.
    #[inline(always)]
    pub(super) fn plane(&self, problem: &Problem, ray: Vec3) -> SlantedPlane {
        SlantedPlane::new(self.depth, self.normal, ray, problem.inverse_focal)
    }

    /// The same plane at the pixel with ray `to`, `offset` pixels away; `None` where it is not usable.
    #[inline(always)]
    pub(super) fn transferred(
        &self,
        problem: &Problem,
        from: Vec3,
        to: Vec3,
        offset: (f32, f32),
    ) -> Option<FoodSource> {
        let depth = 1.0 / self.plane(problem, from).inverse_depth_at(offset.0, offset.1);
        let is_usable = PlaneHypothesis { depth, normal: self.normal }.is_usable(to, &problem.range);
        is_usable.then(|| FoodSource::new(depth, self.normal))
    }
}

/// Fitness of a cost (equation 4 of the paper).
#[inline(always)]
pub(super) fn fitness(cost: f32) -> f32 {
    1.0 / (1.0 + cost)
}

/// The cost under which a food source with a fitness bonus `reward` beats one of this cost. The reward counts
/// in this comparison only and is never stored (section 5.6 of the paper).
#[inline(always)]
pub(super) fn cost_to_beat(cost: f32, reward: f32) -> f32 {
    let needed = fitness(cost) - reward;
    if reward == 0.0 {
        cost
    } else if needed > 0.0 {
        1.0 / needed - 1.0
    } else {
        f32::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reward_lets_a_plane_of_slightly_higher_cost_win() {
        let bound = cost_to_beat(0.5, 0.05);
        assert!(bound > 0.5);
        assert!((fitness(bound) + 0.05 - fitness(0.5)).abs() < 1e-6);
        assert_eq!(cost_to_beat(0.5, 0.0), 0.5);
        assert_eq!(cost_to_beat(f32::INFINITY, 0.05), f32::INFINITY);
    }
}
