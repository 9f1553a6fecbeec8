//! The colonies of all pixels of one checkerboard colour, and what they start from.

use super::food::FoodSource;
use glam::Vec3;

/// A plane another view offers to a pixel; depth 0 where there is none.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Offer {
    /// Depth at the pixel.
    pub depth: f32,
    /// Unit normal in the camera frame.
    pub normal: Vec3,
    /// Its cost in the view that offers it.
    pub cost: f32,
}

/// The colonies of one colour of the checkerboard. While one colour searches, it only reads the other: the result does
/// not depend on the order of the pixels.
#[derive(Debug, Clone)]
pub struct Colonies {
    /// Width of the image.
    pub width: usize,
    /// Height of the image.
    pub height: usize,
    /// Food sources of each colony, the best first.
    pub foods_per_colony: usize,
    /// Row by row; each row holds the colonies of this colour from left to right.
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

    /// The best food source of a pixel of this colour.
    #[inline(always)]
    pub fn best(&self, x: usize, y: usize) -> &FoodSource {
        &self.foods[y * self.row_len() + x / 2 * self.foods_per_colony]
    }
}

/// The colour of a pixel: 0 or 1.
#[inline(always)]
pub fn colour(x: usize, y: usize) -> usize {
    (x + y) % 2
}
