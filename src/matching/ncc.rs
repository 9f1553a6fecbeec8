//! Bilaterally weighted normalized cross-correlation of a reference patch with its image in a source view.

use super::PatchHomography;
use super::warp::Warp;
use super::window::{Offsets, Window};
use crate::image::PackedImage;
use crate::simd::{LANES, SAMPLE_SCALE, Simd};
use std::array::from_fn;

/// The cost of patches that cannot be compared, and the highest there is.
pub const MAX_COST: f32 = 2.0;

/// Vectors of the largest window. Patches live on the stack: correlating allocates nothing.
const MAX_VECTORS: usize = (2 * Window::MAX_RADIUS as usize + 1).pow(2).div_ceil(LANES);

/// The reference's side of the correlation, once a pixel.
#[derive(Debug, Clone)]
pub struct ReferencePatch {
    vectors: usize,
    /// Weights, divided by their sum; as many vectors as the window has.
    weights: [[f32; LANES]; MAX_VECTORS],
    /// Weights times difference to the mean, divided by the standard deviation.
    weighted: [[f32; LANES]; MAX_VECTORS],
    /// Weighted mean of the gray values, less 128.
    mean: f32,
    /// Weighted variance of the gray values.
    variance: f32,
}

impl ReferencePatch {
    /// Room for a patch of this window.
    pub fn new(window: &Window) -> ReferencePatch {
        let zeros = [[0.0; LANES]; MAX_VECTORS];
        ReferencePatch {
            vectors: window.vectors.len(),
            weights: zeros,
            weighted: zeros,
            mean: 0.0,
            variance: 0.0,
        }
    }

    /// Whether the patch varies enough to be matched.
    pub fn has_texture(&self, window: &Window) -> bool {
        self.variance >= window.min_variance
    }

    /// Weighted variance of the gray values, in squared gray values of 0 to 255.
    pub fn variance(&self) -> f32 {
        self.variance
    }

    /// Samples the patch around a pixel. What lies outside the image weighs nothing.
    #[inline(always)]
    pub fn sample<S: Simd>(&mut self, simd: S, window: &Window, image: &PackedImage, x: usize, y: usize) {
        let (radius, stride) = (window.radius, image.taps.stride());
        let is_inside = x >= radius && y >= radius && x + radius < image.width && y + radius < image.height;
        let center = image.taps.pairs()[y * stride + x][0];
        let (mut total, mut sum) = (simd.splat(0.0), simd.splat(0.0));
        for (index, offsets) in window.vectors.iter().enumerate() {
            let (gray, weight) = if is_inside {
                let corner = ((y - radius) * stride + x - radius) as i32;
                let place = |lane| (corner + offsets.row[lane] * stride as i32 + offsets.column[lane]) as u32;
                // The lowest of a place's taps is the gray value there.
                (simd.gather(&image.taps, &from_fn(place)).map(|taps| taps as i8), offsets.weight)
            } else {
                offsets.of_those_inside(image, (x, y), radius)
            };
            let likeness: [f32; LANES] =
                from_fn(|lane| window.color_weights[usize::from(gray[lane].abs_diff(center))]);
            let gray = simd.load(&gray.map(f32::from));
            let weight = simd.mul(simd.load(&weight), simd.load(&likeness));
            total = simd.add(total, weight);
            sum = simd.mul_add(weight, gray, sum);
            self.weights[index] = simd.store(weight);
            self.weighted[index] = simd.store(gray);
        }
        // The center pixel's own neighbors weigh something unless the window is wider than the image.
        let scale = 1.0 / simd.reduce_sum(total).max(f32::MIN_POSITIVE);
        self.mean = simd.reduce_sum(sum) * scale;
        self.normalize(simd, scale);
    }

    #[inline(always)]
    fn normalize<S: Simd>(&mut self, simd: S, scale: f32) {
        let (mean, scale) = (simd.splat(self.mean), simd.splat(scale));
        let mut squares = simd.splat(0.0);
        for (weight, weighted) in self.weights[..self.vectors].iter_mut().zip(&mut self.weighted) {
            let difference = simd.sub(simd.load(weighted), mean);
            let share = simd.mul(simd.load(weight), scale);
            let product = simd.mul(share, difference);
            squares = simd.mul_add(product, difference, squares);
            *weight = simd.store(share);
            *weighted = simd.store(product);
        }
        self.variance = simd.reduce_sum(squares);
        let inverse_deviation = simd.splat(1.0 / self.variance.max(f32::MIN_POSITIVE).sqrt());
        for weighted in &mut self.weighted[..self.vectors] {
            *weighted = simd.store(simd.mul(simd.load(weighted), inverse_deviation));
        }
    }
}

/// `1 - NCC` of the patch and its image in a source view, clamped to [0, 2]; [`MAX_COST`] when either side has no
/// texture. Samples beyond the source's border repeat it.
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
    // Written so that a variance that is not a number has no texture.
    if variance >= window.min_variance_of_samples() {
        (1.0 - products / variance.sqrt()).clamp(0.0, MAX_COST)
    } else {
        MAX_COST
    }
}

/// The [`patch_cost`] in the source views of the lanes whose bits are `wanted`, to the bit; [`MAX_COST`] in the others.
/// What is left to do after the samples is shared by all views.
#[inline(always)]
pub fn patch_costs<'a, S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    view: impl FnMut(usize) -> (&'a PackedImage, PatchHomography),
    wanted: u8,
) -> [f32; LANES] {
    // The loops over the vectors of the usual windows of 16, 24 and 36 samples are rolled out.
    let sums = match (window.pairs, window.vectors.len()) {
        (1, 2) => correlate_views::<S, 2>(simd, window, patch, view, wanted),
        (1, 3) => correlate_views::<S, 3>(simd, window, patch, view, wanted),
        (2, 5) => correlate_views::<S, 5>(simd, window, patch, view, wanted),
        _ => correlate_views_in_turn(simd, window, patch, view, wanted),
    };
    let [sum, squares, products] =
        [simd.reduce_sum_8x8(&sums[0]), simd.reduce_sum_8x8(&sums[1]), simd.reduce_sum_8x8(&sums[2])];
    let variance = simd.sub(squares, simd.mul(sum, sum));
    let least = if patch.has_texture(window) { window.min_variance_of_samples() } else { f32::INFINITY };
    let has_texture = simd.simd_ge(variance, simd.splat(least));
    let ncc = simd.div(products, simd.sqrt(variance));
    let cost = simd.max(simd.sub(simd.splat(1.0), ncc), simd.splat(0.0));
    let cost = simd.store(simd.min(cost, simd.splat(MAX_COST)));
    from_fn(|lane| if has_texture >> lane & 1 != 0 { cost[lane] } else { MAX_COST })
}

/// The sums of [`correlate`] of the wanted views, a vector each.
type SumsOfViews<S> = [[<S as Simd>::F32; LANES]; 3];

#[inline(always)]
fn correlate_views_in_turn<'a, S: Simd>(
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
        [sums[0][lane], sums[1][lane], sums[2][lane]] = correlate_vectors(simd, window, patch, &warp);
    }
    sums
}

/// The same for a window of `N` vectors, all mirrored pairs but for the last one of an odd number. While a view's samples are added up,
/// the next one's places are worked out: each waits for steps that take long.
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
        positions(simd, window, &Warp::new(simd, source, &homography));
    while rest != 0 {
        let next_lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let (source, homography) = view(next_lane);
        let next = positions(simd, window, &Warp::new(simd, source, &homography));
        [sums[0][lane], sums[1][lane], sums[2][lane]] = add_up(simd, patch, current);
        (current, lane) = (next, next_lane);
    }
    [sums[0][lane], sums[1][lane], sums[2][lane]] = add_up(simd, patch, current);
    sums
}

/// The places of the `N` vectors of a window, all mirrored pairs but for the last one of an odd number.
#[inline(always)]
fn positions<'a, S: Simd, const N: usize>(
    simd: S,
    window: &Window,
    warp: &Warp<'a, S>,
) -> [S::SamplePositions<'a>; N] {
    // Each is set below.
    let mut all = [warp.center_position(simd); N];
    let vectors: &[Offsets; N] = window.vectors[..].try_into().expect("the window has N vectors");
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

/// The sums of [`correlate`] over the samples at these places.
#[inline(always)]
fn add_up<S: Simd, const N: usize>(
    simd: S,
    patch: &ReferencePatch,
    positions: [S::SamplePositions<'_>; N],
) -> [S::F32; 3] {
    let mean = simd.splat(patch.mean * SAMPLE_SCALE);
    let mut sums = [simd.splat(0.0); 3];
    for (positions, side) in positions.into_iter().zip(patch.weights.iter().zip(&patch.weighted)) {
        sums = add(simd, sums, side, simd.sub(simd.sample_bilinear(positions), mean));
    }
    sums
}

/// The weighted sums over a patch's image in a source view, eight samples a vector: of the differences to the
/// reference's mean, of their squares, and of their products with the reference. A gray value counts [`SAMPLE_SCALE`].
#[inline(always)]
fn correlate<S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    source: &PackedImage,
    homography: &PatchHomography,
) -> [S::F32; 3] {
    let warp = Warp::new(simd, source, homography);
    match (window.pairs, window.vectors.len()) {
        (1, 2) => add_up::<S, 2>(simd, patch, positions(simd, window, &warp)),
        (1, 3) => add_up::<S, 3>(simd, patch, positions(simd, window, &warp)),
        (2, 5) => add_up::<S, 5>(simd, patch, positions(simd, window, &warp)),
        _ => correlate_vectors(simd, window, patch, &warp),
    }
}

#[inline(always)]
fn correlate_vectors<S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    warp: &Warp<S>,
) -> [S::F32; 3] {
    let mean = simd.splat(patch.mean * SAMPLE_SCALE);
    let mut sums = [simd.splat(0.0); 3];
    let mut sides = patch.weights.iter().zip(&patch.weighted);
    let (mirrored, rest) = window.vectors.split_at(2 * window.pairs);
    let (pairs, _) = mirrored.as_chunks::<2>();
    for [offsets, _] in pairs {
        let both = warp.mirrored_positions(simd, simd.load(&offsets.x), simd.load(&offsets.y));
        for (positions, side) in both.into_iter().zip(&mut sides) {
            sums = add(simd, sums, side, simd.sub(simd.sample_bilinear(positions), mean));
        }
    }
    for (offsets, side) in rest.iter().zip(sides) {
        let positions = warp.positions(simd, simd.load(&offsets.x), simd.load(&offsets.y));
        sums = add(simd, sums, side, simd.sub(simd.sample_bilinear(positions), mean));
    }
    sums
}

/// Adds a vector's samples to the sums of [`correlate`]: about the reference's mean, since single-pass sums in f32 lose
/// digits in low contrast.
#[inline(always)]
fn add<S: Simd>(
    simd: S,
    [sum, squares, products]: [S::F32; 3],
    (weight, weighted): (&[f32; LANES], &[f32; LANES]),
    difference: S::F32,
) -> [S::F32; 3] {
    let share = simd.mul(simd.load(weight), difference);
    [
        simd.add(sum, share),
        simd.mul_add(share, difference, squares),
        simd.mul_add(simd.load(weighted), difference, products),
    ]
}
