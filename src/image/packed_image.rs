//! A gray image as the kernels sample it.

use super::{Noise, Picture};
use crate::simd::Taps;

/// A gray image in the layout that bilinear samples are read from.
#[derive(Debug, Clone)]
pub struct PackedImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Its gray values.
    pub taps: Taps,
    /// Its noise.
    pub noise: Noise,
}

impl PackedImage {
    /// Packs a picture's gray values.
    ///
    /// # Panics
    /// When a side is beyond 32,768 pixels, which no camera has.
    pub fn new(picture: &Picture) -> PackedImage {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let taps = Taps::new(picture.gray(), width, height);
        PackedImage { width, height, taps, noise: Noise::of(picture) }
    }

    /// The gray value of a pixel.
    #[inline(always)]
    pub fn gray(&self, x: usize, y: usize) -> u8 {
        (self.taps.pairs()[y * self.taps.stride() + x][0] as u8) ^ 0x80
    }
}
