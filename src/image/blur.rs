//! Box blur and noise at single pixels.

use super::PackedImage;
use crate::geometry::Grid;

/// Mean gray value of the pixels within `radius` columns and rows of a pixel and inside the image.
pub fn blurred(image: &PackedImage, pixel: usize, radius: usize) -> f32 {
    let grid = Grid { width: image.width, height: image.height };
    let (x, y) = grid.position(pixel);
    let (mut sum, mut count) = (0u32, 0u32);
    for row in y.saturating_sub(radius)..=(y + radius).min(grid.height - 1) {
        for column in x.saturating_sub(radius)..=(x + radius).min(grid.width - 1) {
            sum += u32::from(image.gray(column, row));
            count += 1;
        }
    }
    sum as f32 / count as f32
}

/// Standard deviation of the noise at a pixel, in gray values; 0 where it is not known.
pub fn deviation(image: &PackedImage, pixel: usize) -> f32 {
    let (x, y) = Grid { width: image.width, height: image.height }.position(pixel);
    image.noise.variance(image.gray(x, y)).sqrt()
}
