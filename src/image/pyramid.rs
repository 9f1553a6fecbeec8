//! Reduction of masks to half size.

use crate::geometry::Camera;

/// The mask of the image at half size: set where any of its four pixels is.
pub fn halve_mask(mask: &[bool], camera: &Camera) -> Vec<bool> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let coarse = camera.halved();
    let (coarse_width, coarse_height) = (coarse.width as usize, coarse.height as usize);
    let wanted = |x: usize, y: usize| mask[y.min(height - 1) * width + x.min(width - 1)];
    let any = |pixel: usize| {
        let (x, y) = (2 * (pixel % coarse_width), 2 * (pixel / coarse_width));
        wanted(x, y) || wanted(x + 1, y) || wanted(x, y + 1) || wanted(x + 1, y + 1)
    };
    (0..coarse_width * coarse_height).map(any).collect()
}
