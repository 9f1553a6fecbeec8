//! The colonies of all pixels of one checkerboard color, and what they start from.

use super::food_source::FoodSource;
use glam::Vec3;

/// A plane another view candidates to a pixel; depth 0 where there is none.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Candidate {
    /// Depth at the pixel.
    pub depth: f32,
    /// Unit normal in the camera frame.
    pub normal: Vec3,
    /// Its cost in the view that candidates it.
    pub cost: f32,
}

/// The colonies of one color of the checkerboard. While one color searches, it only reads the other: the result does
/// not depend on the order of the pixels.
#[derive(Debug, Clone)]
pub struct Colonies {
    /// Width of the image.
    pub width: usize,
    /// Height of the image.
    pub height: usize,
    /// Food sources of each colony, the best first.
    pub foods_per_colony: usize,
    /// Row by row; each row holds the colonies of this color from left to right.
    pub foods: Vec<FoodSource>,
}

impl Colonies {
    /// Colonies without solutions.
    pub fn new(width: usize, height: usize, foods_per_colony: usize) -> Colonies {
        let none = FoodSource::new(0.0, Vec3::ZERO);
        let foods = vec![none; width.div_ceil(2) * height * foods_per_colony];
        Colonies { width, height, foods_per_colony, foods }
    }

    /// Food sources of a row.
    pub fn row_len(&self) -> usize {
        self.width.div_ceil(2) * self.foods_per_colony
    }

    /// The best food source of a pixel of this color.
    #[inline(always)]
    pub fn best(&self, x: usize, y: usize) -> &FoodSource {
        &self.foods[y * self.row_len() + x / 2 * self.foods_per_colony]
    }
}

/// The color of a pixel: 0 or 1.
#[inline(always)]
pub fn color(x: usize, y: usize) -> usize {
    (x + y) % 2
}
