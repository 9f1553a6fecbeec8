//! Vectors of the compile target's baseline, by way of `wide`.

use super::{LANES, Level, Scalar, Simd};
use wide::f32x8;

/// The baseline back-end: SSE2 on x86-64, NEON on AArch64, simd128 on wasm.
#[derive(Debug, Clone, Copy)]
pub struct Base;

impl Simd for Base {
    const LEVEL: Level = Level::Base;
    type F32 = f32x8;

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
    fn at_least(self, a: f32x8, b: f32x8) -> u8 {
        a.simd_ge(b).to_bitmask() as u8
    }

    #[inline(always)]
    fn select(self, bits: u8, a: f32x8, b: f32x8) -> f32x8 {
        f32x8::new(Scalar.select(bits, a.to_array(), b.to_array()))
    }

    #[inline(always)]
    fn whole(self, a: f32x8) -> f32x8 {
        a.trunc()
    }

    #[inline(always)]
    fn places(self, strides: &[i32; LANES], x: f32x8, y: f32x8) -> [u32; LANES] {
        Scalar.places(strides, x.to_array(), y.to_array())
    }

    // `wide` has no gather: lanes are read one by one.
    #[inline(always)]
    fn gather_bytes(self, pairs: &[u16], stride: usize, x: f32x8, y: f32x8) -> [f32x8; 4] {
        Scalar.gather_bytes(pairs, stride, x.to_array(), y.to_array()).map(f32x8::new)
    }

    #[inline(always)]
    fn look_up(self, table: &[f32; 256], a: f32x8) -> f32x8 {
        f32x8::new(Scalar.look_up(table, a.to_array()))
    }

    #[inline(always)]
    fn sum(self, a: f32x8) -> f32 {
        Scalar.sum(a.to_array())
    }

    #[inline(always)]
    fn largest(self, a: f32x8) -> f32 {
        Scalar.largest(a.to_array())
    }

    #[inline(always)]
    fn sqrt(self, a: f32x8) -> f32x8 {
        a.sqrt()
    }

    #[inline(always)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        f()
    }
}
