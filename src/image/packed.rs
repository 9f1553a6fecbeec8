//! The layout the kernels sample: the four taps of a bilinear sample in one 32-bit word.

use super::Picture;

/// An image whose word at (x, y) holds the grey values of (x, y), (x + 1, y), (x, y + 1) and (x + 1, y + 1), lowest
/// byte first; the last column and row repeat themselves.
#[derive(Debug, Clone)]
pub struct PackedImage {
    /// Width in pixels and words.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// The words, row by row.
    pub words: Vec<u32>,
}

impl PackedImage {
    /// Packs a picture's grey values.
    pub fn new(picture: &Picture) -> PackedImage {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let row = |y: usize| &picture.grey()[y.min(height - 1) * width..][..width];
        let mut words = Vec::with_capacity(width * height);
        for y in 0..height {
            let (top, bottom) = (row(y), row(y + 1));
            for x in 0..width {
                let right = (x + 1).min(width - 1);
                words.push(u32::from_le_bytes([top[x], top[right], bottom[x], bottom[right]]));
            }
        }
        PackedImage { width, height, words }
    }
}
