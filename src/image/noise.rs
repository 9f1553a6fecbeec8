//! How strong the sensor noise of an image is: what varies no more than that is no texture.

use super::Picture;

/// Grey levels that share an estimate: noise depends on brightness.
const LEVELS: usize = 32;
/// Side of the blocks that are looked at, in pixels.
const BLOCK: usize = 8;
/// Share of the blocks of a brightness that are taken to be without texture.
const FLAT_SHARE: f64 = 0.2;
/// Fewer blocks of a brightness than this say little: those of all are taken.
const MIN_BLOCKS: usize = 40;
/// Variance beyond which it is not believed to be noise, in squared grey values.
const MAX_VARIANCE: f32 = 6.25;
/// Darker and brighter blocks are cut off, and with them the noise.
const BELIEVED: std::ops::Range<f32> = 4.0..250.0;

/// Variance of the noise by brightness, in squared grey values of 0 to 255.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise([f32; 256 / LEVELS]);

impl Noise {
    /// Estimates it from the flattest blocks, by a filter that takes away every plane of grey values (Immerkaer, "Fast
    /// noise variance estimation", 1996).
    pub fn of(picture: &Picture) -> Noise {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let grey = |x: usize, y: usize| i32::from(picture.grey()[y * width + x]);
        let mut blocks: [Vec<f32>; 256 / LEVELS] = Default::default();
        for top in (1..height.saturating_sub(BLOCK)).step_by(BLOCK) {
            for left in (1..width.saturating_sub(BLOCK)).step_by(BLOCK) {
                let (mut sum, mut filtered) = (0, 0);
                for y in top..top + BLOCK {
                    for x in left..left + BLOCK {
                        sum += grey(x, y);
                        let row = |y: usize| grey(x - 1, y) - 2 * grey(x, y) + grey(x + 1, y);
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
        Noise(std::array::from_fn(|level| {
            let own = if blocks[level].len() < MIN_BLOCKS { all.clone() } else { blocks[level].clone() };
            flattest(own).powi(2).min(MAX_VARIANCE)
        }))
    }

    /// The variance at this grey value.
    #[inline(always)]
    pub fn variance(&self, grey: u8) -> f32 {
        self.0[usize::from(grey) / LEVELS]
    }
}

fn flattest(mut deviations: Vec<f32>) -> f32 {
    deviations.sort_unstable_by(f32::total_cmp);
    let place = (deviations.len() as f64 * FLAT_SHARE) as usize;
    deviations.get(place).copied().unwrap_or(0.0)
}
