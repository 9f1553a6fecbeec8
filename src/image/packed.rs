//! The layout the kernels sample: the four taps of a bilinear sample in 32 consecutive bits.

use super::{Noise, Picture};

/// An image of pairs: the one at (x, y) holds the grey values of (x, y) and (x, y + 1), lower byte first, so that two
/// neighbouring pairs are the four taps of a bilinear sample. The last row repeats itself, and each row ends in a copy of
/// its last pair.
#[derive(Debug, Clone)]
pub struct PackedImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// The pairs, row by row, `width + 1` in each.
    pub pairs: Vec<u16>,
    /// Its noise.
    pub noise: Noise,
}

impl PackedImage {
    /// Packs a picture's grey values.
    pub fn new(picture: &Picture) -> PackedImage {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let row = |y: usize| &picture.grey()[y.min(height - 1) * width..][..width];
        let mut pairs = Vec::with_capacity((width + 1) * height);
        for y in 0..height {
            let (top, bottom) = (row(y), row(y + 1));
            pairs.extend(top.iter().zip(bottom).map(|(&top, &bottom)| u16::from_le_bytes([top, bottom])));
            pairs.push(u16::from_le_bytes([top[width - 1], bottom[width - 1]]));
        }
        PackedImage { width, height, pairs, noise: Noise::of(picture) }
    }

    /// Pairs of a row.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        self.width + 1
    }

    /// The grey value of a pixel.
    #[inline(always)]
    pub fn grey(&self, x: usize, y: usize) -> u8 {
        self.pairs[y * self.stride() + x].to_le_bytes()[0]
    }
}
