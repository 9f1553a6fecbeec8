//! Closing, beyond the paper: after the last check, the pixels of small gaps in the validated surfaces are offered the
//! plane of the surface around them that looks most like them. Where the source views found that surface too, it is
//! taken: most such pixels were close to it and missed the check by their normal.

use crate::geometry::Camera;
use crate::geometry::DepthRange;
use crate::geometry::MIN_FACING;
use crate::geometry::SlantedPlane;
use crate::image::PackedImage;
use crate::scene::{PixelEstimate, surface};
use glam::{DVec2, Vec3};
use rayon::prelude::*;

/// Half side of the neighborhood, in pixels.
const RADIUS: i32 = 4;
/// Difference of gray values at which a neighbor counts for 1 / sqrt(e).
const GRAY_SIGMA: f32 = 6.0;
/// What a neighbor that looks altogether different still counts: where all do, the nearest ones tell.
const MIN_LIKENESS: f32 = 1e-6;
/// Distance in pixels at which it counts for 1 / sqrt(e).
const SPATIAL_SIGMA: f32 = 2.7;
/// Relative difference of inverse depths up to which two neighbors lie on the same surface.
const SAME: f32 = 0.01;
/// Neighbors a surface has at least.
const MIN_NEIGHBORS: usize = 3;

/// What a neighbor says of a pixel.
struct Neighbor {
    /// Inverse depth of its plane at the pixel.
    inverse_depth: f32,
    normal: Vec3,
    /// How near it is and how much it looks like the pixel.
    weight: f32,
}

/// The planes offered to the pixels of a view that have no validated one; depth 0 where there is none.
pub fn candidates(
    camera: &Camera,
    image: &PackedImage,
    range: DepthRange,
    solutions: &[PixelEstimate],
) -> Vec<PixelEstimate> {
    let gaps = Gaps {
        camera,
        image,
        range,
        solutions,
        planes: surface(camera, solutions),
        neighborhood: neighborhood(),
        by_gray: std::array::from_fn(|difference| gaussian(difference as f32, GRAY_SIGMA).max(MIN_LIKENESS)),
    };
    let candidate = |(pixel, solution): (usize, &PixelEstimate)| {
        let is_open = !solution.validated && solution.depth > 0.0;
        is_open.then(|| gaps.candidate(pixel)).flatten().unwrap_or_default()
    };
    solutions.par_iter().enumerate().map(candidate).collect()
}

fn gaussian(value: f32, sigma: f32) -> f32 {
    (-value * value / (2.0 * sigma * sigma)).exp()
}

/// The offsets of the neighborhood and how much they count.
fn neighborhood() -> Vec<((i32, i32), f32)> {
    let offsets = (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy)));
    let near = offsets.filter(|&(dx, dy)| dx * dx + dy * dy <= RADIUS * RADIUS + 1 && (dx, dy) != (0, 0));
    let weigh =
        |(dx, dy): (i32, i32)| ((dx, dy), gaussian(((dx * dx + dy * dy) as f32).sqrt(), SPATIAL_SIGMA));
    near.map(weigh).collect()
}

struct Gaps<'a> {
    camera: &'a Camera,
    image: &'a PackedImage,
    range: DepthRange,
    solutions: &'a [PixelEstimate],
    /// The validated ones.
    planes: Vec<SlantedPlane>,
    neighborhood: Vec<((i32, i32), f32)>,
    by_gray: [f32; 256],
}

impl Gaps<'_> {
    /// The surface around a pixel at it.
    fn candidate(&self, pixel: usize) -> Option<PixelEstimate> {
        let (width, height) = (self.image.width, self.image.height);
        let (x, y) = (pixel % width, pixel / width);
        let gray = self.image.gray(x, y);
        let neighbor = |&((dx, dy), weight): &((i32, i32), f32)| {
            let (column, row) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
            if column >= width || row >= height {
                return None;
            }
            let other = row * width + column;
            let plane = &self.planes[other];
            let inverse_depth = plane.inverse_depth_at(-dx as f32, -dy as f32);
            let likeness = self.by_gray[usize::from(gray.abs_diff(self.image.gray(column, row)))];
            (plane.inverse_depth > 0.0 && inverse_depth > 0.0).then_some(Neighbor {
                inverse_depth,
                normal: self.solutions[other].normal,
                weight: weight * likeness,
            })
        };
        let around: Vec<Neighbor> = self.neighborhood.iter().filter_map(neighbor).collect();
        let (inverse_depth, normal) = heaviest_surface(&around)?;
        let depth = 1.0 / inverse_depth;
        let ray = self.camera.ray(DVec2::new(x as f64, y as f64)).as_vec3();
        let in_range = depth >= self.range.near as f32 && depth <= self.range.far as f32;
        (in_range && normal.dot(ray) < -MIN_FACING).then_some(PixelEstimate {
            depth,
            normal,
            ..PixelEstimate::default()
        })
    }
}

/// Mean inverse depth and normal of the surface that most of the neighbors' weight is on.
fn heaviest_surface(around: &[Neighbor]) -> Option<(f32, Vec3)> {
    let on_surface_of = |own: &Neighbor| {
        let own = own.inverse_depth;
        around.iter().filter(move |other| (other.inverse_depth / own - 1.0).abs() < SAME)
    };
    let mut heaviest: Option<(f32, &Neighbor)> = None;
    for own in around {
        let weight = on_surface_of(own).map(|other| other.weight).sum();
        if heaviest.is_none_or(|(heaviest, _)| weight > heaviest) {
            heaviest = Some((weight, own));
        }
    }
    let (weight, own) =
        heaviest.filter(|(weight, own)| *weight > 0.0 && on_surface_of(own).count() >= MIN_NEIGHBORS)?;
    let inverse_depth: f32 = on_surface_of(own).map(|other| other.weight * other.inverse_depth).sum();
    let normal: Vec3 = on_surface_of(own).map(|other| other.weight * other.normal).sum();
    Some((inverse_depth / weight, normal.normalize_or_zero()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;
    use crate::testing::{self, RANGE};

    const SIZE: (u32, u32) = (40, 30);
    const WIDTH: usize = SIZE.0 as usize;

    fn camera() -> Camera {
        testing::camera(0.0, SIZE)
    }

    /// The wall, validated but for the gap, where it is wrong.
    fn wall(is_gap: impl Fn(usize, usize) -> bool) -> Vec<PixelEstimate> {
        let solution = |(pixel, exact): (usize, PixelEstimate)| match is_gap(pixel % WIDTH, pixel / WIDTH) {
            true => PixelEstimate { depth: 3.0, normal: Vec3::NEG_Z, ..PixelEstimate::default() },
            false => PixelEstimate { validated: true, ..exact },
        };
        testing::exact(&camera()).solutions.into_iter().enumerate().map(solution).collect()
    }

    fn offers_for(
        gray: impl Fn(usize) -> u8,
        range: DepthRange,
        solutions: &[PixelEstimate],
    ) -> Vec<PixelEstimate> {
        let grays = (0..solutions.len()).map(gray).collect();
        let image = PackedImage::new(&Picture::from_gray(SIZE.0, SIZE.1, grays).unwrap());
        candidates(&camera(), &image, range, solutions)
    }

    fn assert_offered(candidate: &PixelEstimate, depth: f32, normal: Vec3) {
        assert!((candidate.depth / depth - 1.0).abs() < 1e-4, "{candidate:?} instead of {depth}");
        assert!((candidate.normal - normal).length() < 1e-4, "{candidate:?} instead of {normal}");
    }

    #[test]
    fn a_gap_is_offered_the_plane_around_it() {
        let is_gap = |x: usize, y: usize| (18..22).contains(&x) && (13..16).contains(&y);
        let candidates = offers_for(|_| 100, RANGE, &wall(is_gap));
        for (pixel, candidate) in candidates.iter().enumerate() {
            match is_gap(pixel % WIDTH, pixel / WIDTH) {
                true => {
                    assert_offered(candidate, testing::depth(&camera(), pixel), testing::normal(&camera()));
                    assert!(!candidate.validated, "the sources have not been asked");
                }
                false => assert_eq!(*candidate, PixelEstimate::default(), "validated already"),
            }
        }
    }

    #[test]
    fn a_gap_that_looks_like_nothing_around_it_is_offered_the_plane_around_it_too() {
        let gap = 14 * WIDTH + 20;
        let gray = |pixel| if pixel == gap { 255 } else { 0 };
        let candidates = offers_for(gray, RANGE, &wall(|x, y| y * WIDTH + x == gap));
        assert_offered(&candidates[gap], testing::depth(&camera(), gap), testing::normal(&camera()));
    }

    #[test]
    fn at_a_depth_edge_the_surface_that_looks_alike_is_offered() {
        let is_front = |x: usize| x < WIDTH / 2;
        let mut solutions = wall(|x, _| (WIDTH / 2 - 1..WIDTH / 2 + 2).contains(&x));
        for (pixel, solution) in solutions.iter_mut().enumerate().filter(|(_, own)| own.validated) {
            solution.depth *= if is_front(pixel % WIDTH) { 0.8 } else { 1.0 };
        }
        let gray = |pixel: usize| if is_front(pixel % WIDTH) { 60 } else { 90 };
        let candidates = offers_for(gray, RANGE, &solutions);
        for (pixel, candidate) in
            candidates.iter().enumerate().filter(|&(pixel, _)| !solutions[pixel].validated)
        {
            let scale = if is_front(pixel % WIDTH) { 0.8 } else { 1.0 };
            assert_offered(candidate, scale * testing::depth(&camera(), pixel), testing::normal(&camera()));
        }
    }

    #[test]
    fn what_lies_far_from_every_surface_or_is_masked_is_offered_nothing() {
        let mut solutions = wall(|x, _| x >= 10);
        solutions[12 * WIDTH + 11].depth = 0.0;
        let candidates = offers_for(|_| 100, RANGE, &solutions);
        assert_eq!(candidates[12 * WIDTH + 11], PixelEstimate::default(), "masked");
        assert!(candidates[13 * WIDTH + 11].depth > 0.0);
        for pixel in (0..candidates.len()).filter(|pixel| pixel % WIDTH > 10 + RADIUS as usize) {
            assert_eq!(candidates[pixel], PixelEstimate::default());
        }
        // Two neighbors are no surface.
        let mut lonely = wall(|x, y| !(y == 15 && (15..17).contains(&x)));
        assert!(offers_for(|_| 100, RANGE, &lonely).iter().all(|candidate| candidate.depth == 0.0));
        let third = 15 * WIDTH + 17;
        lonely[third] = PixelEstimate { validated: true, ..testing::exact(&camera()).solutions[third] };
        assert!(offers_for(|_| 100, RANGE, &lonely).iter().any(|candidate| candidate.depth > 0.0));
    }

    #[test]
    fn nothing_beyond_the_depth_range_is_offered() {
        let is_gap = |x: usize, y: usize| y == 14 && (5..35).contains(&x);
        let solutions = wall(is_gap);
        let gap = (5..35).map(|x| 14 * WIDTH + x);
        let depths: Vec<f32> = gap.clone().map(|pixel| testing::depth(&camera(), pixel)).collect();
        let far = 0.5 * (depths[14] + depths[15]);
        let found = offers_for(|_| 100, DepthRange { near: 2.0, far: f64::from(far) }, &solutions);
        for (pixel, depth) in gap.zip(depths) {
            assert_eq!(found[pixel].depth > 0.0, depth < far, "{depth} before {far}");
        }
    }
}
