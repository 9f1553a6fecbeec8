//! Vectors of the compile target's baseline, by way of `wide`.

use super::{LANES, SUBPIXEL_STEPS, Scalar, Simd, SimdLevel, Taps};
use std::array::from_fn;
use wide::{f32x8, i32x8};

/// The baseline back-end: SSE2 on x86-64, NEON on AArch64, simd128 on wasm.
#[derive(Debug, Clone, Copy)]
pub struct Baseline;

/// Places in an image, in whole 256ths of a pixel.
#[derive(Debug, Clone, Copy)]
pub struct SamplePositions<'a> {
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
    fn select(self, bits: u8, a: f32x8, b: f32x8) -> f32x8 {
        f32x8::new(Scalar.select(bits, a.to_array(), b.to_array()))
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
        let (right, bottom) = image.last();
        let x = self.min(self.max(x, f32x8::ZERO), f32x8::splat(right)).trunc();
        let y = self.min(self.max(y, f32x8::ZERO), f32x8::splat(bottom)).trunc();
        SamplePositions { image, x, y }
    }

    // `wide` has no gather: lanes are read one by one. Samples are whole and below 2^24, so f32 holds them exactly in
    // whatever order they are worked out.
    #[inline(always)]
    fn sample_bilinear(self, SamplePositions { image, x, y }: SamplePositions) -> f32x8 {
        let part = f32x8::splat(1.0 / SUBPIXEL_STEPS);
        let (column, row) = ((x * part).trunc(), (y * part).trunc());
        let (part_x, part_y) =
            (x - column * f32x8::splat(SUBPIXEL_STEPS), y - row * f32x8::splat(SUBPIXEL_STEPS));
        let (columns, rows) = (column.to_array(), row.to_array());
        let pixels = image.pairs();
        let taps = i32x8::new(from_fn(|lane| {
            let index = rows[lane] as u32 as usize * image.stride() + columns[lane] as u32 as usize;
            let [[a, b], [c, d]] = [pixels[index], pixels[index + 1]];
            i32::from_le_bytes([a, b, c, d].map(|tap| tap as u8))
        }));
        // A tap comes from its byte by way of the highest one.
        let tap =
            |right: usize, low: usize| f32x8::from_i32x8(taps << (24 - 16 * right - 8 * low) as i32 >> 24);
        let all = f32x8::splat(255.0);
        let left = (all - part_y) * tap(0, 0) + part_y * tap(0, 1);
        let right = (all - part_y) * tap(1, 0) + part_y * tap(1, 1);
        (all - part_x) * left + part_x * right
    }

    #[inline(always)]
    fn gather(self, image: &Taps, pairs: &[u32; LANES]) -> [u32; LANES] {
        Scalar.gather(image, pairs)
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

    // A function of its own, as where instructions beyond the compile target's are used.
    #[inline(never)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        f()
    }
}
