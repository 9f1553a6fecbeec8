//! Random numbers as a function of where they are used, so that the result does not depend on the order of
//! work.

use glam::Vec3;

/// Draws for one visit of one pixel: a counter hashed with the run's seed, the view, scale, cycle and
/// iteration (all in `stream`) and the pixel. There is no shared state.
#[derive(Debug, Clone)]
pub(crate) struct Random {
    key: u64,
    draws: u64,
}

/// Hashes numbers into the name of a stream.
pub(crate) fn stream(parts: &[u64]) -> u64 {
    parts.iter().fold(0, |key, &part| mix(key ^ mix(part.wrapping_add(INCREMENT))))
}

/// The golden ratio in 64 bits: multiples of it are spread evenly.
const INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

/// A bijection that flips about half of the bits for every bit changed (splitmix64's finalizer).
#[inline(always)]
fn mix(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

impl Random {
    /// The draws of a pixel in a stream.
    #[inline(always)]
    pub(crate) fn new(stream: u64, pixel: u64) -> Random {
        Random { key: mix(stream ^ mix(pixel.wrapping_add(INCREMENT))), draws: 0 }
    }

    #[inline(always)]
    fn next(&mut self) -> u64 {
        self.draws = self.draws.wrapping_add(INCREMENT);
        mix(self.key.wrapping_add(self.draws))
    }

    /// Uniform in [0, 1).
    #[inline(always)]
    pub(crate) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 * (1.0 / (1u32 << 24) as f32)
    }

    /// `R(-1, 1)`: uniform in [-1, 1).
    #[inline(always)]
    pub(crate) fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }

    /// Uniform below `count`, which must not be 0.
    #[inline(always)]
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }

    /// Uniform over the unit vectors that face the camera along `ray` (Marsaglia's method).
    #[inline(always)]
    pub(crate) fn facing_normal(&mut self, ray: Vec3) -> Vec3 {
        // A point of the square lies in the disc with probability 0.785: 32 failures in a row do not happen.
        for _ in 0..32 {
            let (a, b) = (self.signed(), self.signed());
            let square = a * a + b * b;
            if square < 1.0 {
                let root = 2.0 * (1.0 - square).sqrt();
                let normal = Vec3::new(a * root, b * root, 1.0 - 2.0 * square);
                let facing = normal.dot(ray);
                if facing != 0.0 {
                    return if facing < 0.0 { normal } else { -normal };
                }
            }
        }
        -ray.normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_place_draws_the_same_numbers_and_another_place_others() {
        let draws = |stream, pixel| {
            let mut random = Random::new(stream, pixel);
            [random.unit(), random.unit(), random.unit()]
        };
        assert_eq!(draws(7, 3), draws(7, 3));
        assert_ne!(draws(7, 3), draws(7, 4));
        assert_ne!(draws(7, 3), draws(8, 3));
        assert_ne!(stream(&[1, 2]), stream(&[2, 1]));
    }

    #[test]
    fn draws_are_uniform_over_their_range() {
        let mut random = Random::new(stream(&[1]), 0);
        let mut bins = [0; 10];
        for _ in 0..100_000 {
            bins[(random.unit() * 10.0) as usize] += 1;
        }
        assert!(bins.iter().all(|&count| (9_500..10_500).contains(&count)), "{bins:?}");
        let mut faces = [0; 6];
        for _ in 0..60_000 {
            faces[random.below(6)] += 1;
        }
        assert!(faces.iter().all(|&count| (9_500..10_500).contains(&count)), "{faces:?}");
    }

    #[test]
    fn normals_cover_the_visible_hemisphere_evenly() {
        let ray = Vec3::new(0.3, -0.2, 1.0);
        let mut random = Random::new(stream(&[2]), 0);
        let mut mean = Vec3::ZERO;
        let count = 20_000;
        for _ in 0..count {
            let normal = random.facing_normal(ray);
            assert!(normal.dot(ray) < 0.0 && (normal.length() - 1.0).abs() < 1e-5);
            mean += normal / count as f32;
        }
        // The mean of a hemisphere of unit vectors is half its axis.
        assert!((mean + 0.5 * ray.normalize()).length() < 0.02, "{mean}");
    }
}
