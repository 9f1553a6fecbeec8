//! Bilaterally weighted normalised cross-correlation of a reference patch with its image in a source view.

use super::PatchHomography;
use super::warp::Warp;
use crate::image::PackedImage;
use crate::simd::{LANES, Simd};

/// The cost of patches that cannot be compared, and the highest there is.
pub const MAX_COST: f32 = 2.0;

/// Where a patch is sampled and how samples are weighted; the same for all pixels of a run.
#[derive(Debug, Clone)]
pub struct Window {
    /// Half its side, in pixels.
    radius: usize,
    offsets: Vec<Offsets>,
    /// `exp(-d^2 / (2 sigma^2))` of a difference d of grey values.
    colour_weights: Box<[f32; 256]>,
    samples: u64,
    /// In squared grey values of 0 to 255.
    min_variance: f32,
}

/// Eight samples of the window.
#[derive(Debug, Clone, Copy)]
struct Offsets {
    x: [f32; LANES],
    y: [f32; LANES],
    /// Spatial weight; 0 in the lanes that only fill up the last vector.
    weight: [f32; LANES],
    /// The same place from the window's top-left corner.
    column: [i32; LANES],
    row: [i32; LANES],
}

impl Window {
    /// The largest half side, in pixels.
    pub const MAX_RADIUS: u32 = 16;

    /// A square of half side `radius` sampled every `step` pixels; sigmas in pixels and in intensities of [0, 1],
    /// the smallest variance in intensities of [0, 1] too.
    pub fn new(radius: u32, step: u32, spatial_sigma: f64, colour_sigma: f64, min_variance: f64) -> Window {
        Window::of((radius, step), |_, _| true, spatial_sigma, colour_sigma, min_variance)
    }

    /// The samples of the square that lie in the disc of diameter `2 radius + 1`: its corners weigh little and cost as
    /// much as any sample.
    pub fn disc(radius: u32, step: u32, spatial_sigma: f64, colour_sigma: f64, min_variance: f64) -> Window {
        let square = i64::from(2 * radius + 1).pow(2);
        let is_inside = |x: i32, y: i32| 4 * (i64::from(x).pow(2) + i64::from(y).pow(2)) <= square;
        Window::of((radius, step), is_inside, spatial_sigma, colour_sigma, min_variance)
    }

    fn of(
        (radius, step): (u32, u32),
        is_inside: impl Fn(i32, i32) -> bool,
        spatial_sigma: f64,
        colour_sigma: f64,
        min_variance: f64,
    ) -> Window {
        let radius = radius as i32;
        let positions = || (-radius..=radius).step_by(step as usize);
        let samples: Vec<(f32, f32, f32)> = positions()
            .flat_map(|y| positions().map(move |x| (x, y)))
            .filter(|&(x, y)| is_inside(x, y))
            .map(|(x, y)| {
                let distance = f64::from(x * x + y * y);
                (x as f32, y as f32, (-distance / (2.0 * spatial_sigma.powi(2))).exp() as f32)
            })
            .collect();
        let offsets = samples
            .chunks(LANES)
            .map(|chunk| {
                let lane = |get: fn(&(f32, f32, f32)) -> f32| {
                    std::array::from_fn(|lane| chunk.get(lane).map_or(0.0, get))
                };
                let (x, y) = (lane(|s| s.0), lane(|s| s.1));
                let from_corner = |offsets: [f32; LANES]| offsets.map(|offset| offset as i32 + radius);
                let (column, row) = (from_corner(x), from_corner(y));
                Offsets { x, y, weight: lane(|s| s.2), column, row }
            })
            .collect();
        let colour_weight = |difference: usize| {
            let difference = difference as f64 / 255.0;
            (-difference.powi(2) / (2.0 * colour_sigma.powi(2))).exp() as f32
        };
        Window {
            radius: radius as usize,
            offsets,
            colour_weights: Box::new(std::array::from_fn(colour_weight)),
            samples: samples.len() as u64,
            min_variance: (min_variance * 255.0 * 255.0) as f32,
        }
    }

    /// The bilateral weight of a difference of grey values.
    #[inline(always)]
    pub fn likeness(&self, a: u8, b: u8) -> f32 {
        self.colour_weights[usize::from(a.abs_diff(b))]
    }

    /// Samples of a patch.
    pub fn samples(&self) -> u64 {
        self.samples
    }
}

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
    /// Weighted mean of the grey values.
    mean: f32,
    /// Weighted variance of the grey values.
    variance: f32,
}

impl ReferencePatch {
    /// Room for a patch of this window.
    pub fn new(window: &Window) -> ReferencePatch {
        let zeros = [[0.0; LANES]; MAX_VECTORS];
        ReferencePatch {
            vectors: window.offsets.len(),
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

    /// Weighted variance of the grey values, in squared grey values of 0 to 255.
    pub fn variance(&self) -> f32 {
        self.variance
    }

    /// Samples the patch around a pixel. What lies outside the image weighs nothing.
    #[inline(always)]
    pub fn sample<S: Simd>(&mut self, simd: S, window: &Window, image: &PackedImage, x: usize, y: usize) {
        let (width, height) = (image.width, image.height);
        let (radius, centre) = (window.radius, image.grey(x, y));
        if x >= radius && y >= radius && x + radius < width && y + radius < height {
            return self.sample_inside(simd, window, image, (x, y), centre);
        }
        let centre = simd.splat(f32::from(centre));
        let (x, y) = (simd.splat(x as f32), simd.splat(y as f32));
        let (right, bottom) = (simd.splat((width - 1) as f32), simd.splat((height - 1) as f32));
        let zero = simd.splat(0.0);
        let (mut total, mut sum) = (zero, zero);
        for (index, offsets) in window.offsets.iter().enumerate() {
            let (sample_x, sample_y) =
                (simd.add(x, simd.load(&offsets.x)), simd.add(y, simd.load(&offsets.y)));
            let inside_x = simd.min(simd.max(sample_x, zero), right);
            let inside_y = simd.min(simd.max(sample_y, zero), bottom);
            let [grey, ..] = simd.gather_bytes(&image.pairs, image.stride(), inside_x, inside_y);
            let difference = simd.max(simd.sub(grey, centre), simd.sub(centre, grey));
            let weight =
                simd.mul(simd.load(&offsets.weight), simd.look_up(&window.colour_weights, difference));
            // 0 where clamping moved the sample by a pixel or more, 1 where it did not.
            let moved_x = simd.max(simd.sub(inside_x, sample_x), simd.sub(sample_x, inside_x));
            let moved_y = simd.max(simd.sub(inside_y, sample_y), simd.sub(sample_y, inside_y));
            let moved = simd.min(simd.add(moved_x, moved_y), simd.splat(1.0));
            let weight = simd.mul(weight, simd.sub(simd.splat(1.0), moved));
            total = simd.add(total, weight);
            sum = simd.mul_add(weight, grey, sum);
            self.weights[index] = simd.store(weight);
            self.weighted[index] = simd.store(grey);
        }
        // The centre pixel's own neighbours weigh something unless the window is wider than the image.
        let scale = 1.0 / simd.sum(total).max(f32::MIN_POSITIVE);
        self.mean = simd.sum(sum) * scale;
        self.normalise(simd, scale);
    }

    /// The same for a window that lies inside the image: nothing is clamped, so samples are bytes at known places.
    #[inline(always)]
    fn sample_inside<S: Simd>(
        &mut self,
        simd: S,
        window: &Window,
        image: &PackedImage,
        (x, y): (usize, usize),
        centre: u8,
    ) {
        let stride = image.stride() as i32;
        let first = &image.pairs[(y - window.radius) * image.stride() + x - window.radius..];
        let (mut total, mut sum) = (simd.splat(0.0), simd.splat(0.0));
        for (index, offsets) in window.offsets.iter().enumerate() {
            let places: [i32; LANES] =
                std::array::from_fn(|lane| offsets.row[lane] * stride + offsets.column[lane]);
            let grey: [u8; LANES] = std::array::from_fn(|lane| first[places[lane] as usize].to_le_bytes()[0]);
            let likeness: [f32; LANES] =
                std::array::from_fn(|lane| window.colour_weights[usize::from(grey[lane].abs_diff(centre))]);
            let grey = simd.load(&grey.map(f32::from));
            let weight = simd.mul(simd.load(&offsets.weight), simd.load(&likeness));
            total = simd.add(total, weight);
            sum = simd.mul_add(weight, grey, sum);
            self.weights[index] = simd.store(weight);
            self.weighted[index] = simd.store(grey);
        }
        let scale = 1.0 / simd.sum(total).max(f32::MIN_POSITIVE);
        self.mean = simd.sum(sum) * scale;
        self.normalise(simd, scale);
    }

    #[inline(always)]
    fn normalise<S: Simd>(&mut self, simd: S, scale: f32) {
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
        self.variance = simd.sum(squares);
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
    let (sum, squares, products) = (simd.sum(sum), simd.sum(squares), simd.sum(products));
    let variance = squares - sum * sum;
    // Written so that a variance that is not a number has no texture.
    if variance >= window.min_variance {
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
    mut view: impl FnMut(usize) -> (&'a PackedImage, PatchHomography),
    wanted: u8,
) -> [f32; LANES] {
    let zero = simd.splat(0.0);
    let (mut sums, mut squares, mut products) = ([zero; LANES], [zero; LANES], [zero; LANES]);
    let mut rest = wanted;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % LANES;
        rest &= rest - 1;
        let (source, homography) = view(lane);
        [sums[lane], squares[lane], products[lane]] = correlate(simd, window, patch, source, &homography);
    }
    let (sum, squares, products) = (simd.sums(&sums), simd.sums(&squares), simd.sums(&products));
    let variance = simd.sub(squares, simd.mul(sum, sum));
    let least = if patch.has_texture(window) { window.min_variance } else { f32::INFINITY };
    let has_texture = simd.at_least(variance, simd.splat(least));
    let ncc = simd.div(products, simd.sqrt(variance));
    let cost = simd.min(simd.max(simd.sub(simd.splat(1.0), ncc), zero), simd.splat(MAX_COST));
    let cost = simd.store(cost);
    std::array::from_fn(|lane| if has_texture >> lane & 1 != 0 { cost[lane] } else { MAX_COST })
}

/// The weighted sums over a patch's image in a source view, eight samples a vector: of the differences to the
/// reference's mean, of their squares, and of their products with the reference.
#[inline(always)]
fn correlate<S: Simd>(
    simd: S,
    window: &Window,
    patch: &ReferencePatch,
    source: &PackedImage,
    homography: &PatchHomography,
) -> [S::F32; 3] {
    let zero = simd.splat(0.0);
    let warp = Warp::new(simd, source, homography);
    let mean = simd.splat(patch.mean);
    let (mut sum, mut squares, mut products) = (zero, zero, zero);
    for (offsets, (weight, weighted)) in window.offsets.iter().zip(patch.weights.iter().zip(&patch.weighted))
    {
        let grey = warp.sample(simd, source, simd.load(&offsets.x), simd.load(&offsets.y));
        // About the reference's mean: single-pass sums in f32 lose digits in low contrast.
        let difference = simd.sub(grey, mean);
        let share = simd.mul(simd.load(weight), difference);
        sum = simd.add(sum, share);
        squares = simd.mul_add(share, difference, squares);
        products = simd.mul_add(simd.load(weighted), difference, products);
    }
    [sum, squares, products]
}
