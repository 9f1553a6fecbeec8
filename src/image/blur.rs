//! Box blur at single pixels.

use super::PackedImage;
use crate::geometry::Grid;

/// Mean gray value of the pixels at most `radius` columns and rows away.
pub(crate) fn blurred(image: &PackedImage, pixel: usize, radius: usize) -> f32 {
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
