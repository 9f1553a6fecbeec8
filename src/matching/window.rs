//! Where patches are sampled and how their samples are weighted.

use crate::image::PackedImage;
use crate::simd::{LANES, SAMPLE_SCALE};
use std::array::from_fn;

/// Where a patch is sampled and how samples are weighted; the same for all pixels of a run.
#[derive(Debug, Clone)]
pub struct Window {
    /// Half its side, in pixels.
    pub(super) radius: usize,
    /// All samples, those first of which two vectors mirror each other at the pixel.
    pub(super) vectors: Vec<Offsets>,
    /// Pairs of vectors that do.
    pub(super) pairs: usize,
    /// `exp(-d^2 / (2 sigma^2))` of a difference d of gray values.
    pub(super) color_weights: Box<[f32; 256]>,
    samples: u64,
    /// In squared gray values of 0 to 255.
    pub(super) min_variance: f32,
}

/// Eight samples of the window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Offsets {
    pub x: [f32; LANES],
    pub y: [f32; LANES],
    /// Spatial weight; 0 in the lanes that only fill up the last vector.
    pub weight: [f32; LANES],
    /// The same place from the window's top-left corner.
    pub column: [i32; LANES],
    pub row: [i32; LANES],
}

impl Offsets {
    /// Up to eight samples of a window of this radius.
    fn new(samples: &[(i32, i32)], radius: i32, sigma_spatial: f64) -> Offsets {
        let lane = |get: &dyn Fn((i32, i32)) -> f32| {
            from_fn(|lane| samples.get(lane).map_or(0.0, |&sample| get(sample)))
        };
        let weight =
            |(x, y): (i32, i32)| (-f64::from(x * x + y * y) / (2.0 * sigma_spatial.powi(2))).exp() as f32;
        let (x, y) = (lane(&|(x, _)| x as f32), lane(&|(_, y)| y as f32));
        let from_corner = |offsets: [f32; LANES]| offsets.map(|offset| offset as i32 + radius);
        Offsets { x, y, weight: lane(&weight), column: from_corner(x), row: from_corner(y) }
    }

    /// The samples about a pixel near the image's border and their spatial weights: 0 for those outside.
    pub fn of_those_inside(
        &self,
        image: &PackedImage,
        (x, y): (usize, usize),
        radius: usize,
    ) -> ([i8; LANES], [f32; LANES]) {
        let (mut gray, mut weight) = ([0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
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
    /// The largest half side, in pixels.
    pub const MAX_RADIUS: u32 = 16;

    /// A square of half side `radius` sampled every `step` pixels; sigmas in pixels and in intensities of [0, 1],
    /// the smallest variance in intensities of [0, 1] too.
    pub fn new(radius: u32, step: u32, sigma_spatial: f64, sigma_color: f64, min_variance: f64) -> Window {
        Window::of((radius, step), |_, _| true, sigma_spatial, sigma_color, min_variance)
    }

    /// The samples of the square that lie in the disc of diameter `2 radius + 1`: its corners weigh little and cost as
    /// much as any sample.
    pub fn disc(radius: u32, step: u32, sigma_spatial: f64, sigma_color: f64, min_variance: f64) -> Window {
        let square = i64::from(2 * radius + 1).pow(2);
        let is_inside = |x: i32, y: i32| 4 * (i64::from(x).pow(2) + i64::from(y).pow(2)) <= square;
        Window::of((radius, step), is_inside, sigma_spatial, sigma_color, min_variance)
    }

    fn of(
        (radius, step): (u32, u32),
        is_inside: impl Fn(i32, i32) -> bool,
        sigma_spatial: f64,
        sigma_color: f64,
        min_variance: f64,
    ) -> Window {
        let radius = radius as i32;
        let positions = || (-radius..=radius).step_by(step as usize);
        let samples: Vec<(i32, i32)> = positions()
            .flat_map(|y| positions().map(move |x| (x, y)))
            .filter(|&(x, y)| is_inside(x, y))
            .collect();
        let half = |&&(x, y): &&(i32, i32)| (y, x) < (0, 0) && samples.contains(&(-x, -y));
        let half: Vec<(i32, i32)> = samples.iter().filter(half).copied().collect();
        let (eights, _) = half.as_chunks::<LANES>();
        let both_sides = |eight: &[(i32, i32); LANES]| [*eight, eight.map(|(x, y)| (-x, -y))];
        let eights: Vec<[[(i32, i32); LANES]; 2]> = eights.iter().map(both_sides).collect();
        let is_mirrored =
            |sample: &(i32, i32)| eights.iter().flatten().flatten().any(|other| other == sample);
        let rest: Vec<(i32, i32)> = samples.iter().filter(|sample| !is_mirrored(sample)).copied().collect();
        let vectors = eights.as_flattened().iter().map(|eight| &eight[..]).chain(rest.chunks(LANES));
        let offsets = |samples: &[(i32, i32)]| Offsets::new(samples, radius, sigma_spatial);
        let color_weight = |difference: usize| {
            let difference = difference as f64 / 255.0;
            (-difference.powi(2) / (2.0 * sigma_color.powi(2))).exp() as f32
        };
        Window {
            radius: radius as usize,
            vectors: vectors.map(offsets).collect(),
            pairs: eights.len(),
            color_weights: Box::new(from_fn(color_weight)),
            samples: samples.len() as u64,
            min_variance: (min_variance * 255.0 * 255.0) as f32,
        }
    }

    /// The bilateral weight of a difference of gray values.
    #[inline(always)]
    pub fn similarity(&self, a: u8, b: u8) -> f32 {
        self.color_weights[usize::from(a.abs_diff(b))]
    }

    /// The smallest variance of bilinear samples, in which a gray value counts [`SAMPLE_SCALE`].
    #[inline(always)]
    pub(super) fn min_variance_of_samples(&self) -> f32 {
        self.min_variance * (SAMPLE_SCALE * SAMPLE_SCALE)
    }

    /// Samples of a patch.
    pub fn samples(&self) -> u64 {
        self.samples
    }
}
