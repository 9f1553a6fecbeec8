//! Gray images in the layout that the kernels sample, with their noise.

use super::{Noise, Picture};
use crate::simd::Taps;

/// A gray image, packed for bilinear sampling.
#[derive(Debug, Clone)]
pub struct PackedImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Gray values in the layout of bilinear samples.
    pub taps: Taps,
    /// Variance of the sensor noise.
    pub(crate) noise: Noise,
}

impl PackedImage {
    /// Packs the gray values of a picture and estimates their noise.
    ///
    /// # Panics
    /// If a side exceeds 32,768 pixels, the largest side of a camera.
    pub fn new(picture: &Picture) -> PackedImage {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let taps = Taps::new(picture.gray(), width, height);
        PackedImage { width, height, taps, noise: Noise::estimate(picture) }
    }

    /// Bytes that its pixels take in memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.taps.pairs())
    }

    /// The gray value of a pixel.
    #[inline(always)]
    pub fn gray(&self, x: usize, y: usize) -> u8 {
        // The pair at a pixel starts with its gray value, minus 128.
        (self.taps.pairs()[y * self.taps.stride() + x][0] as u8) ^ 0x80
    }
}
