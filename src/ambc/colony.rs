//! The colonies of all pixels of one checkerboard color, and the planes that other views propose.

use super::food_source::FoodSource;
use crate::geometry::{Grid, Position};
use glam::Vec3;

/// A plane that another view propagates to a pixel; depth 0 where there is none.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Candidate {
    /// Depth at the pixel.
    pub depth: f32,
    /// Unit normal in the camera frame.
    pub normal: Vec3,
    /// Its cost in the view that it comes from.
    pub cost: f32,
}

/// The colonies of one color of the checkerboard. While one color is searched, the other is only read: the
/// result does not depend on the order of the pixels.
#[derive(Debug, Clone)]
pub(super) struct Colonies {
    /// The pixels of the image.
    pub grid: Grid,
    /// Food sources of each colony, the best first.
    pub food_sources: usize,
    /// Row by row; each row holds the colonies of this color from left to right.
    pub foods: Vec<FoodSource>,
}

impl Colonies {
    /// Colonies without planes.
    pub(super) fn new(grid: Grid, food_sources: usize) -> Colonies {
        let none = FoodSource::new(0.0, Vec3::ZERO);
        let foods = vec![none; grid.width.div_ceil(2) * grid.height * food_sources];
        Colonies { grid, food_sources, foods }
    }

    /// Food sources of a row of colonies.
    pub(super) fn row_len(&self) -> usize {
        self.grid.width.div_ceil(2) * self.food_sources
    }

    /// The best food source of a pixel of this color.
    #[inline(always)]
    pub(super) fn best(&self, (x, y): Position) -> &FoodSource {
        &self.foods[y * self.row_len() + x / 2 * self.food_sources]
    }
}

/// The color of a pixel: 0 or 1.
#[inline(always)]
pub(super) fn color((x, y): Position) -> usize {
    (x + y) % 2
}
