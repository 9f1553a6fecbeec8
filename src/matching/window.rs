//! The matching window: sample offsets around a pixel and their bilateral weights.

use crate::geometry::{Offset, Position};
use crate::image::PackedImage;
use crate::simd::{LANES, SAMPLE_SCALE};
use std::array::from_fn;

/// Sample offsets and weights of a patch; the same for all pixels of a run.
///
/// A sample at offset o with gray value a has the weight
/// `exp(-|o|^2 / (2 sigma_spatial^2)) * exp(-(a - a_center)^2 / (2 sigma_color^2))`.
#[derive(Debug, Clone)]
pub struct Window {
    /// Half of the side, in px.
    pub(super) radius: usize,
    /// All samples, eight per vector. The first `2 * pairs` vectors are mirrored pairs: the offsets of the
    /// second are the negatives of those of the first.
    pub(super) vectors: Vec<WindowVector>,
    /// Number of mirrored pairs of vectors.
    pub(super) pairs: usize,
    /// `exp(-d^2 / (2 sigma_color^2))` for each difference d of gray values.
    pub(super) color_weights: Box<[f32; 256]>,
    samples: u64,
    /// In squared gray values (0 to 255).
    pub(super) min_variance: f32,
}

/// Eight samples of a window, one per lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct WindowVector {
    /// Offset along x, in px.
    pub x: [f32; LANES],
    /// Offset along y, in px.
    pub y: [f32; LANES],
    /// Spatial weight; 0 in the unused lanes of the last vector.
    pub weight: [f32; LANES],
    /// Column of the sample in the window, from 0.
    pub column: [i32; LANES],
    /// Row of the sample in the window, from 0.
    pub row: [i32; LANES],
}

impl WindowVector {
    /// The vector of up to eight samples of a window with this radius.
    fn new(samples: &[Offset], radius: i32, sigma_spatial: f64) -> WindowVector {
        let lanes = |value: &dyn Fn(Offset) -> f32| {
            from_fn(|lane| samples.get(lane).map_or(0.0, |&sample| value(sample)))
        };
        let weight =
            |(x, y): Offset| (-f64::from(x * x + y * y) / (2.0 * sigma_spatial.powi(2))).exp() as f32;
        let (x, y) = (lanes(&|(x, _)| x as f32), lanes(&|(_, y)| y as f32));
        let from_corner = |offsets: [f32; LANES]| offsets.map(|offset| offset as i32 + radius);
        WindowVector { x, y, weight: lanes(&weight), column: from_corner(x), row: from_corner(y) }
    }

    /// Gray values, minus 128, and spatial weights of the samples around a pixel whose window leaves the
    /// image: both are 0 for samples outside.
    pub(super) fn samples_inside(
        &self,
        image: &PackedImage,
        (x, y): Position,
        radius: usize,
    ) -> ([i8; LANES], [f32; LANES]) {
        let (mut gray, mut weight) = ([0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            // Larger by the radius than in the image, so that nothing is negative.
            let (column, row) = (x + self.column[lane] as usize, y + self.row[lane] as usize);
            if (radius..image.width + radius).contains(&column)
                && (radius..image.height + radius).contains(&row)
            {
                gray[lane] = image.taps.pairs()[(row - radius) * image.taps.stride() + column - radius][0];
                weight[lane] = self.weight[lane];
            }
        }
        (gray, weight)
    }
}

impl Window {
    /// The largest radius, in px.
    pub const MAX_RADIUS: u32 = 16;

    /// A square window with half side `radius`, sampled every `step` px. `sigma_spatial` is in px,
    /// `sigma_color` in intensities of [0, 1] and `min_variance` in squared intensities.
    pub fn new(radius: u32, step: u32, sigma_spatial: f64, sigma_color: f64, min_variance: f64) -> Window {
        let samples = square(radius, step).collect();
        Window::with_samples(radius, samples, sigma_spatial, sigma_color, min_variance)
    }

    /// The samples of [`Window::new`] that lie in a disc of diameter `2 radius + 1`. Samples in the corners
    /// have small weights and cost as much time as the others.
    pub fn disc(radius: u32, step: u32, sigma_spatial: f64, sigma_color: f64, min_variance: f64) -> Window {
        let squared_diameter = i64::from(2 * radius + 1).pow(2);
        let is_inside =
            |&(x, y): &Offset| 4 * (i64::from(x).pow(2) + i64::from(y).pow(2)) <= squared_diameter;
        let samples = square(radius, step).filter(is_inside).collect();
        Window::with_samples(radius, samples, sigma_spatial, sigma_color, min_variance)
    }

    fn with_samples(
        radius: u32,
        samples: Vec<Offset>,
        sigma_spatial: f64,
        sigma_color: f64,
        min_variance: f64,
    ) -> Window {
        let (mirrored, rest) = mirrored_pairs(&samples);
        let vectors = mirrored.as_flattened().iter().map(|eight| &eight[..]).chain(rest.chunks(LANES));
        let vector = |samples: &[Offset]| WindowVector::new(samples, radius as i32, sigma_spatial);
        let color_weight = |difference: usize| {
            let difference = difference as f64 / 255.0;
            (-difference.powi(2) / (2.0 * sigma_color.powi(2))).exp() as f32
        };
        Window {
            radius: radius as usize,
            vectors: vectors.map(vector).collect(),
            pairs: mirrored.len(),
            color_weights: Box::new(from_fn(color_weight)),
            samples: samples.len() as u64,
            min_variance: (min_variance * 255.0 * 255.0) as f32,
        }
    }

    /// The color weight of two gray values.
    #[inline(always)]
    pub(crate) fn similarity(&self, a: u8, b: u8) -> f32 {
        self.color_weights[usize::from(a.abs_diff(b))]
    }

    /// The minimum variance in the units of bilinear samples, [`SAMPLE_SCALE`] per gray value.
    #[inline(always)]
    pub(super) fn min_variance_of_samples(&self) -> f32 {
        self.min_variance * (SAMPLE_SCALE * SAMPLE_SCALE)
    }

    /// Half of the side, in px.
    pub(crate) fn radius(&self) -> usize {
        self.radius
    }

    /// Number of samples of a patch.
    pub fn samples(&self) -> u64 {
        self.samples
    }
}

/// The sample offsets of a square window, row by row.
fn square(radius: u32, step: u32) -> impl Iterator<Item = Offset> {
    let radius = radius as i32;
    let positions = move || (-radius..=radius).step_by(step as usize);
    positions().flat_map(move |y| positions().map(move |x| (x, y)))
}

/// Splits samples into pairs of full vectors that mirror each other at the center, and the rest.
fn mirrored_pairs(samples: &[Offset]) -> (Vec<[[Offset; LANES]; 2]>, Vec<Offset>) {
    let is_in_first_half = |&&(x, y): &&Offset| (y, x) < (0, 0) && samples.contains(&(-x, -y));
    let first_half: Vec<Offset> = samples.iter().filter(is_in_first_half).copied().collect();
    let (eights, _) = first_half.as_chunks::<LANES>();
    let pairs: Vec<[[Offset; LANES]; 2]> =
        eights.iter().map(|eight| [*eight, eight.map(|(x, y)| (-x, -y))]).collect();
    let is_in_pair = |sample: &Offset| pairs.iter().flatten().flatten().any(|other| other == sample);
    let rest = samples.iter().filter(|sample| !is_in_pair(sample)).copied().collect();
    (pairs, rest)
}
