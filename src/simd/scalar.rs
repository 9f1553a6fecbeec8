//! The scalar back-end: plain f32 arithmetic, lane by lane. The other back-ends are tested against it.

use super::{LANES, Simd, SimdLevel, Taps};
use std::array::from_fn;

/// The token of the scalar back-end.
#[derive(Debug, Clone, Copy)]
pub struct Scalar;

/// Eight positions in an image, clamped, in units of 1/256 px.
#[derive(Debug, Clone, Copy)]
pub struct SamplePositions<'a> {
    image: &'a Taps,
    x: [u32; LANES],
    y: [u32; LANES],
}

impl Simd for Scalar {
    const LEVEL: SimdLevel = SimdLevel::Scalar;
    type F32 = [f32; LANES];
    type SamplePositions<'a> = SamplePositions<'a>;

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F32 {
        [value; LANES]
    }

    #[inline(always)]
    fn load(self, lanes: &[f32; LANES]) -> Self::F32 {
        *lanes
    }

    #[inline(always)]
    fn store(self, lanes: Self::F32) -> [f32; LANES] {
        lanes
    }

    #[inline(always)]
    fn add(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        from_fn(|lane| a[lane] + b[lane])
    }

    #[inline(always)]
    fn sub(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        from_fn(|lane| a[lane] - b[lane])
    }

    #[inline(always)]
    fn mul(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        from_fn(|lane| a[lane] * b[lane])
    }

    #[inline(always)]
    fn div(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        from_fn(|lane| a[lane] / b[lane])
    }

    #[inline(always)]
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        from_fn(|lane| if a[lane] > b[lane] { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn min(self, a: Self::F32, b: Self::F32) -> Self::F32 {
        from_fn(|lane| if a[lane] < b[lane] { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn simd_ge(self, a: Self::F32, b: Self::F32) -> u8 {
        (0..LANES).fold(0, |bits, lane| bits | u8::from(a[lane] >= b[lane]) << lane)
    }

    #[inline(always)]
    fn select(self, mask: u8, a: Self::F32, b: Self::F32) -> Self::F32 {
        from_fn(|lane| if mask >> lane & 1 != 0 { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn trunc(self, a: Self::F32) -> Self::F32 {
        from_fn(|lane| a[lane] as i32 as f32)
    }

    #[inline(always)]
    fn linear_indices(self, strides: &[i32; LANES], x: Self::F32, y: Self::F32) -> [u32; LANES] {
        from_fn(|lane| (y[lane] as i32).wrapping_mul(strides[lane]).wrapping_add(x[lane] as i32) as u32)
    }

    #[inline(always)]
    fn sample_positions<'a>(self, image: &'a Taps, x: Self::F32, y: Self::F32) -> SamplePositions<'a> {
        let (right, bottom) = image.max_position();
        let x = self.min(self.max(x, [0.0; LANES]), [right; LANES]);
        let y = self.min(self.max(y, [0.0; LANES]), [bottom; LANES]);
        SamplePositions { image, x: x.map(|x| x as u32), y: y.map(|y| y as u32) }
    }

    #[inline(always)]
    fn sample_bilinear(self, SamplePositions { image, x, y }: SamplePositions) -> Self::F32 {
        from_fn(|lane| {
            let (x, y) = (x[lane], y[lane]);
            let index = (y >> 8) as usize * image.stride() + (x >> 8) as usize;
            let ([top_left, bottom_left], [top_right, bottom_right]) =
                (image.pairs()[index], image.pairs()[index + 1]);
            let interpolate =
                |fraction: u32, a: i32, b: i32| (255 - fraction as i32) * a + fraction as i32 * b;
            let left = interpolate(y & 0xff, top_left.into(), bottom_left.into());
            let right = interpolate(y & 0xff, top_right.into(), bottom_right.into());
            interpolate(x & 0xff, left, right) as f32
        })
    }

    #[inline(always)]
    fn gather(self, image: &Taps, indices: &[u32; LANES]) -> [u32; LANES] {
        indices.map(|index| {
            let index = (index as usize).min(image.pairs().len() - 2);
            let ([a, b], [c, d]) = (image.pairs()[index], image.pairs()[index + 1]);
            u32::from_le_bytes([a, b, c, d].map(|tap| tap as u8))
        })
    }

    #[inline(always)]
    fn reduce_sum(self, l: Self::F32) -> f32 {
        ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]))
    }

    #[inline(always)]
    fn reduce_max(self, a: Self::F32) -> f32 {
        a.into_iter().fold(f32::NEG_INFINITY, |largest, lane| if lane > largest { lane } else { largest })
    }

    #[inline(always)]
    fn sqrt(self, a: Self::F32) -> Self::F32 {
        a.map(f32::sqrt)
    }

    // Not inlined, so that the scalar back-end has the same function boundary as those with
    // `#[target_feature]`.
    #[inline(never)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        f()
    }
}
