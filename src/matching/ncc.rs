//! Bilaterally weighted normalized cross-correlation (NCC) of a reference patch with its image in a source
//! view.

// This file is the innermost loop of the crate: with the default options a run computes some 150 to 200 patch
// costs per pixel. The computation is the textbook's, and small. For a reference pixel p, a window of offsets
// o, a source view and the homography H that the hypothesis (a plane) induces between the two images, in
// pseudo-code:
//
//     for o in window, if p + o lies in the reference image:
//         a[o] = reference[p + o]
//         w[o] = exp(-|o|^2 / (2 sigma_spatial^2)) * exp(-(a[o] - reference[p])^2 / (2 sigma_color^2))
//         // Positions outside the source image are clamped: its border is repeated.
//         b[o] = bilinear(source, H(p + o))
//     w = w / sum(w)
//     mean_a = sum(w * a),              mean_b = sum(w * b)
//     var_a  = sum(w * (a - mean_a)^2), var_b  = sum(w * (b - mean_b)^2)
//     cov    = sum(w * (a - mean_a) * (b - mean_b))
//     // Without texture there is no correlation.
//     if var_a < min_variance or var_b < min_variance:
//         return MAX_COST
//     return clamp(1 - cov / sqrt(var_a * var_b), 0, 2)
//
// A scalar loop that does just this takes 380 ns for a patch of 36 samples. The code below computes the same
// cost with five deviations: the second truncates sample positions to 1/256 px, the others change layout and
// order only, and rounding. Each says what it buys: in ns per patch, or as the time of a whole run with it
// over that without it.
//
// 1. Packed taps. The source image is not an array of gray values but of pairs of bytes, a pixel and the one
//    below it (`Taps`), so that one 32-bit load brings the 2 x 2 pixels of a bilinear sample. With AVX2 a
//    patch takes 47 ns, instead of 57 ns with four loads per sample from an f32 image of twice the size.
// 2. Fixed-point positions and integer weights. A sample position is truncated to 1/256 px, and its
//    fractions, one byte each, are the interpolation weights (f and 255 - f, of 255). AVX2 then interpolates
//    eight samples with two integer multiply-add instructions. A sample is an exact integer, 255^2 times
//    (gray value - 128), so that every back-end gives the same bits whatever the order of its operations.
//    Thresholds on samples are scaled by `SAMPLE_SCALE` instead of scaling the samples.
// 3. Mirrored halves. The window is ordered so that its vectors of eight offsets come in pairs, o and -o. The
//    homogeneous position of o is center + step and that of -o is center - step, so a pair computes its steps
//    once (`Warp::mirrored_positions`). 0.86 of the time, together with 2.
// 4. Positions computed one view ahead. A position needs a division, clamps and an address before its sample
//    can be loaded, a chain of long latencies; the sums need the samples. All positions of a patch are
//    computed before its first sample is loaded, and those of the next view before the sums of the current
//    one, so that the CPU overlaps the two (`correlate_views`). 0.94 of the time, the same bits.
// 5. Unrolled sizes. The loops over the vectors of a window are compiled for the windows in use: 2, 3 and 5
//    vectors (16, 24 and 36 samples). Deviation 4 needs it: the positions of a patch are an array, whose size
//    must be a constant. Any other window takes one loop (`correlate_any`), with the same sums in the same
//    order.
//
// The rest is the textbook's, but arranged differently:
//
// - The reference side is computed once per pixel (`ReferencePatch`), not per hypothesis: normalized weights,
//   and w * (a - mean_a) / sqrt(var_a), so that the correlation with a source is one dot product.
// - The sums of the source side are taken in a single pass about the mean of the reference, d = b - mean_a:
//   var_b = sum(w * d^2) - sum(w * d)^2, and cov = sum(w * (a - mean_a) * d), since w * (a - mean_a) adds up
//   to 0. Patches that match have similar means, so that the subtraction cancels few digits in f32; sums
//   about 0 lose the variance of patches of low contrast.
// - The three sums of up to eight views are reduced and turned into costs at once, a view per lane: 0.94 to
//   0.99 of the time.
// - Products and sums are rounded separately, and lanes are added in one fixed tree, so that all back-ends
//   give the same bits. It costs 11 %; FMA changes the bits of more than half of the patches.
// - The bilateral weight of a gray difference is looked up: there are 256 of them.
//
// Inlining: every function below that takes a `Simd` token is `#[inline(always)]`. The only
// `#[target_feature]` function is the one inside `Simd::vectorize`; what is not inlined into it is compiled
// for the baseline of the target and passes its vectors through memory. `#[target_feature]` cannot stand
// here, since the code is generic over the back-end. For the same reason: no `dyn`, no `?`, no `f32::mul_add`
// (a library call without FMA, and other bits), and functions rather than closures for vector code. The price
// is code size: a caller that evaluates hypotheses at several places should wrap the evaluation in a
// `vectorize` of its own, which is never inlined, so that the kernel exists once per back-end in the
// instruction cache (0.98 of the time).

use super::PatchHomography;
use super::warp::Warp;
use super::window::{Window, WindowVector};
use crate::image::PackedImage;
use crate::simd::{LANES, SAMPLE_SCALE, Simd};
use std::array::from_fn;

/// The largest cost, `1 - NCC` of opposite patches; also the cost of patches that cannot be compared.
pub const MAX_COST: f32 = 2.0;

/// Vectors of the largest window. The sides of a patch are arrays of this size: matching allocates nothing.
const MAX_VECTORS: usize = (2 * Window::MAX_RADIUS as usize + 1).pow(2).div_ceil(LANES);

/// The reference side of the correlation, computed once per pixel.
#[derive(Debug, Clone)]
pub struct ReferencePatch {
    /// Vectors of the window.
    vectors: usize,
    /// `w`: weights, normalized to a sum of 1; 0 in unused lanes.
    weights: [[f32; LANES]; MAX_VECTORS],
    /// `w (a - mean) / sqrt(variance)`: factors of the source samples in the correlation.
    factors: [[f32; LANES]; MAX_VECTORS],
    /// Weighted mean of the gray values, minus 128.
    mean: f32,
    /// Weighted variance of the gray values.
    variance: f32,
}

impl ReferencePatch {
    /// A patch for this window, not sampled yet.
    pub fn new(window: &Window) -> ReferencePatch {
        let zeros = [[0.0; LANES]; MAX_VECTORS];
        ReferencePatch {
            vectors: window.vectors.len(),
            weights: zeros,
            factors: zeros,
            mean: 0.0,
            variance: 0.0,
        }
    }

    /// Whether the variance of the patch reaches the window's minimum.
    pub fn has_texture(&self, window: &Window) -> bool {
        self.variance >= window.min_variance
    }

    /// Weighted variance of the gray values, in squared gray values (0 to 255).
    pub fn variance(&self) -> f32 {
        self.variance
    }

    /// Samples the patch around pixel (x, y). Samples outside the image have weight 0.
    #[inline(always)]
    pub fn sample<S: Simd>(&mut self, simd: S, window: &Window, image: &PackedImage, x: usize, y: usize) {
        let (radius, stride) = (window.radius, image.taps.stride());
        let is_inside = x >= radius && y >= radius && x + radius < image.width && y + radius < image.height;
        let center = image.taps.pairs()[y * stride + x][0];
        let (mut total, mut sum) = (simd.splat(0.0), simd.splat(0.0));
        for (index, offsets) in window.vectors.iter().enumerate() {
            let (gray, weight) = if is_inside {
                let corner = ((y - radius) * stride + x - radius) as i32;
                let pair = |lane| (corner + offsets.row[lane] * stride as i32 + offsets.column[lane]) as u32;
                // The lowest of the four bytes is the gray value of the pixel itself.
                (simd.gather(&image.taps, &from_fn(pair)).map(|taps| taps as i8), offsets.weight)
            } else {
                offsets.samples_inside(image, (x, y), radius)
            };
            let color_weight: [f32; LANES] =
                from_fn(|lane| window.color_weights[usize::from(gray[lane].abs_diff(center))]);
            let gray = simd.load(&gray.map(f32::from));
            let weight = simd.mul(simd.load(&weight), simd.load(&color_weight));
            total = simd.add(total, weight);
            sum = simd.mul_add(weight, gray, sum);
            self.weights[index] = simd.store(weight);
            self.factors[index] = simd.store(gray);
        }
        // The total is 0 only where no sample lies in the image: the center need not be a sample.
        let scale = 1.0 / simd.reduce_sum(total).max(f32::MIN_POSITIVE);
        self.mean = simd.reduce_sum(sum) * scale;
        self.normalize(simd, scale);
    }

    /// The second pass of [`ReferencePatch::sample`]: turns weights and gray values into `w` and the factors.
    #[inline(always)]
    fn normalize<S: Simd>(&mut self, simd: S, scale: f32) {
        let (mean, scale) = (simd.splat(self.mean), simd.splat(scale));
        let mut squares = simd.splat(0.0);
        for (weight, factor) in self.weights[..self.vectors].iter_mut().zip(&mut self.factors) {
            let difference = simd.sub(simd.load(factor), mean);
            let normalized = simd.mul(simd.load(weight), scale);
            let product = simd.mul(normalized, difference);
            squares = simd.mul_add(product, difference, squares);
            *weight = simd.store(normalized);
            *factor = simd.store(product);
        }
        self.variance = simd.reduce_sum(squares);
        let inverse_deviation = simd.splat(1.0 / self.variance.max(f32::MIN_POSITIVE).sqrt());
        for factor in &mut self.factors[..self.vectors] {
            *factor = simd.store(simd.mul(simd.load(factor), inverse_deviation));
        }
    }
}

/// `1 - NCC` of the patch and its image in a source view, clamped to [0, 2]; [`MAX_COST`] where either side
/// has no texture. The border of the source image is repeated.
#[inline(always)]
pub fn patch_cost<S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    source: &PackedImage,
    homography: &PatchHomography,
) -> f32 {
    if !patch.has_texture(window) {
        return MAX_COST;
    }
    let [sum, squares, products] = correlate(simd, window, patch, source, homography);
    let (sum, squares, products) =
        (simd.reduce_sum(sum), simd.reduce_sum(squares), simd.reduce_sum(products));
    let variance = squares - sum * sum;
    // A NaN variance takes the second branch.
    if variance >= window.min_variance_of_samples() {
        (1.0 - products / variance.sqrt()).clamp(0.0, MAX_COST)
    } else {
        MAX_COST
    }
}

/// [`patch_cost`] in several source views, with the same bits: of `view(lane)` in the lanes whose bit of
/// `wanted` is set, [`MAX_COST`] in the others.
#[inline(always)]
pub fn patch_costs<'a, S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    view: impl FnMut(usize) -> (&'a PackedImage, PatchHomography),
    wanted: u8,
) -> [f32; LANES] {
    // Windows of 16, 24 and 36 samples are unrolled (deviation 5).
    let sums = match (window.pairs, window.vectors.len()) {
        (1, 2) => correlate_views::<S, 2>(simd, window, patch, view, wanted),
        (1, 3) => correlate_views::<S, 3>(simd, window, patch, view, wanted),
        (2, 5) => correlate_views::<S, 5>(simd, window, patch, view, wanted),
        _ => correlate_views_any(simd, window, patch, view, wanted),
    };
    let [sum, squares, products] =
        [simd.reduce_sum_8x8(&sums[0]), simd.reduce_sum_8x8(&sums[1]), simd.reduce_sum_8x8(&sums[2])];
    let variance = simd.sub(squares, simd.mul(sum, sum));
    let min_variance =
        if patch.has_texture(window) { window.min_variance_of_samples() } else { f32::INFINITY };
    let has_texture = simd.simd_ge(variance, simd.splat(min_variance));
    let ncc = simd.div(products, simd.sqrt(variance));
    let cost = simd.max(simd.sub(simd.splat(1.0), ncc), simd.splat(0.0));
    let cost = simd.store(simd.min(cost, simd.splat(MAX_COST)));
    from_fn(|lane| if has_texture >> lane & 1 != 0 { cost[lane] } else { MAX_COST })
}

/// The sums over the samples of one source view, not reduced yet, with d = sample - mean of the reference:
/// `sum(w d)`, `sum(w d^2)` and `sum(factor d)`. Units are those of [`SAMPLE_SCALE`].
type Sums<S> = [<S as Simd>::F32; 3];

/// The [`Sums`] of eight views: for each sum one vector per view.
type SumsOfViews<S> = [[<S as Simd>::F32; LANES]; 3];

/// The sums of the wanted views, for a window of any size, one view after the other.
#[inline(always)]
fn correlate_views_any<'a, S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    mut view: impl FnMut(usize) -> (&'a PackedImage, PatchHomography),
    wanted: u8,
) -> SumsOfViews<S> {
    let mut sums = [[simd.splat(0.0); LANES]; 3];
    let mut rest = wanted;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let (source, homography) = view(lane);
        let warp = Warp::new(simd, source, &homography);
        [sums[0][lane], sums[1][lane], sums[2][lane]] = correlate_any(simd, window, patch, &warp);
    }
    sums
}

/// The sums of the wanted views, for a window of `N` vectors, all of them mirrored pairs but the last of an
/// odd number. The positions in the next view are computed before the sums of the current one (deviation 4).
#[inline(always)]
fn correlate_views<'a, S: Simd, const N: usize>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    mut view: impl FnMut(usize) -> (&'a PackedImage, PatchHomography),
    wanted: u8,
) -> SumsOfViews<S> {
    let mut sums = [[simd.splat(0.0); LANES]; 3];
    if wanted == 0 {
        return sums;
    }
    let mut lane = wanted.trailing_zeros() as usize % LANES;
    let mut rest = wanted & (wanted - 1);
    let (source, homography) = view(lane);
    let mut current: [S::SamplePositions<'a>; N] =
        patch_positions(simd, window, &Warp::new(simd, source, &homography));
    while rest != 0 {
        let next_lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let (source, homography) = view(next_lane);
        let next = patch_positions(simd, window, &Warp::new(simd, source, &homography));
        [sums[0][lane], sums[1][lane], sums[2][lane]] = sums_at(simd, patch, current);
        (current, lane) = (next, next_lane);
    }
    [sums[0][lane], sums[1][lane], sums[2][lane]] = sums_at(simd, patch, current);
    sums
}

/// The sample positions of a window of `N` vectors, all of them mirrored pairs but the last of an odd number.
#[inline(always)]
fn patch_positions<'a, S: Simd, const N: usize>(
    simd: S,
    window: &Window,
    warp: &Warp<'a, S>,
) -> [S::SamplePositions<'a>; N] {
    // Placeholders: all elements are set below.
    let mut all = [warp.center_position(simd); N];
    let vectors: &[WindowVector; N] = window.vectors[..].try_into().expect("the window has N vectors");
    for pair in 0..N / 2 {
        let offsets = &vectors[2 * pair];
        let both = warp.mirrored_positions(simd, simd.load(&offsets.x), simd.load(&offsets.y));
        [all[2 * pair], all[2 * pair + 1]] = both;
    }
    if N % 2 == 1 {
        let offsets = &vectors[N - 1];
        all[N - 1] = warp.positions(simd, simd.load(&offsets.x), simd.load(&offsets.y));
    }
    all
}

/// The sums over the samples at these positions.
#[inline(always)]
fn sums_at<S: Simd, const N: usize>(
    simd: S,
    patch: &ReferencePatch,
    positions: [S::SamplePositions<'_>; N],
) -> Sums<S> {
    let mean = simd.splat(patch.mean * SAMPLE_SCALE);
    let mut sums = [simd.splat(0.0); 3];
    for (positions, side) in positions.into_iter().zip(patch.weights.iter().zip(&patch.factors)) {
        sums = add_samples(simd, sums, side, simd.sub(simd.sample_bilinear(positions), mean));
    }
    sums
}

/// The sums of one source view.
#[inline(always)]
fn correlate<S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    source: &PackedImage,
    homography: &PatchHomography,
) -> Sums<S> {
    let warp = Warp::new(simd, source, homography);
    match (window.pairs, window.vectors.len()) {
        (1, 2) => sums_at::<S, 2>(simd, patch, patch_positions(simd, window, &warp)),
        (1, 3) => sums_at::<S, 3>(simd, patch, patch_positions(simd, window, &warp)),
        (2, 5) => sums_at::<S, 5>(simd, patch, patch_positions(simd, window, &warp)),
        _ => correlate_any(simd, window, patch, &warp),
    }
}

/// The sums of one source view, for a window of any size.
#[inline(always)]
fn correlate_any<S: Simd>(simd: S, window: &Window, patch: &ReferencePatch, warp: &Warp<S>) -> Sums<S> {
    let mean = simd.splat(patch.mean * SAMPLE_SCALE);
    let mut sums = [simd.splat(0.0); 3];
    let mut sides = patch.weights.iter().zip(&patch.factors);
    let (mirrored, rest) = window.vectors.split_at(2 * window.pairs);
    let (pairs, _) = mirrored.as_chunks::<2>();
    for [offsets, _] in pairs {
        let both = warp.mirrored_positions(simd, simd.load(&offsets.x), simd.load(&offsets.y));
        for (positions, side) in both.into_iter().zip(&mut sides) {
            sums = add_samples(simd, sums, side, simd.sub(simd.sample_bilinear(positions), mean));
        }
    }
    for (offsets, side) in rest.iter().zip(sides) {
        let positions = warp.positions(simd, simd.load(&offsets.x), simd.load(&offsets.y));
        sums = add_samples(simd, sums, side, simd.sub(simd.sample_bilinear(positions), mean));
    }
    sums
}

/// Adds one vector of samples, given as differences to the mean of the reference, to the sums.
#[inline(always)]
fn add_samples<S: Simd>(
    simd: S,
    [sum, squares, products]: Sums<S>,
    (weight, factor): (&[f32; LANES], &[f32; LANES]),
    difference: S::F32,
) -> Sums<S> {
    let weighted = simd.mul(simd.load(weight), difference);
    [
        simd.add(sum, weighted),
        simd.mul_add(weighted, difference, squares),
        simd.mul_add(simd.load(factor), difference, products),
    ]
}
