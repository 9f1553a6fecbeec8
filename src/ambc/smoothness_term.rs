//! Smoothness, beyond the paper: the planes of the neighboring pixels, as far as they are validated and look alike,
//! say where the surface of a pixel should be.

use super::colony::Colonies;
use super::food_source::FoodSource;
use crate::matching::Problem;
use crate::matching::Window;
use glam::Vec3;

/// How disagreement with neighbors is priced: by its square, which leaves planes that nearly agree to the images.
#[derive(Debug, Clone, Copy)]
pub struct SmoothnessRules {
    /// Cost of disagreeing with all neighbors altogether; 0 without smoothness.
    pub weight: f32,
    /// Relative difference of inverse depths that is altogether.
    pub depth_scale: f32,
    /// `1 - cos` of the angle between normals that is altogether.
    pub normal_scale: f32,
}

/// What the neighbors of the pixel at work predict there.
#[derive(Debug, Clone)]
pub struct Surroundings {
    rules: SmoothnessRules,
    predictions: [Prediction; NEIGHBORS.len()],
    count: usize,
}

#[derive(Debug, Clone, Copy)]
struct Prediction {
    /// Of the neighbor's plane at the pixel.
    depth: f32,
    normal: Vec3,
    /// Its share of the cost.
    weight: f32,
}

/// All of the other color of the checkerboard.
const NEIGHBORS: [(i32, i32); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

impl Surroundings {
    /// Without neighbors.
    pub fn new(rules: SmoothnessRules) -> Surroundings {
        let none = Prediction { depth: 1.0, normal: Vec3::NEG_Z, weight: 0.0 };
        Surroundings { rules, predictions: [none; NEIGHBORS.len()], count: 0 }
    }

    /// Looks at the best food sources of the neighbors of a pixel.
    #[inline(always)]
    pub fn look(&mut self, problem: &Problem, window: &Window, colonies: &Colonies, (x, y): (usize, usize)) {
        self.count = 0;
        if self.rules.weight == 0.0 {
            return;
        }
        let to = problem.ray(x as f32, y as f32);
        let center = problem.image.gray(x, y);
        for (dx, dy) in NEIGHBORS {
            let (nx, ny) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
            if nx >= colonies.width || ny >= colonies.height {
                continue;
            }
            let best = colonies.best(nx, ny);
            if !best.validated {
                continue;
            }
            let from = problem.ray(nx as f32, ny as f32);
            if let Some(moved) = best.transferred(problem, from, to, (-dx as f32, -dy as f32)) {
                let likeness = window.likeness(center, problem.image.gray(nx, ny));
                let weight = self.rules.weight * likeness / NEIGHBORS.len() as f32;
                self.predictions[self.count] =
                    Prediction { depth: moved.depth, normal: moved.normal, weight };
                self.count += 1;
            }
        }
    }

    /// What a food source's disagreement with the neighbors costs.
    #[inline(always)]
    pub fn cost(&self, food: &FoodSource) -> f32 {
        let mut sum = 0.0;
        for prediction in &self.predictions[..self.count] {
            let depth = (prediction.depth / food.depth - 1.0).abs() / self.rules.depth_scale;
            let normal = (1.0 - prediction.normal.dot(food.normal)) / self.rules.normal_scale;
            let disagreement = depth + normal;
            sum += prediction.weight * if disagreement < 1.0 { disagreement * disagreement } else { 1.0 };
        }
        sum
    }
}
