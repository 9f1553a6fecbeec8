//! How strong the sensor noise of an image is: what varies no more than that is no texture.

use super::Picture;

/// Gray levels that share an estimate: noise depends on brightness.
const LEVELS: usize = 32;
/// Side of the blocks that are looked at, in pixels.
const BLOCK: usize = 8;
/// Share of the blocks of a brightness that are taken to be without texture.
const FLAT_SHARE: f64 = 0.2;
/// Fewer blocks of a brightness than this say little: those of all are taken. With fewer than this in all, nothing tells
/// noise from texture, and none is assumed.
const MIN_BLOCKS: usize = 40;
/// Variance beyond which it is not believed to be noise, in squared gray values.
const MAX_VARIANCE: f32 = 6.25;
/// Darker and brighter blocks are cut off, and with them the noise.
const BELIEVED: std::ops::Range<f32> = 4.0..250.0;

/// Variance of the noise by brightness, in squared gray values of 0 to 255.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise([f32; 256 / LEVELS]);

impl Noise {
    /// Estimates it from the flattest blocks, by a filter that takes away every plane of gray values (Immerkaer, "Fast
    /// noise variance estimation", 1996).
    pub fn of(picture: &Picture) -> Noise {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let gray = |x: usize, y: usize| i32::from(picture.gray()[y * width + x]);
        let mut blocks: [Vec<f32>; 256 / LEVELS] = Default::default();
        for top in (1..height.saturating_sub(BLOCK)).step_by(BLOCK) {
            for left in (1..width.saturating_sub(BLOCK)).step_by(BLOCK) {
                let (mut sum, mut filtered) = (0, 0);
                for y in top..top + BLOCK {
                    for x in left..left + BLOCK {
                        sum += gray(x, y);
                        let row = |y: usize| gray(x - 1, y) - 2 * gray(x, y) + gray(x + 1, y);
                        filtered += (row(y - 1) - 2 * row(y) + row(y + 1)).abs();
                    }
                }
                let pixels = (BLOCK * BLOCK) as f32;
                let mean = sum as f32 / pixels;
                if BELIEVED.contains(&mean) {
                    // The filter multiplies the deviation by 6; sqrt(pi / 2) turns mean absolute values into it.
                    let deviation = filtered as f32 / pixels * std::f32::consts::FRAC_PI_2.sqrt() / 6.0;
                    blocks[mean as usize / LEVELS].push(deviation);
                }
            }
        }
        let all: Vec<f32> = blocks.iter().flatten().copied().collect();
        if all.len() < MIN_BLOCKS {
            return Noise([0.0; 256 / LEVELS]);
        }
        Noise(std::array::from_fn(|level| {
            let own = if blocks[level].len() < MIN_BLOCKS { all.clone() } else { blocks[level].clone() };
            flattest(own).powi(2).min(MAX_VARIANCE)
        }))
    }

    /// The variance at this gray value.
    #[inline(always)]
    pub fn variance(&self, gray: u8) -> f32 {
        self.0[usize::from(gray) / LEVELS]
    }
}

fn flattest(mut deviations: Vec<f32>) -> f32 {
    deviations.sort_unstable_by(f32::total_cmp);
    let place = (deviations.len() as f64 * FLAT_SHARE) as usize;
    deviations.get(place).copied().unwrap_or(0.0)
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

    /// The same for the same pixel.
    fn white(x: u32, y: u32) -> f32 {
        testing::white(&mut Random::new(5, u64::from(y) << 32 | u64::from(x)))
    }

    #[test]
    fn white_noise_on_a_plane_of_gray_values_is_estimated_by_its_deviation() {
        for deviation in [1.0f32, 1.5, 2.0] {
            let slanted = |x, y| 50.0 + 0.7 * x as f32 + 0.5 * y as f32 + deviation * white(x, y);
            let noise = Noise::of(&picture((128, 128), slanted));
            for gray in [80, 120, 160] {
                let found = noise.variance(gray).sqrt();
                // The flattest blocks understate it a little.
                let share = found / deviation;
                assert!((0.8..1.05).contains(&share), "{found} instead of {deviation} at {gray}");
            }
        }
    }

    #[test]
    fn each_brightness_has_its_own_noise() {
        let halves = |x, y| if x < 64 { 50.0 + 0.5 * white(x, y) } else { 200.0 + 2.0 * white(x, y) };
        let noise = Noise::of(&picture((128, 128), halves));
        let [dark, bright] = [50, 200].map(|gray| noise.variance(gray).sqrt());
        assert!((dark - 0.5).abs() < 0.1 && (bright - 2.0).abs() < 0.3, "{dark} and {bright}");
    }

    #[test]
    fn strong_smooth_gradients_are_no_noise() {
        let steep = picture((64, 64), |x, y| 5.0 + 2.0 * x as f32 + y as f32);
        let noise = Noise::of(&steep);
        assert!((0..=255).all(|gray| noise.variance(gray) == 0.0), "{noise:?}");
        let waves = |x: u32, y: u32| 128.0 + 60.0 * ((x as f32 / 9.0).sin() + (y as f32 / 11.0).cos());
        let noise = Noise::of(&picture((128, 128), waves));
        // Nothing but the rounding to whole gray values, of variance 1 / 12.
        assert!((0..=255).all(|gray| noise.variance(gray) < 0.15), "{noise:?}");
    }

    #[test]
    fn half_an_image_of_texture_does_not_hide_the_noise_of_the_other_half() {
        let texture =
            |x, y| if x < 64 { 100.0 + 40.0 * white(x, y).clamp(-2.0, 2.0) } else { 100.0 + white(x, y) };
        let found = Noise::of(&picture((128, 128), texture)).variance(100).sqrt();
        assert!((found - 1.0).abs() < 0.25, "{found}");
    }

    #[test]
    fn an_image_without_noise_and_one_too_small_to_tell_have_none() {
        for gray in [0.0, 3.0, 128.0, 255.0] {
            let noise = Noise::of(&picture((64, 48), |_, _| gray));
            assert!((0..=255).all(|gray| noise.variance(gray) == 0.0));
        }
        for size in [(1, 1), (1, 9), (9, 1), (2, 3), (8, 8), (9, 9), (64, 2), (9, 40)] {
            let noise = Noise::of(&picture(size, |x, y| 128.0 + 9.0 * white(x, y)));
            assert!((0..=255).all(|gray| noise.variance(gray) == 0.0), "{size:?}");
        }
        let smallest = Noise::of(&picture((66, 58), |x, y| 128.0 + white(x, y)));
        assert!(smallest.variance(128) > 0.0);
    }
}
