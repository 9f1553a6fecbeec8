//! The baseline back-end: vectors of the compile target's baseline, from the crate `wide`.

use super::{LANES, SUBPIXEL_STEPS, Scalar, Simd, SimdLevel, Taps};
use std::array::from_fn;
use wide::{f32x8, i32x8};

/// The token of the baseline back-end: SSE2 on x86-64, NEON on AArch64, simd128 on wasm.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Baseline;

/// Eight positions in an image, clamped and truncated, in units of 1/256 px.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SamplePositions<'a> {
    image: &'a Taps,
    x: f32x8,
    y: f32x8,
}

impl Simd for Baseline {
    const LEVEL: SimdLevel = SimdLevel::Baseline;
    type F32 = f32x8;
    type SamplePositions<'a> = SamplePositions<'a>;

    #[inline(always)]
    fn splat(self, value: f32) -> f32x8 {
        f32x8::splat(value)
    }

    #[inline(always)]
    fn load(self, lanes: &[f32; LANES]) -> f32x8 {
        f32x8::new(*lanes)
    }

    #[inline(always)]
    fn store(self, lanes: f32x8) -> [f32; LANES] {
        lanes.to_array()
    }

    #[inline(always)]
    fn add(self, a: f32x8, b: f32x8) -> f32x8 {
        a + b
    }

    #[inline(always)]
    fn sub(self, a: f32x8, b: f32x8) -> f32x8 {
        a - b
    }

    #[inline(always)]
    fn mul(self, a: f32x8, b: f32x8) -> f32x8 {
        a * b
    }

    #[inline(always)]
    fn div(self, a: f32x8, b: f32x8) -> f32x8 {
        a / b
    }

    #[inline(always)]
    fn max(self, a: f32x8, b: f32x8) -> f32x8 {
        a.simd_gt(b).select(a, b)
    }

    #[inline(always)]
    fn min(self, a: f32x8, b: f32x8) -> f32x8 {
        a.simd_lt(b).select(a, b)
    }

    #[inline(always)]
    fn simd_ge(self, a: f32x8, b: f32x8) -> u8 {
        a.simd_ge(b).to_bitmask() as u8
    }

    #[inline(always)]
    fn select(self, mask: u8, a: f32x8, b: f32x8) -> f32x8 {
        f32x8::new(Scalar.select(mask, a.to_array(), b.to_array()))
    }

    #[inline(always)]
    fn trunc(self, a: f32x8) -> f32x8 {
        a.trunc()
    }

    #[inline(always)]
    fn linear_indices(self, strides: &[i32; LANES], x: f32x8, y: f32x8) -> [u32; LANES] {
        Scalar.linear_indices(strides, x.to_array(), y.to_array())
    }

    #[inline(always)]
    fn sample_positions<'a>(self, image: &'a Taps, x: f32x8, y: f32x8) -> SamplePositions<'a> {
        let (right, bottom) = image.max_position();
        let x = self.min(self.max(x, f32x8::ZERO), f32x8::splat(right)).trunc();
        let y = self.min(self.max(y, f32x8::ZERO), f32x8::splat(bottom)).trunc();
        SamplePositions { image, x, y }
    }

    // `wide` has no gather: lanes are loaded one by one. Every intermediate value is an integer below 2^24,
    // which f32 holds exactly, so the order of the operations does not change the result.
    #[inline(always)]
    fn sample_bilinear(self, SamplePositions { image, x, y }: SamplePositions) -> f32x8 {
        let (steps, step) = (f32x8::splat(SUBPIXEL_STEPS), f32x8::splat(1.0 / SUBPIXEL_STEPS));
        let (column, row) = ((x * step).trunc(), (y * step).trunc());
        let (fraction_x, fraction_y) = (x - column * steps, y - row * steps);
        let (columns, rows) = (column.to_array(), row.to_array());
        let pixels = image.pairs();
        let taps = i32x8::new(from_fn(|lane| {
            let index = rows[lane] as u32 as usize * image.stride() + columns[lane] as u32 as usize;
            let [[a, b], [c, d]] = [pixels[index], pixels[index + 1]];
            i32::from_le_bytes([a, b, c, d].map(|tap| tap as u8))
        }));
        // Shifting a tap's byte to the top and back sign-extends it.
        let tap = |x: i32, y: i32| f32x8::from_i32x8(taps << (24 - 16 * x - 8 * y) >> 24);
        let total = f32x8::splat(255.0);
        let left = (total - fraction_y) * tap(0, 0) + fraction_y * tap(0, 1);
        let right = (total - fraction_y) * tap(1, 0) + fraction_y * tap(1, 1);
        (total - fraction_x) * left + fraction_x * right
    }

    #[inline(always)]
    fn gather(self, image: &Taps, indices: &[u32; LANES]) -> [u32; LANES] {
        Scalar.gather(image, indices)
    }

    #[inline(always)]
    fn reduce_sum(self, a: f32x8) -> f32 {
        Scalar.reduce_sum(a.to_array())
    }

    #[inline(always)]
    fn reduce_max(self, a: f32x8) -> f32 {
        Scalar.reduce_max(a.to_array())
    }

    #[inline(always)]
    fn sqrt(self, a: f32x8) -> f32x8 {
        a.sqrt()
    }

    // Not inlined, so that this back-end has the same function boundary as those with `#[target_feature]`.
    #[inline(never)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        f()
    }
}
