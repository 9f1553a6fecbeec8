//! The x86-64-v3 back-end: AVX2 through `core::arch`. The vectors of `wide` would stay SSE2 code inside a
//! `#[target_feature]` function.
#![allow(unsafe_code)]

use super::{LANES, Simd, SimdLevel, Taps};
use core::arch::x86_64::*;

/// The token of the AVX2 back-end. Owning one proves that the CPU has AVX2, BMI1, BMI2 and POPCNT.
#[derive(Debug, Clone, Copy)]
pub(crate) struct X86V3(());

/// Eight positions in an image, clamped and truncated, in units of 1/256 px, and the indices of their top
/// left pairs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SamplePositions<'a> {
    image: &'a Taps,
    x: __m256i,
    y: __m256i,
    /// Each is followed by another pair of the image.
    index: __m256i,
}

impl X86V3 {
    /// The token, or `None` where the CPU lacks one of the four features.
    pub(crate) fn new() -> Option<X86V3> {
        let has_all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("popcnt");
        has_all.then_some(X86V3(()))
    }

    /// Loads the pairs at these indices and their successors, four bytes per lane. Eight scalar loads instead
    /// of a gather instruction, which microcode updates have slowed down on Intel CPUs and which gains
    /// nothing on Zen 3.
    ///
    /// # Safety
    /// Every index must be smaller than that of the image's last pair.
    #[inline(always)]
    unsafe fn load_pairs(self, image: &Taps, indices: __m256i) -> __m256i {
        // SAFETY: `self` proves AVX2. By contract two pairs, four bytes, lie at each index; the load is an
        // unaligned one.
        unsafe {
            let (low, high) = (_mm256_castsi256_si128(indices), _mm256_extracti128_si256::<1>(indices));
            let load = |index: u64| image.pairs().as_ptr().add(index as usize).cast::<i32>().read_unaligned();
            // Two 32-bit indices per 64-bit register: half as many moves out of the vector unit.
            let (a, b) = (_mm_cvtsi128_si64(low) as u64, _mm_extract_epi64::<1>(low) as u64);
            let (c, d) = (_mm_cvtsi128_si64(high) as u64, _mm_extract_epi64::<1>(high) as u64);
            let first = |both: u64| load(both & 0xffff_ffff);
            let second = |both: u64| load(both >> 32);
            _mm256_setr_epi32(
                first(a),
                second(a),
                first(b),
                second(b),
                first(c),
                second(c),
                first(d),
                second(d),
            )
        }
    }

    /// `l0 + l4, l1 + l5, l2 + l6, l3 + l7` of `a` in the lower half, of `b` in the upper one.
    #[inline(always)]
    fn add_halves(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_add_ps(_mm256_permute2f128_ps::<0x20>(a, b), _mm256_permute2f128_ps::<0x31>(a, b)) }
    }

    /// Per half: `l0 + l2, l1 + l3` of `a`, then of `b`.
    #[inline(always)]
    fn add_pairs(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe {
            let (a, b) = (_mm256_castps_pd(a), _mm256_castps_pd(b));
            let (low, high) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            _mm256_add_ps(_mm256_castpd_ps(low), _mm256_castpd_ps(high))
        }
    }
}

// Every `unsafe` block below calls AVX or AVX2 intrinsics, whose precondition is that the CPU has them.
// SAFETY (of each block): `self` proves AVX2, since only `X86V3::new` makes a token. Further conditions stand
// with the block.
impl Simd for X86V3 {
    const LEVEL: SimdLevel = SimdLevel::X86V3;
    type F32 = __m256;
    type SamplePositions<'a> = SamplePositions<'a>;

    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_set1_ps(value) }
    }

    #[inline(always)]
    fn load(self, lanes: &[f32; LANES]) -> __m256 {
        // SAFETY: `self` proves AVX; the array holds the eight f32 of an unaligned load.
        unsafe { _mm256_loadu_ps(lanes.as_ptr()) }
    }

    #[inline(always)]
    fn store(self, lanes: __m256) -> [f32; LANES] {
        let mut array = [0.0; LANES];
        // SAFETY: `self` proves AVX; the array holds the eight f32 of an unaligned store.
        unsafe { _mm256_storeu_ps(array.as_mut_ptr(), lanes) };
        array
    }

    #[inline(always)]
    fn add(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_mul_ps(a, b) }
    }

    #[inline(always)]
    fn div(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_div_ps(a, b) }
    }

    // The instructions of `max` and `min` return the second operand where a lane is NaN.
    #[inline(always)]
    fn max(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_max_ps(a, b) }
    }

    #[inline(always)]
    fn min(self, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_min_ps(a, b) }
    }

    #[inline(always)]
    fn simd_ge(self, a: __m256, b: __m256) -> u8 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(a, b)) as u8 }
    }

    #[inline(always)]
    fn select(self, mask: u8, a: __m256, b: __m256) -> __m256 {
        // SAFETY: `self` proves AVX2.
        unsafe {
            let lane_bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(i32::from(mask)), lane_bits);
            _mm256_blendv_ps(b, a, _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane_bits)))
        }
    }

    #[inline(always)]
    fn trunc(self, a: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_round_ps::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(a) }
    }

    #[inline(always)]
    fn linear_indices(self, strides: &[i32; LANES], x: __m256, y: __m256) -> [u32; LANES] {
        let mut indices = [0; LANES];
        // SAFETY: `self` proves AVX2; both arrays hold the eight 32-bit integers of an unaligned load or
        // store.
        unsafe {
            let strides = _mm256_loadu_si256(strides.as_ptr().cast());
            let row = _mm256_mullo_epi32(_mm256_cvttps_epi32(y), strides);
            let index = _mm256_add_epi32(row, _mm256_cvttps_epi32(x));
            _mm256_storeu_si256(indices.as_mut_ptr().cast(), index);
        }
        indices
    }

    #[inline(always)]
    fn sample_positions<'a>(self, image: &'a Taps, x: __m256, y: __m256) -> SamplePositions<'a> {
        let (right, bottom) = image.max_position();
        // SAFETY: `self` proves AVX2. For the invariant of `index`: coordinates are clamped to [0, right] and
        // [0, bottom], NaN to 0 by `max`, so every index is that of a pair of `image` with a successor (see
        // `Taps`).
        unsafe {
            let zero = _mm256_setzero_ps();
            let x = _mm256_cvttps_epi32(_mm256_min_ps(_mm256_max_ps(x, zero), _mm256_set1_ps(right)));
            let y = _mm256_cvttps_epi32(_mm256_min_ps(_mm256_max_ps(y, zero), _mm256_set1_ps(bottom)));
            let stride = _mm256_set1_epi32(image.stride() as i32);
            let row = _mm256_mullo_epi32(_mm256_srli_epi32::<8>(y), stride);
            SamplePositions { image, x, y, index: _mm256_add_epi32(row, _mm256_srli_epi32::<8>(x)) }
        }
    }

    #[inline(always)]
    fn sample_bilinear(self, SamplePositions { image, x, y, index }: SamplePositions) -> __m256 {
        // SAFETY: `self` proves AVX2. Only `sample_positions` makes a `SamplePositions`, so every index is
        // that of a pair of this image with a successor, as `load_pairs` requires.
        unsafe {
            let taps = self.load_pairs(image, index);
            // The lowest byte f of a coordinate is the weight of the bottom or right taps, 255 - f that of
            // the top or left ones; 255 - f is f with all bits inverted.
            let byte_four_times = _mm256_setr_epi8(
                0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12, //
                0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12,
            );
            let byte_twice_as_i16 = _mm256_setr_epi8(
                0, -1, 0, -1, 4, -1, 4, -1, 8, -1, 8, -1, 12, -1, 12, -1, //
                0, -1, 0, -1, 4, -1, 4, -1, 8, -1, 8, -1, 12, -1, 12, -1,
            );
            let weights_y = _mm256_shuffle_epi8(y, byte_four_times);
            let weights_y = _mm256_xor_si256(weights_y, _mm256_set1_epi32(0x00ff_00ff));
            let weights_x = _mm256_shuffle_epi8(x, byte_twice_as_i16);
            let weights_x = _mm256_xor_si256(weights_x, _mm256_set1_epi32(0xff));
            // No i16 saturates: the weights of a pair add up to 255, and a tap is at least -128.
            let left_and_right = _mm256_maddubs_epi16(weights_y, taps);
            _mm256_cvtepi32_ps(_mm256_madd_epi16(left_and_right, weights_x))
        }
    }

    #[inline(always)]
    fn gather(self, image: &Taps, indices: &[u32; LANES]) -> [u32; LANES] {
        let mut taps = [0; LANES];
        // SAFETY: `self` proves AVX2; both arrays hold the eight 32-bit integers of an unaligned load or
        // store. Each index is clamped, as unsigned, to the last pair but one, as `load_pairs` requires.
        unsafe {
            let last = _mm256_set1_epi32((image.pairs().len() - 2) as i32);
            let index = _mm256_min_epu32(_mm256_loadu_si256(indices.as_ptr().cast()), last);
            _mm256_storeu_si256(taps.as_mut_ptr().cast(), self.load_pairs(image, index));
        }
        taps
    }

    #[inline(always)]
    fn prefetch<T>(self, slice: &[T], index: usize) {
        // SAFETY: a prefetch accesses no memory and is defined for any address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(slice.as_ptr().wrapping_add(index).cast()) };
    }

    #[inline(always)]
    fn reduce_sum(self, a: __m256) -> f32 {
        // SAFETY: `self` proves AVX.
        unsafe {
            let four = _mm_add_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
            let two = _mm_add_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }

    #[inline(always)]
    fn reduce_max(self, a: __m256) -> f32 {
        // SAFETY: `self` proves AVX.
        unsafe {
            let four = _mm_max_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps::<1>(a));
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }

    #[inline(always)]
    fn sqrt(self, a: __m256) -> __m256 {
        // SAFETY: `self` proves AVX.
        unsafe { _mm256_sqrt_ps(a) }
    }

    // The tree of `reduce_sum`, for eight vectors at once.
    #[inline(always)]
    fn reduce_sum_8x8(self, vectors: &[__m256; LANES]) -> __m256 {
        let [a, b, c, d, e, f, g, h] = *vectors;
        let (ab, cd) = (self.add_halves(a, b), self.add_halves(c, d));
        let (ef, gh) = (self.add_halves(e, f), self.add_halves(g, h));
        let (abcd, efgh) = (self.add_pairs(ab, cd), self.add_pairs(ef, gh));
        // SAFETY: `self` proves AVX2.
        unsafe {
            let even = _mm256_shuffle_ps::<0b10_00_10_00>(abcd, efgh);
            let odd = _mm256_shuffle_ps::<0b11_01_11_01>(abcd, efgh);
            // The sums of a, c, e, g, b, d, f, h.
            _mm256_permutevar8x32_ps(_mm256_add_ps(even, odd), _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7))
        }
    }

    #[inline(always)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        #[target_feature(enable = "avx2,bmi1,bmi2,popcnt")]
        fn with_avx2<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        // SAFETY: `self` proves the four features: `X86V3::new` has tested them.
        unsafe { with_avx2(f) }
    }
}
