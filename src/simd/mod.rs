//! Instruction sets: one trait of eight lanes, one back-end each, chosen at run time.
//!
//! Every back-end multiplies, then adds, and reduces in the same tree, so all of them give the same bits. A back-end
//! is a zero-size token: owning one is the proof that the machine has its instructions. Code that runs on it is
//! generic over [`Simd`], `#[inline(always)]` throughout, and entered through [`Simd::vectorize`] once a tile.

mod baseline;
mod level;
mod scalar;
mod taps;
#[cfg(target_arch = "x86_64")]
mod x86_v3;

pub use baseline::Baseline;
pub use level::{SimdLevel, Task, dispatch};
pub use scalar::Scalar;
pub use taps::{SAMPLE_SCALE, SUBPIXEL_STEPS, Taps};
#[cfg(target_arch = "x86_64")]
pub use x86_v3::X86V3;

/// Lanes of every vector.
pub const LANES: usize = 8;

/// Eight lanes of f32 and what the kernels do with them.
pub trait Simd: Copy + Send + Sync {
    /// The level this back-end implements.
    const LEVEL: SimdLevel;
    /// Eight f32.
    type F32: Copy;
    /// Eight places in an image.
    type SamplePositions<'a>: Copy;

    /// All lanes the same.
    fn splat(self, value: f32) -> Self::F32;
    /// Lanes from memory.
    fn load(self, lanes: &[f32; LANES]) -> Self::F32;
    /// Lanes to memory.
    fn store(self, lanes: Self::F32) -> [f32; LANES];
    /// `a + b`
    fn add(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a - b`
    fn sub(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a * b`
    fn mul(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a / b`
    fn div(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a > b ? a : b`, so `b` where a lane is not a number.
    fn max(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a < b ? a : b`, so `b` where a lane is not a number.
    fn min(self, a: Self::F32, b: Self::F32) -> Self::F32;
    /// `a >= b` as bits, the first lane in the lowest; not where a lane is not a number.
    fn simd_ge(self, a: Self::F32, b: Self::F32) -> u8;
    /// `a` in the lanes whose bits are set, the first lane's the lowest; `b` in the others.
    fn select(self, bits: u8, a: Self::F32, b: Self::F32) -> Self::F32;
    /// The whole part of lanes in [0, 2^24).
    fn trunc(self, a: Self::F32) -> Self::F32;
    /// `y * stride + x` for whole, non-negative lanes, with a stride for each.
    fn linear_indices(self, strides: &[i32; LANES], x: Self::F32, y: Self::F32) -> [u32; LANES];
    /// Aims at places in 256ths of a pixel ([`SUBPIXEL_STEPS`]), of which only the whole ones count; the image repeats its border,
    /// and what is not a number is 0. Apart from [`Simd::sample_bilinear`], so that what takes long can be begun before it is needed.
    fn sample_positions<'a>(self, image: &'a Taps, x: Self::F32, y: Self::F32) -> Self::SamplePositions<'a>;
    /// The bilinear samples there. f 256ths between two pixels weigh `255 - f` to `f`, so a sample is a whole number: the
    /// gray value less 128, times 255 squared ([`SAMPLE_SCALE`]).
    fn sample_bilinear(self, aimed: Self::SamplePositions<'_>) -> Self::F32;
    /// The four taps, lowest byte first, that [`Simd::sample_bilinear`] reads for samples between these pairs and the next ones;
    /// an index beyond the last two pairs reads those. No more than reading: what sampling costs at least.
    fn gather(self, image: &Taps, pairs: &[u32; LANES]) -> [u32; LANES];
    /// Has what lies at an index of a slice, or about there, brought near: nothing that a result depends on.
    #[inline(always)]
    fn prefetch<T>(self, _slice: &[T], _index: usize) {}
    /// The sum of the lanes, as `((l0 + l4) + (l2 + l6)) + ((l1 + l5) + (l3 + l7))`.
    fn reduce_sum(self, a: Self::F32) -> f32;
    /// The largest lane; no lane may be anything else than a number.
    fn reduce_max(self, a: Self::F32) -> f32;
    /// The square root.
    fn sqrt(self, a: Self::F32) -> Self::F32;
    /// The sums of eight vectors, as [`Simd::reduce_sum`] adds them, one a lane.
    #[inline(always)]
    fn reduce_sum_8x8(self, vectors: &[Self::F32; LANES]) -> Self::F32 {
        self.load(&vectors.map(|vector| self.reduce_sum(vector)))
    }
    /// Runs `f` compiled for this instruction set. Only what is inlined into `f` profits.
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R;

    /// `a * b + c`, in two roundings.
    #[inline(always)]
    fn mul_add(self, a: Self::F32, b: Self::F32, c: Self::F32) -> Self::F32 {
        self.add(self.mul(a, b), c)
    }
}
