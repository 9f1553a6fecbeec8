//! Vectors of eight f32 lanes behind one trait, with one back-end per instruction set, chosen at run time.
//!
//! This module holds all architecture code of the crate. The kernels are written once, generic over [`Simd`],
//! and compiled once per back-end:
//!
//! | level | back-end | instructions |
//! |---|---|---|
//! | [`SimdLevel::Scalar`] | `scalar.rs` | plain f32 arithmetic, lane by lane; the oracle of the tests |
//! | [`SimdLevel::Baseline`] | `baseline.rs` | the crate `wide`: SSE2, NEON or wasm simd128 |
//! | [`SimdLevel::X86V3`] | `x86_v3.rs` | `core::arch` intrinsics: AVX2, BMI1, BMI2, POPCNT |
//!
//! # Same bits
//! Every back-end has [`LANES`] logical lanes, rounds after the multiplication and again after the addition,
//! and adds lanes in one fixed tree ([`Simd::reduce_sum`]). A result therefore has the same bits on every
//! level.
//!
//! # Tokens
//! A back-end is a zero-size value, and its methods take `self` by value. The constructor of the x86-64-v3
//! token is the only place that asks the CPU for its features, so owning a token is the proof that its
//! intrinsics may be executed. [`dispatch`] makes the token of a [`SimdLevel`] and runs a [`Task`] on it.
//!
//! # `vectorize`
//! `#[target_feature]` stands on one function per back-end, inside [`Simd::vectorize`]. A closure passed to
//! it is compiled for the back-end's instruction set, together with everything that is inlined into it.
//! Entering it is a function call that is never inlined. The outermost call is made once per tile or band of
//! an image. A nested one outlines long code that is called at several places, so that it is compiled once:
//! the cost of a hypothesis, for example. References and plain values may cross it, vectors should not.
//!
//! # Inlining
//! What is not inlined into the closure is compiled for the baseline of the target: it stays correct, but
//! passes vectors through memory and loses the speed of the back-end without a warning. Therefore, below
//! `vectorize`:
//!
//! - Every function that takes a token is `#[inline(always)]`; `#[inline]` is not enough. The closure that is
//!   passed to `vectorize` has the attribute too. Prefer a function to a closure that holds vector code.
//! - `#[target_feature]` on a generic function is no alternative: it cannot be combined with
//!   `#[inline(always)]`, and a generic function cannot choose its features by type.
//! - No `dyn`: a call through a table of functions is never inlined.
//! - No `f32::mul_add`: where the target lacks FMA it is a call into the C library, and its single rounding
//!   gives other bits. [`Simd::mul_add`] multiplies, then adds.
//! - No `?` inside the closure: the conversions and destructors that it calls are only `#[inline]`. Check
//!   arguments before `vectorize` and return plain values from it.
//! - No vectors of `wide` outside its back-end: inside a `#[target_feature]` function they stay SSE2 code.
//!
//! # Adding a back-end
//! 1. A file with a token type and `impl Simd` for it; `LEVEL` names a new variant of [`SimdLevel`].
//! 2. A constructor that returns `None` where the CPU lacks a feature, and a `vectorize` whose inner function
//!    enables exactly the features that the constructor has tested.
//! 3. The level in [`SimdLevel::ALL`], in `name`, in `best` and in [`dispatch`], in ascending order.
//! 4. `tests/simd.rs` and `tests/ncc.rs` then run on it without a change, and compare every operation with
//!    the scalar back-end bit by bit.

mod baseline;
mod level;
mod scalar;
mod taps;
#[cfg(target_arch = "x86_64")]
mod x86_v3;

pub(crate) use baseline::Baseline;
pub use level::{SimdLevel, Task, dispatch};
pub use scalar::Scalar;
pub use taps::{SAMPLE_SCALE, SUBPIXEL_STEPS, Taps};
#[cfg(target_arch = "x86_64")]
pub(crate) use x86_v3::X86V3;

/// Lanes of every vector, on every back-end.
pub const LANES: usize = 8;

/// The operations of the kernels on vectors of eight f32 lanes.
pub trait Simd: Copy + Send + Sync {
    /// The level that this back-end implements.
    const LEVEL: SimdLevel;
    /// A vector of eight f32 lanes.
    type F32: Copy;
    /// Eight sample positions in one image, see [`Simd::sample_positions`].
    type SamplePositions<'a>: Copy;

    /// A vector with `value` in every lane.
    fn splat(self, value: f32) -> Self::F32;
    /// Loads a vector from memory.
    fn load(self, lanes: &[f32; LANES]) -> Self::F32;
    /// Stores a vector to memory.
    fn store(self, lanes: Self::F32) -> [f32; LANES];
    /// `a + b`
    fn add(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a - b`
    fn sub(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a * b`
    fn mul(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a / b`
    fn div(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a > b ? a : b`; `b` in lanes where either is NaN.
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a < b ? a : b`; `b` in lanes where either is NaN.
    fn min(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a >= b` as a bit mask, lane 0 in the lowest bit; false in lanes where either is NaN.
    fn simd_ge(self, a: Self::F32, b: Self::F32) -> u8;
    /// `a` in the lanes whose bit of `mask` is set, `b` in the others; lane 0 has the lowest bit.
    fn select(self, mask: u8, a: Self::F32, b: Self::F32) -> Self::F32;
    /// Rounds towards zero. Lanes must lie in [0, 2^24).
    fn trunc(self, a: Self::F32) -> Self::F32;
    /// `y * stride + x` per lane, for integral, non-negative `x` and `y`.
    fn linear_indices(self, strides: &[i32; LANES], x: Self::F32, y: Self::F32) -> [u32; LANES];
    /// Clamps fixed-point coordinates (units of 1 / [`SUBPIXEL_STEPS`] px, truncated) to the image; NaN
    /// becomes 0.
    ///
    /// A step of its own, so that callers can compute positions long before they call
    /// [`Simd::sample_bilinear`].
    fn sample_positions<'a>(self, image: &'a Taps, x: Self::F32, y: Self::F32) -> Self::SamplePositions<'a>;
    /// The bilinear samples at these positions, each an integer: (gray value - 128) * [`SAMPLE_SCALE`].
    ///
    /// A fraction of f / 256 px weighs the two pixels by `255 - f` and `f`, so that weights fit into a byte.
    fn sample_bilinear(self, positions: Self::SamplePositions<'_>) -> Self::F32;
    /// Loads two neighboring pairs per lane, `pairs[index]` and `pairs[index + 1]`: the four bytes that
    /// [`Simd::sample_bilinear`] interpolates, top left in the lowest byte, then bottom left, top right,
    /// bottom right. Indices are clamped to the last pair but one.
    fn gather(self, image: &Taps, indices: &[u32; LANES]) -> [u32; LANES];
    /// Prefetches the cache line of `slice[index]`; a hint, any index is allowed.
    #[inline(always)]
    fn prefetch<T>(self, _slice: &[T], _index: usize) {}
    /// The sum of the lanes, in this order: `((l0 + l4) + (l2 + l6)) + ((l1 + l5) + (l3 + l7))`.
    fn reduce_sum(self, a: Self::F32) -> f32;
    /// The largest lane. No lane may be NaN.
    fn reduce_max(self, a: Self::F32) -> f32;
    /// The square root.
    fn sqrt(self, a: Self::F32) -> Self::F32;
    /// [`Simd::reduce_sum`] of eight vectors: lane i is the sum of `vectors[i]`.
    #[inline(always)]
    fn reduce_sum_8x8(self, vectors: &[Self::F32; LANES]) -> Self::F32 {
        self.load(&vectors.map(|vector| self.reduce_sum(vector)))
    }
    /// Runs `f`, compiled for this instruction set as far as it is inlined; see the rules of this module.
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R;

    /// `a * b + c`, rounded twice: after the product and after the sum.
    #[inline(always)]
    fn mul_add(self, a: Self::F32, b: Self::F32, c: Self::F32) -> Self::F32 {
        self.add(self.mul(a, b), c)
    }
}
