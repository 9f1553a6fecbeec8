//! The smoothness term of the cost, beyond the paper: the validated planes of the four neighbors, weighted by
//! the similarity of gray values, predict the plane of a pixel; disagreement adds to its cost.
//!
//! ```text
//! cost = weight / 4 * sum over validated neighbors of similarity * min(1, e)^2
//! e = |d_neighbor / d - 1| / max_depth_error + (1 - n_neighbor . n) / (1 - cos(max_normal_error))
//! ```

use super::colony::Colonies;
use super::food_source::FoodSource;
use super::rules::SmoothnessRules;
use crate::geometry::{Offset, Position};
use crate::matching::{Problem, Window};
use glam::Vec3;

/// The planes that the neighbors predict for the current pixel.
#[derive(Debug, Clone)]
pub(super) struct SmoothnessTerm {
    rules: SmoothnessRules,
    predictions: [Prediction; NEIGHBORS.len()],
    count: usize,
}

#[derive(Debug, Clone, Copy)]
struct Prediction {
    /// Depth of the neighbor's plane at the pixel.
    depth: f32,
    normal: Vec3,
    /// Its part of the cost at the limit.
    weight: f32,
}

/// All of the other color of the checkerboard.
const NEIGHBORS: [Offset; 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

impl SmoothnessTerm {
    /// A term without neighbors, which costs nothing.
    pub(super) fn new(rules: SmoothnessRules) -> SmoothnessTerm {
        let none = Prediction { depth: 1.0, normal: Vec3::NEG_Z, weight: 0.0 };
        SmoothnessTerm { rules, predictions: [none; NEIGHBORS.len()], count: 0 }
    }

    /// Takes the best planes of the neighbors of a pixel as predictions.
    #[inline(always)]
    pub(super) fn load_neighbors(
        &mut self,
        problem: &Problem,
        window: &Window,
        colonies: &Colonies,
        at: Position,
    ) {
        self.count = 0;
        if self.rules.weight == 0.0 {
            return;
        }
        let to = problem.ray(at.0 as f32, at.1 as f32);
        let center = problem.image.gray(at.0, at.1);
        for (dx, dy) in NEIGHBORS {
            let Some((nx, ny)) = colonies.grid.neighbor(at, (dx, dy)) else { continue };
            let best = colonies.best((nx, ny));
            if !best.validated {
                continue;
            }
            let from = problem.ray(nx as f32, ny as f32);
            if let Some(moved) = best.transferred(problem, from, to, (-dx as f32, -dy as f32)) {
                let similarity = window.similarity(center, problem.image.gray(nx, ny));
                let weight = self.rules.weight * similarity / NEIGHBORS.len() as f32;
                self.predictions[self.count] =
                    Prediction { depth: moved.depth, normal: moved.normal, weight };
                self.count += 1;
            }
        }
    }

    /// The cost of a food source's disagreement with the neighbors.
    #[inline(always)]
    pub(super) fn cost(&self, food: &FoodSource) -> f32 {
        let SmoothnessRules { max_depth_error, max_normal_error, .. } = self.rules;
        // The neighbors share the divisions.
        let (per_depth, per_normal) = (1.0 / (food.depth * max_depth_error), 1.0 / max_normal_error);
        let mut sum = 0.0;
        for prediction in &self.predictions[..self.count] {
            let depth = (prediction.depth - food.depth).abs() * per_depth;
            let normal = (1.0 - prediction.normal.dot(food.normal)) * per_normal;
            let error = depth + normal;
            sum += prediction.weight * if error < 1.0 { error * error } else { 1.0 };
        }
        sum
    }
}
