//! Estimation of the sensor noise of an image. A patch whose variance does not exceed it has no texture.

use super::{PackedImage, Picture};
use crate::geometry::Grid;
use std::ops::Range;

/// Gray values that share an estimate: noise depends on brightness.
const GRAY_VALUES_PER_BIN: usize = 32;
/// Number of brightness bins.
const BINS: usize = 256 / GRAY_VALUES_PER_BIN;
/// Side of the blocks that noise is measured in, in px.
const BLOCK_SIZE: usize = 8;
/// Fraction of the blocks of a bin that are assumed to be without texture: the estimate is this quantile.
const FLAT_FRACTION: f64 = 0.2;
/// Minimum number of blocks of a bin: with fewer the estimate over all bins stands in. With fewer blocks in
/// the whole image, noise cannot be told from texture and is assumed to be 0.
const MIN_BLOCKS: usize = 40;
/// Upper limit of a variance, in squared gray values: larger ones are texture.
const MAX_VARIANCE: f32 = 6.25;
/// Mean gray values of usable blocks: in darker and brighter ones clipping hides the noise.
const UNCLIPPED: Range<f32> = 4.0..250.0;
/// Gain of the filter of [`Noise::estimate`] on white noise: the root of the sum of its squared weights.
const FILTER_GAIN: f32 = 6.0;

/// Variance of the noise per brightness bin, in squared gray values (0 to 255).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Noise([f32; BINS]);

impl Noise {
    /// Estimates the noise from the flattest blocks, with a filter to which linear gradients are 0
    /// (Immerkaer, "Fast noise variance estimation", 1996): the second difference along x of the second
    /// difference along y.
    pub(crate) fn estimate(picture: &Picture) -> Noise {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let gray = |x: usize, y: usize| i32::from(picture.gray()[y * width + x]);
        let mut deviations: [Vec<f32>; BINS] = Default::default();
        for top in (1..height.saturating_sub(BLOCK_SIZE)).step_by(BLOCK_SIZE) {
            for left in (1..width.saturating_sub(BLOCK_SIZE)).step_by(BLOCK_SIZE) {
                let (mut sum, mut filtered) = (0, 0);
                for y in top..top + BLOCK_SIZE {
                    for x in left..left + BLOCK_SIZE {
                        sum += gray(x, y);
                        let along_x = |y: usize| gray(x - 1, y) - 2 * gray(x, y) + gray(x + 1, y);
                        filtered += (along_x(y - 1) - 2 * along_x(y) + along_x(y + 1)).abs();
                    }
                }
                let pixels = (BLOCK_SIZE * BLOCK_SIZE) as f32;
                let mean = sum as f32 / pixels;
                if UNCLIPPED.contains(&mean) {
                    // The deviation of a normal distribution is sqrt(pi / 2) times its mean absolute value.
                    let deviation =
                        filtered as f32 / pixels * std::f32::consts::FRAC_PI_2.sqrt() / FILTER_GAIN;
                    deviations[mean as usize / GRAY_VALUES_PER_BIN].push(deviation);
                }
            }
        }
        let all: Vec<f32> = deviations.iter().flatten().copied().collect();
        if all.len() < MIN_BLOCKS {
            return Noise([0.0; BINS]);
        }
        Noise(deviations.map(|own| {
            let deviations = if own.len() < MIN_BLOCKS { all.clone() } else { own };
            flat_quantile(deviations).powi(2).min(MAX_VARIANCE)
        }))
    }

    /// Variance of the noise at a gray value.
    #[inline(always)]
    pub(crate) fn variance(&self, gray: u8) -> f32 {
        self.0[usize::from(gray) / GRAY_VALUES_PER_BIN]
    }
}

/// Standard deviation of the noise at a pixel, in gray values; 0 where it is not known.
pub(crate) fn deviation(image: &PackedImage, pixel: usize) -> f32 {
    let (x, y) = Grid { width: image.width, height: image.height }.position(pixel);
    image.noise.variance(image.gray(x, y)).sqrt()
}

/// The quantile of the deviations at [`FLAT_FRACTION`]; 0 of none.
fn flat_quantile(mut deviations: Vec<f32>) -> f32 {
    deviations.sort_unstable_by(f32::total_cmp);
    let index = (deviations.len() as f64 * FLAT_FRACTION) as usize;
    deviations.get(index).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ambc::Random;
    use crate::testing;

    fn picture((width, height): (u32, u32), gray: impl Fn(u32, u32) -> f32) -> Picture {
        let values = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let grays = values.map(|(x, y)| gray(x, y).round() as u8).collect();
        Picture::from_gray(width, height, grays).unwrap()
    }

    /// White noise of deviation 1, a function of the pixel.
    fn white(x: u32, y: u32) -> f32 {
        testing::white(&mut Random::new(5, u64::from(y) << 32 | u64::from(x)))
    }

    #[test]
    fn white_noise_on_a_linear_gradient_is_estimated() {
        for deviation in [1.0f32, 1.5, 2.0] {
            let slanted = |x, y| 50.0 + 0.7 * x as f32 + 0.5 * y as f32 + deviation * white(x, y);
            let noise = Noise::estimate(&picture((128, 128), slanted));
            for gray in [80, 120, 160] {
                let estimate = noise.variance(gray).sqrt();
                // The flattest blocks underestimate it a little.
                let ratio = estimate / deviation;
                assert!((0.8..1.05).contains(&ratio), "{estimate} instead of {deviation} at {gray}");
            }
        }
    }

    #[test]
    fn noise_is_estimated_per_brightness() {
        let halves = |x, y| if x < 64 { 50.0 + 0.5 * white(x, y) } else { 200.0 + 2.0 * white(x, y) };
        let noise = Noise::estimate(&picture((128, 128), halves));
        let [dark, bright] = [50, 200].map(|gray| noise.variance(gray).sqrt());
        assert!((dark - 0.5).abs() < 0.1 && (bright - 2.0).abs() < 0.3, "{dark} and {bright}");
    }

    #[test]
    fn smooth_gradients_are_not_noise() {
        let steep = picture((64, 64), |x, y| 5.0 + 2.0 * x as f32 + y as f32);
        let noise = Noise::estimate(&steep);
        assert!((0..=255).all(|gray| noise.variance(gray) == 0.0), "{noise:?}");
        let waves = |x: u32, y: u32| 128.0 + 60.0 * ((x as f32 / 9.0).sin() + (y as f32 / 11.0).cos());
        let noise = Noise::estimate(&picture((128, 128), waves));
        // What remains is the rounding to integers, of variance 1 / 12.
        assert!((0..=255).all(|gray| noise.variance(gray) < 0.15), "{noise:?}");
    }

    #[test]
    fn texture_in_half_of_the_image_does_not_bias_the_estimate() {
        let texture =
            |x, y| if x < 64 { 100.0 + 40.0 * white(x, y).clamp(-2.0, 2.0) } else { 100.0 + white(x, y) };
        let estimate = Noise::estimate(&picture((128, 128), texture)).variance(100).sqrt();
        assert!((estimate - 1.0).abs() < 0.25, "{estimate}");
    }

    #[test]
    fn uniform_and_very_small_images_have_no_noise() {
        for gray in [0.0, 3.0, 128.0, 255.0] {
            let noise = Noise::estimate(&picture((64, 48), |_, _| gray));
            assert!((0..=255).all(|gray| noise.variance(gray) == 0.0));
        }
        for size in [(1, 1), (1, 9), (9, 1), (2, 3), (8, 8), (9, 9), (64, 2), (9, 40)] {
            let noise = Noise::estimate(&picture(size, |x, y| 128.0 + 9.0 * white(x, y)));
            assert!((0..=255).all(|gray| noise.variance(gray) == 0.0), "{size:?}");
        }
        let smallest = Noise::estimate(&picture((66, 58), |x, y| 128.0 + white(x, y)));
        assert!(smallest.variance(128) > 0.0);
    }
}
