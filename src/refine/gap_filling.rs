//! Gap filling: after the last check, each pixel whose plane is not validated gets the plane of the
//! surrounding surface whose pixels have the most similar gray values. The caller checks the new planes
//! against the source views once more: most such pixels were close to that surface and failed the check by
//! their normal.
//!
//! Each validated neighbor predicts an inverse depth `w` at the pixel from its plane, with a bilateral
//! weight. Neighbors whose predictions differ by less than `SAME_SURFACE` are one surface; the surface with
//! the largest sum of weights wins, and the pixel gets the weighted means of its `w` and normals.
//!
//! Reads the validated planes and the gray values; changes planes that are not validated. For each of those,
//! O(n^2) comparisons of its up to n = 56 neighbors.

use super::stencil::{BilateralStencil, GrayWeights, Stencil};
use super::{Domain, Filter, FilteredView};
use crate::geometry::{Grid, PlaneHypothesis, Position, SlantedPlane};
use crate::scene::{PixelEstimate, validated_planes};
use glam::Vec3;
use rayon::prelude::*;

/// Radius of the neighborhood in pixels: gaps of up to twice that width are filled, wider ones along their
/// rim.
const RADIUS: i32 = 4;
/// Distance in pixels with weight 1 / sqrt(e), 2 / 3 of the radius.
const SPATIAL_SIGMA: f32 = 2.7;
/// Difference of gray values (0 to 255) with weight 1 / sqrt(e): a few deviations of a photograph's noise.
const GRAY_SIGMA: f32 = 6.0;
/// Smallest weight of a difference of gray values: where all neighbors differ, the distance decides.
const MIN_GRAY_WEIGHT: f32 = 1e-6;
/// Largest difference of gray values within a surface.
const MAX_GRAY_DIFFERENCE: u8 = 18;
/// A pixel that differs from all planes around it, and has the gray value of more than this fraction of its
/// neighborhood, where there is none, is no gap: the planes at a skyline say nothing about the sky.
const MAX_OPEN_FRACTION: f32 = 0.4;
/// Relative difference of inverse depths below which two neighbors are on the same surface; equal to the
/// largest error of depth that the default check tolerates.
const SAME_SURFACE: f32 = 0.01;
/// Fewest neighbors of a surface: fewer may be outliers that passed the check by chance.
const MIN_NEIGHBORS: usize = 3;

/// Replaces planes that are not validated by the plane of the surrounding surface, as yet unchecked: cost 0,
/// 0 consistent source views, not validated. Pixels without such a surface keep theirs.
pub(crate) struct FillGaps;

impl Filter for FillGaps {
    fn reach(&self) -> Option<usize> {
        Some(RADIUS as usize)
    }

    fn domain(&self) -> Domain {
        Domain::Unvalidated
    }

    fn apply(&self, view: &FilteredView, planes: &mut [PixelEstimate]) -> Vec<u32> {
        let surfaces = Surfaces::new(view, planes);
        let fill = |(pixel, estimate): (usize, &PixelEstimate)| {
            let is_open = self.domain().includes(estimate);
            is_open.then(|| surfaces.surrounding_plane(view, pixel)).flatten().map(|plane| (pixel, plane))
        };
        let filled: Vec<(usize, PlaneHypothesis)> = planes.par_iter().enumerate().filter_map(fill).collect();
        for &(pixel, PlaneHypothesis { depth, normal }) in &filled {
            planes[pixel] = PixelEstimate { depth, normal, ..PixelEstimate::default() };
        }
        filled.into_iter().map(|(pixel, _)| pixel as u32).collect()
    }
}

/// The validated planes.
struct Surfaces<'a> {
    grid: Grid,
    stencil: BilateralStencil,
    estimates: &'a [PixelEstimate],
    /// Inverse depth 0 where the estimate is not validated.
    planes: Vec<SlantedPlane>,
}

/// A neighbor with a validated plane.
struct Prediction {
    /// Inverse depth of its plane at the pixel.
    inverse_depth: f32,
    normal: Vec3,
    weight: f32,
}

impl Surfaces<'_> {
    fn new<'a>(view: &FilteredView, estimates: &'a [PixelEstimate]) -> Surfaces<'a> {
        Surfaces {
            grid: view.grid(),
            stencil: BilateralStencil {
                spatial: Stencil::disc(RADIUS, SPATIAL_SIGMA),
                gray: GrayWeights::new(GRAY_SIGMA, MIN_GRAY_WEIGHT),
            },
            estimates,
            planes: validated_planes(view.camera, estimates),
        }
    }

    /// The plane at a pixel of the surface around it, `None` where there is none or it is not usable there.
    fn surrounding_plane(&self, view: &FilteredView, pixel: usize) -> Option<PlaneHypothesis> {
        let position = self.grid.position(pixel);
        let neighbors = self.stencil.neighbors(view.image, position);
        let predictions: Vec<Prediction> = neighbors
            .filter_map(|neighbor| {
                let plane = &self.planes[neighbor.pixel];
                let (dx, dy) = neighbor.offset;
                let inverse_depth = plane.inverse_depth_at(-dx as f32, -dy as f32);
                (plane.inverse_depth > 0.0 && inverse_depth > 0.0).then_some(Prediction {
                    inverse_depth,
                    normal: self.estimates[neighbor.pixel].normal,
                    weight: neighbor.weight,
                })
            })
            .collect();
        heaviest_surface(&predictions)
            .filter(|&plane| view.is_usable(plane, position) && !self.is_beside_gap(view, position))
    }

    /// Whether a pixel belongs to a wide region without planes beside a surface of another gray value.
    fn is_beside_gap(&self, view: &FilteredView, position: Position) -> bool {
        let gray = |(x, y): Position| view.image.gray(x, y);
        let (mut open, mut count) = (0, 0);
        for neighbor in self.stencil.neighbors(view.image, position) {
            let is_similar =
                gray(self.grid.position(neighbor.pixel)).abs_diff(gray(position)) <= MAX_GRAY_DIFFERENCE;
            match self.planes[neighbor.pixel].inverse_depth > 0.0 {
                true if is_similar => return false,
                true => {}
                false => open += usize::from(is_similar),
            }
            count += 1;
        }
        open as f32 > MAX_OPEN_FRACTION * count as f32
    }
}

/// Mean plane of the surface with the largest sum of weights.
fn heaviest_surface(predictions: &[Prediction]) -> Option<PlaneHypothesis> {
    let on_surface_of = |own: &Prediction| {
        let own = own.inverse_depth;
        predictions.iter().filter(move |other| (other.inverse_depth / own - 1.0).abs() < SAME_SURFACE)
    };
    let mut heaviest: Option<(f32, &Prediction)> = None;
    for own in predictions {
        let weight = on_surface_of(own).map(|other| other.weight).sum();
        if heaviest.is_none_or(|(heaviest, _)| weight > heaviest) {
            heaviest = Some((weight, own));
        }
    }
    let (weight, own) =
        heaviest.filter(|(weight, own)| *weight > 0.0 && on_surface_of(own).count() >= MIN_NEIGHBORS)?;
    let inverse_depth: f32 = on_surface_of(own).map(|other| other.weight * other.inverse_depth).sum();
    let normal: Vec3 = on_surface_of(own).map(|other| other.weight * other.normal).sum();
    Some(PlaneHypothesis { depth: 1.0 / (inverse_depth / weight), normal: normal.normalize_or_zero() })
}

#[cfg(test)]
mod tests {
    use super::super::contract::assert_contract;
    use super::*;
    use crate::geometry::{Camera, DepthRange};
    use crate::image::{PackedImage, Picture};
    use crate::simd::SimdLevel;
    use crate::testing::{self, RANGE};

    const SIZE: (u32, u32) = (40, 30);
    const GRID: Grid = Grid { width: SIZE.0 as usize, height: SIZE.1 as usize };

    #[test]
    fn keeps_the_contract() {
        assert_contract(|_, _| Box::new(FillGaps));
    }

    fn camera() -> Camera {
        testing::camera(0.0, SIZE)
    }

    /// The wall, validated except for the gap, where the planes are wrong.
    fn wall(is_gap: impl Fn(usize, usize) -> bool) -> Vec<PixelEstimate> {
        let estimate = |(pixel, exact): (usize, PixelEstimate)| {
            let (x, y) = GRID.position(pixel);
            match is_gap(x, y) {
                true => PixelEstimate { depth: 3.0, normal: Vec3::NEG_Z, ..PixelEstimate::default() },
                false => PixelEstimate { validated: true, ..exact },
            }
        };
        testing::exact(&camera()).planes.into_iter().enumerate().map(estimate).collect()
    }

    /// Fills the gaps; the filled pixels are those with a result.
    fn fill(
        gray: impl Fn(usize) -> u8,
        range: DepthRange,
        planes: &[PixelEstimate],
    ) -> Vec<Option<PixelEstimate>> {
        let grays = (0..planes.len()).map(gray).collect();
        let image = PackedImage::new(&Picture::from_gray(SIZE.0, SIZE.1, grays).unwrap());
        let mut after = planes.to_vec();
        let view = FilteredView { camera: &camera(), image: &image, range, level: SimdLevel::detect() };
        let filled = FillGaps.apply(&view, &mut after);
        let result = |pixel| filled.binary_search(&(pixel as u32)).is_ok().then(|| after[pixel]);
        (0..planes.len()).map(result).collect()
    }

    fn assert_filled(filled: Option<PixelEstimate>, depth: f32, normal: Vec3) {
        let filled = filled.expect("filled");
        assert!((filled.depth / depth - 1.0).abs() < 1e-4, "{filled:?} instead of {depth}");
        assert!((filled.normal - normal).length() < 1e-4, "{filled:?} instead of {normal}");
        assert_eq!((filled.validated, filled.consistent_views), (false, 0), "not checked yet");
    }

    #[test]
    fn a_gap_gets_the_plane_around_it() {
        let is_gap = |x: usize, y: usize| (18..22).contains(&x) && (13..16).contains(&y);
        for (pixel, filled) in fill(|_| 100, RANGE, &wall(is_gap)).into_iter().enumerate() {
            let (x, y) = GRID.position(pixel);
            match is_gap(x, y) {
                true => assert_filled(filled, testing::depth(&camera(), pixel), testing::normal(&camera())),
                false => assert_eq!(filled, None, "validated"),
            }
        }
    }

    #[test]
    fn a_gap_with_a_gray_value_of_its_own_gets_the_plane_around_it() {
        let gap = GRID.index((20, 14));
        let gray = |pixel| if pixel == gap { 255 } else { 0 };
        let filled = fill(gray, RANGE, &wall(|x, y| (x, y) == (20, 14)));
        assert_filled(filled[gap], testing::depth(&camera(), gap), testing::normal(&camera()));
    }

    #[test]
    fn a_wide_region_of_another_gray_value_gets_no_plane_of_the_surface_beside_it() {
        let is_sky = |x: usize| x >= 20;
        let gray = |pixel| if is_sky(GRID.position(pixel).0) { 240 } else { 80 };
        assert!(fill(gray, RANGE, &wall(|x, _| is_sky(x))).iter().all(Option::is_none));
        let strip = |x: usize, y: usize| x == 20 && y > 3;
        let narrow = |pixel| if strip(GRID.position(pixel).0, GRID.position(pixel).1) { 240 } else { 80 };
        assert!(fill(narrow, RANGE, &wall(strip))[GRID.index((20, 15))].is_some());
    }

    #[test]
    fn at_a_depth_edge_the_surface_with_the_same_gray_value_wins() {
        let edge = GRID.width / 2;
        let is_front = |pixel: usize| GRID.position(pixel).0 < edge;
        let mut planes = wall(|x, _| (edge - 1..edge + 2).contains(&x));
        for (pixel, plane) in planes.iter_mut().enumerate().filter(|(_, own)| own.validated) {
            plane.depth *= if is_front(pixel) { 0.8 } else { 1.0 };
        }
        let gray = |pixel: usize| if is_front(pixel) { 60 } else { 90 };
        let filled = fill(gray, RANGE, &planes);
        for pixel in (0..planes.len()).filter(|&pixel| !planes[pixel].validated) {
            let scale = if is_front(pixel) { 0.8 } else { 1.0 };
            let depth = scale * testing::depth(&camera(), pixel);
            assert_filled(filled[pixel], depth, testing::normal(&camera()));
        }
    }

    #[test]
    fn pixels_far_from_every_surface_or_without_a_plane_stay() {
        let mut planes = wall(|x, _| x >= 10);
        planes[GRID.index((11, 12))].depth = 0.0;
        let filled = fill(|_| 100, RANGE, &planes);
        assert_eq!(filled[GRID.index((11, 12))], None, "masked");
        assert!(filled[GRID.index((11, 13))].is_some());
        let is_far = |pixel: &usize| GRID.position(*pixel).0 > 10 + RADIUS as usize;
        assert!((0..filled.len()).filter(is_far).all(|pixel| filled[pixel].is_none()));
    }

    #[test]
    fn two_neighbors_are_no_surface_and_three_are() {
        let mut planes = wall(|x, y| !(y == 15 && (15..17).contains(&x)));
        assert!(fill(|_| 100, RANGE, &planes).iter().all(Option::is_none));
        let third = GRID.index((17, 15));
        planes[third] = PixelEstimate { validated: true, ..testing::exact(&camera()).planes[third] };
        assert!(fill(|_| 100, RANGE, &planes).iter().any(Option::is_some));
    }

    #[test]
    fn a_gap_whose_plane_leaves_the_depth_range_stays() {
        let gap = (5..35).map(|x| GRID.index((x, 14)));
        let planes = wall(|x, y| y == 14 && (5..35).contains(&x));
        let depths: Vec<f32> = gap.clone().map(|pixel| testing::depth(&camera(), pixel)).collect();
        let far = 0.5 * (depths[14] + depths[15]);
        let filled = fill(|_| 100, DepthRange { near: 2.0, far: f64::from(far) }, &planes);
        for (pixel, depth) in gap.zip(depths) {
            assert_eq!(filled[pixel].is_some(), depth < far, "{depth} before {far}");
        }
    }
}
