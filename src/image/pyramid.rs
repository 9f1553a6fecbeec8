//! The image pyramid: pictures and masks at half size.

use super::Picture;
use crate::geometry::{Camera, Grid};

impl Picture {
    /// The gray picture at half size: the rounded mean of 2 x 2 pixels. Where a side is odd, the last column
    /// or row is repeated.
    pub fn halved(&self) -> Picture {
        let fine = Grid { width: self.width() as usize, height: self.height() as usize };
        let mean = |pixels: [usize; 4]| {
            let sum: u32 = pixels.iter().map(|&pixel| u32::from(self.gray()[pixel])).sum();
            ((sum + 2) / 4) as u8
        };
        let gray = quadruples(fine).map(mean).collect();
        let (width, height) = (self.width().div_ceil(2), self.height().div_ceil(2));
        Picture::from_gray(width, height, gray).expect("one value per pixel at half size")
    }
}

/// The mask of the camera's image at half size: set where any of the 2 x 2 pixels is set.
pub(crate) fn halve_mask(mask: &[bool], camera: &Camera) -> Vec<bool> {
    quadruples(camera.grid()).map(|pixels| pixels.iter().any(|&pixel| mask[pixel])).collect()
}

/// For each pixel of the image at half size, row by row, the indices of its 2 x 2 pixels. The last column and
/// row are repeated where a side is odd.
fn quadruples(fine: Grid) -> impl Iterator<Item = [usize; 4]> {
    let index = move |x: usize, y: usize| fine.index((x.min(fine.width - 1), y.min(fine.height - 1)));
    let corners =
        (0..fine.height).step_by(2).flat_map(move |y| (0..fine.width).step_by(2).map(move |x| (x, y)));
    corners.map(move |(x, y)| [index(x, y), index(x + 1, y), index(x, y + 1), index(x + 1, y + 1)])
}
