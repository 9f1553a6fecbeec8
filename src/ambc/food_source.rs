//! Food sources: the hypotheses of a colony.

use super::random::Random;
use crate::geometry::{MIN_FACING, PlaneHypothesis, SlantedPlane};
use crate::matching::Problem;
use glam::Vec3;

/// A plane at a pixel, with what it costs there. Stored as depth at its pixel and normal: the same plane elsewhere is a
/// transfer, and keeping to the depth range is exact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoodSource {
    /// Depth at the pixel.
    pub depth: f32,
    /// Unit normal in the camera frame, facing the camera.
    pub normal: Vec3,
    /// Aggregated matching cost; infinite where it cannot be evaluated.
    pub cost: f32,
    /// Trial count: how often it was tried to be improved in vain.
    pub trials: u16,
    /// Whether the plane comes from a validated solution.
    pub validated: bool,
}

impl FoodSource {
    /// A plane not evaluated yet.
    #[inline(always)]
    pub fn new(depth: f32, normal: Vec3) -> FoodSource {
        FoodSource { depth, normal, cost: f32::INFINITY, trials: 0, validated: false }
    }

    /// A random plane: uniform in inverse depth within the given part (0 to 1) of the range, and over the visible
    /// hemisphere (section 5.1).
    #[inline(always)]
    pub fn random(problem: &Problem, ray: Vec3, random: &mut Random, part: (f32, f32)) -> FoodSource {
        let share = part.0 + (part.1 - part.0) * random.unit();
        let (nearest, farthest) = (1.0 / problem.range.near, 1.0 / problem.range.far);
        let inverse_depth = farthest + (nearest - farthest) * share;
        let depth = problem.range.clamp(1.0 / inverse_depth);
        FoodSource::new(depth, random.facing_normal(ray))
    }

    /// A plane near this one: inverse depth within a relative `spread`, normal tilted by up to `tilt` along each axis.
    #[inline(always)]
    pub fn nearby(
        &self,
        problem: &Problem,
        ray: Vec3,
        random: &mut Random,
        spread: f32,
        tilt: f32,
    ) -> FoodSource {
        let depth = problem.range.clamp(self.depth / (1.0 + spread * random.signed()));
        let tilted = self.normal + tilt * Vec3::new(random.signed(), random.signed(), random.signed());
        let normal = tilted.normalize_or_zero();
        let facing = normal.dot(ray) < -MIN_FACING;
        FoodSource::new(depth, if facing { normal } else { self.normal })
    }

    /// The food source of a plane about the pixel with this ray, not evaluated yet; `None` where it leaves the depth range
    /// or turns away from the camera.
    #[inline(always)]
    pub fn of_plane(problem: &Problem, ray: Vec3, plane: &SlantedPlane) -> Option<FoodSource> {
        let (depth, normal) = plane.depth_and_normal(ray, problem.inverse_focal);
        let is_usable = PlaneHypothesis { depth, normal }.is_usable(ray, &problem.range);
        is_usable.then(|| FoodSource::new(depth, normal))
    }

    /// Its plane written as inverse depth about its pixel.
    #[inline(always)]
    pub fn plane(&self, problem: &Problem, ray: Vec3) -> SlantedPlane {
        SlantedPlane::new(self.depth, self.normal, ray, problem.inverse_focal)
    }

    /// The same plane at the pixel with ray `to`, `offset` pixels away; `None` where it leaves the depth range or turns
    /// away from the camera.
    #[inline(always)]
    pub fn transferred(
        &self,
        problem: &Problem,
        from: Vec3,
        to: Vec3,
        offset: (f32, f32),
    ) -> Option<FoodSource> {
        let inverse_depth = self.plane(problem, from).inverse_depth_at(offset.0, offset.1);
        let depth = 1.0 / inverse_depth;
        let is_usable = PlaneHypothesis { depth, normal: self.normal }.is_usable(to, &problem.range);
        is_usable.then(|| FoodSource::new(depth, self.normal))
    }
}

/// Fitness of a cost (equation 4 of the paper).
#[inline(always)]
pub fn fitness(cost: f32) -> f32 {
    1.0 / (1.0 + cost)
}

/// The cost under which a food source with a fitness `reward` beats one of this cost; the reward counts in this
/// comparison only and is never stored.
#[inline(always)]
pub fn cost_to_beat(cost: f32, reward: f32) -> f32 {
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
    fn a_reward_lets_a_slightly_dearer_plane_win_and_none_does_not() {
        let bound = cost_to_beat(0.5, 0.05);
        assert!(bound > 0.5);
        assert!((fitness(bound) + 0.05 - fitness(0.5)).abs() < 1e-6);
        assert_eq!(cost_to_beat(0.5, 0.0), 0.5);
        assert_eq!(cost_to_beat(f32::INFINITY, 0.05), f32::INFINITY);
    }
}
