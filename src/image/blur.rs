//! Box blur at single pixels.

use super::PackedImage;

/// Mean gray value of the pixels at most `radius` columns and rows away.
pub fn blurred(image: &PackedImage, pixel: usize, radius: usize) -> f32 {
    let (x, y) = (pixel % image.width, pixel / image.width);
    let (mut sum, mut count) = (0u32, 0u32);
    for row in y.saturating_sub(radius)..=(y + radius).min(image.height - 1) {
        for column in x.saturating_sub(radius)..=(x + radius).min(image.width - 1) {
            sum += u32::from(image.gray(column, row));
            count += 1;
        }
    }
    sum as f32 / count as f32
}
