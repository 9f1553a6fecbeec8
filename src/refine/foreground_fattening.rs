//! Correction of foreground fattening: a window at the edge of a near surface matches by the texture of that
//! surface even where its center is already on the background, so that near surfaces come out too wide. The
//! gray value of a pixel decides which of the two surfaces it is on.
//!
//! Around each validated pixel, bilateral weights are summed over the neighbors on the pixel's own surface
//! (their planes have the same inverse depth there, within `SAME_SURFACE`), on surfaces behind it (smaller by
//! `BEHIND` at least), and over those without a validated plane. Where the background has the larger sum, the
//! pixel gets the weighted mean of the background's inverse depths and normals. In the last cycle, a pixel
//! among many without a plane loses its validation.
//!
//! Reads the validated planes and the gray values; changes depth, normal and `validated` of validated planes.
//! A pass visits 12 neighbors of every pixel, whole rows at a time, and all 120 neighbors of the pixels near
//! a depth edge; later passes visit only what is near a change of the pass before.
//!
//! Sources: the effect is described by Scharstein and Szeliski, "A taxonomy and evaluation of dense two-frame
//! stereo correspondence algorithms" (2002); the weights are those of a bilateral filter (Tomasi and
//! Manduchi, 1998).

use super::stencil::{BilateralStencil, GrayWeights, Stencil};
use super::{Domain, Filter, FilteredView, marked_pixels};
use crate::geometry::{Border, Grid, Offset, PaddedMap, PlaneHypothesis, Position, SlantedPlane};
use crate::scene::{PixelEstimate, validated_planes};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Radius of the neighborhood in pixels: surfaces are hardly ever fattened by more.
const RADIUS: i32 = 6;
/// Distance in pixels with weight 1 / sqrt(e), 2 / 3 of the radius.
const SPATIAL_SIGMA: f32 = 4.0;
/// Difference of gray values (0 to 255) with weight 1 / sqrt(e): a few deviations of a photograph's noise.
const GRAY_SIGMA: f32 = 6.0;
/// Relative difference of inverse depths below which a neighbor is on the pixel's surface; equal to the
/// largest error of depth that the default check tolerates.
const SAME_SURFACE: f32 = 0.01;
/// Relative decrease of inverse depth from which a neighbor is on a surface behind: twice `SAME_SURFACE`, so
/// that rounded edges are neither.
const BEHIND: f32 = 0.02;
/// Factor by which the weight of neighbors without a plane must exceed that of the pixel's surface to end its
/// validation: they may also be gaps in the surface.
const EMPTY_FACTOR: f32 = 2.0;
/// Offsets of the neighbors that reveal a depth edge nearby, at half of the radius and at the radius: a
/// background that outweighs the pixel's surface is wide enough to cover one of them.
const PROBES: [Offset; 12] =
    [(3, 0), (-3, 0), (0, 3), (0, -3), (6, 0), (-6, 0), (0, 6), (0, -6), (4, 4), (-4, 4), (4, -4), (-4, -4)];

/// Moves validated pixels at depth edges to the surface behind if their gray values are closer to its.
pub(crate) struct CorrectFattening {
    /// How many times the edges are moved, each time by a few pixels at most.
    pub passes: u32,
    /// Whether no search follows: then pixels without a plane count as background, and validated pixels among
    /// them lose their validation. Before that, a search may still find planes there.
    pub is_last_cycle: bool,
}

/// The surface that a validated pixel is assigned to.
enum Assignment {
    /// The one it has.
    Own,
    /// The one behind.
    Background(PlaneHypothesis),
    /// None: the neighborhood is mostly empty.
    Nothing,
}

impl Filter for CorrectFattening {
    fn reach(&self) -> Option<usize> {
        Some(self.passes as usize * RADIUS as usize)
    }

    fn domain(&self) -> Domain {
        Domain::Validated
    }

    fn apply(&self, view: &FilteredView, planes: &mut [PixelEstimate]) -> Vec<u32> {
        let stencil = BilateralStencil {
            spatial: Stencil::disc(RADIUS, SPATIAL_SIGMA),
            gray: GrayWeights::new(GRAY_SIGMA, 0.0),
        };
        let (grid, is_last_cycle) = (view.grid(), self.is_last_cycle);
        let mut is_replaced = vec![false; planes.len()];
        let mut changes = ChangedBlocks::all(grid);
        for _ in 0..self.passes {
            let before = planes.to_vec();
            let surfaces = validated_planes(view.camera, &before);
            let edges = EdgeDetector::new(grid, &surfaces, is_last_cycle);
            let classifier = Classifier { view, stencil: &stencil, before: &before, surfaces, is_last_cycle };
            let rows = planes.par_chunks_mut(grid.width).zip(is_replaced.par_chunks_mut(grid.width));
            rows.enumerate().for_each(|(y, (row, is_replaced))| {
                if changes.is_near_row(y) {
                    let is_near_edge = edges.detect_in_row(y, grid.width);
                    for (x, estimate) in row.iter_mut().enumerate() {
                        // Where nothing changed in the pass before, nothing changes in this one.
                        if is_near_edge[x] && estimate.validated && changes.is_near((x, y)) {
                            is_replaced[x] |= classifier.reassign(estimate, (x, y));
                        }
                    }
                }
            });
            changes = ChangedBlocks::between(grid, &before, planes);
        }
        marked_pixels(&is_replaced)
    }
}

/// The blocks of the image in which a pass changed an estimate.
struct ChangedBlocks {
    is_changed: Vec<bool>,
    columns: usize,
}

impl ChangedBlocks {
    /// Side of a block in pixels: not less than the radius, so that a neighborhood touches at most 3 x 3
    /// blocks.
    const SIDE: usize = 8;

    fn all(grid: Grid) -> ChangedBlocks {
        let [columns, rows] = [grid.width, grid.height].map(|side| side.div_ceil(ChangedBlocks::SIDE));
        ChangedBlocks { is_changed: vec![true; columns * rows], columns }
    }

    fn between(grid: Grid, before: &[PixelEstimate], after: &[PixelEstimate]) -> ChangedBlocks {
        let mut blocks = ChangedBlocks::all(grid);
        blocks.is_changed.fill(false);
        for pixel in (0..before.len()).filter(|&pixel| before[pixel] != after[pixel]) {
            let (x, y) = grid.position(pixel);
            blocks.is_changed[y / ChangedBlocks::SIDE * blocks.columns + x / ChangedBlocks::SIDE] = true;
        }
        blocks
    }

    /// Whether a block within the radius of a pixel changed.
    fn is_near(&self, (x, y): Position) -> bool {
        let columns = ChangedBlocks::within_radius(x, self.columns);
        self.rows_near(y).any(|row| row[columns.clone()].contains(&true))
    }

    /// Whether a block within the radius of a row changed.
    fn is_near_row(&self, y: usize) -> bool {
        self.rows_near(y).any(|row| row.contains(&true))
    }

    fn rows_near(&self, y: usize) -> impl Iterator<Item = &[bool]> {
        let rows = ChangedBlocks::within_radius(y, self.is_changed.len() / self.columns);
        self.is_changed.chunks_exact(self.columns).take(rows.end() + 1).skip(*rows.start())
    }

    /// The blocks within the radius of a coordinate, out of `count`.
    fn within_radius(coordinate: usize, count: usize) -> RangeInclusive<usize> {
        let last = (coordinate + RADIUS as usize) / ChangedBlocks::SIDE;
        coordinate.saturating_sub(RADIUS as usize) / ChangedBlocks::SIDE..=last.min(count - 1)
    }
}

/// Finds the pixels near a depth edge, row by row; all others keep their surface.
struct EdgeDetector {
    /// Of the validated planes; NaN, which compares false, where there is nothing to compare with.
    inverse_depth: PaddedMap,
    slope_x: PaddedMap,
    slope_y: PaddedMap,
}

impl EdgeDetector {
    fn new(grid: Grid, planes: &[SlantedPlane], is_last_cycle: bool) -> EdgeDetector {
        // Infinitely far behind all others.
        let empty = if is_last_cycle { 0.0 } else { f32::NAN };
        let padded = |value, of: &(dyn Fn(&SlantedPlane) -> f32 + Sync)| {
            PaddedMap::new(grid, Border { width: RADIUS as usize, value }, |pixel| of(&planes[pixel]))
        };
        let or_empty = |inverse_depth: f32| if inverse_depth > 0.0 { inverse_depth } else { empty };
        EdgeDetector {
            inverse_depth: padded(f32::NAN, &|plane| or_empty(plane.inverse_depth)),
            slope_x: padded(0.0, &|plane| plane.slope_x),
            slope_y: padded(0.0, &|plane| plane.slope_y),
        }
    }

    fn detect_in_row(&self, y: usize, width: usize) -> Vec<bool> {
        let own = self.inverse_depth.row(y, (0, 0), width);
        let mut is_near = vec![false; width];
        for (dx, dy) in PROBES {
            let inverse_depth = self.inverse_depth.row(y, (dx, dy), width);
            let slope_x = self.slope_x.row(y, (dx, dy), width);
            let slope_y = self.slope_y.row(y, (dx, dy), width);
            let (dx, dy) = (dx as f32, dy as f32);
            for x in 0..width {
                let predicted = inverse_depth[x] - slope_x[x] * dx - slope_y[x] * dy;
                is_near[x] |= predicted < own[x] * (1.0 - BEHIND);
            }
        }
        is_near
    }
}

/// Assigns pixels to surfaces by the estimates before the pass.
struct Classifier<'a> {
    view: &'a FilteredView<'a>,
    stencil: &'a BilateralStencil,
    before: &'a [PixelEstimate],
    /// Its validated planes, inverse depth 0 elsewhere.
    surfaces: Vec<SlantedPlane>,
    is_last_cycle: bool,
}

impl Classifier<'_> {
    /// Changes an estimate to its assignment; returns whether that is another one.
    fn reassign(&self, estimate: &mut PixelEstimate, position: Position) -> bool {
        match self.classify(position) {
            Assignment::Own => return false,
            Assignment::Background(plane) => {
                (estimate.depth, estimate.normal) = (plane.depth, plane.normal);
            }
            Assignment::Nothing => estimate.validated = false,
        }
        true
    }

    fn classify(&self, position: Position) -> Assignment {
        let own = self.surfaces[self.view.grid().index(position)].inverse_depth;
        // The pixel itself has weight 1.
        let (mut same, mut behind, mut empty) = (1.0, 0.0, 0.0);
        let (mut inverse_depth, mut normal) = (0.0, Vec3::ZERO);
        for neighbor in self.stencil.neighbors(self.view.image, position) {
            let weight = neighbor.weight;
            match self.relative_difference(own, neighbor.pixel, neighbor.offset) {
                None => empty += weight,
                Some(difference) if difference.abs() < SAME_SURFACE => same += weight,
                Some(difference) if difference < -BEHIND => {
                    behind += weight;
                    inverse_depth += weight * own * (1.0 + difference);
                    normal += weight * self.before[neighbor.pixel].normal;
                }
                Some(_) => {}
            }
        }
        if behind > same {
            let plane = PlaneHypothesis { depth: behind / inverse_depth, normal: normal.normalize_or_zero() };
            if self.view.is_usable(plane, position) {
                return Assignment::Background(plane);
            }
        }
        if self.is_last_cycle && empty > EMPTY_FACTOR * same { Assignment::Nothing } else { Assignment::Own }
    }

    /// Relative difference from a pixel's inverse depth to that of the plane of its neighbor at an offset,
    /// `None` if the neighbor has no validated plane.
    fn relative_difference(&self, own: f32, neighbor: usize, (dx, dy): Offset) -> Option<f32> {
        let plane = &self.surfaces[neighbor];
        let predicted = plane.inverse_depth_at(-dx as f32, -dy as f32);
        (plane.inverse_depth > 0.0).then_some(predicted / own - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::contract::assert_contract;
    use super::*;
    use crate::geometry::{Camera, DepthRange};
    use crate::image::{PackedImage, Picture};
    use crate::simd::SimdLevel;
    use glam::{DMat3, DVec3};

    const SIZE: (u32, u32) = (48, 32);
    const GRID: Grid = Grid { width: SIZE.0 as usize, height: SIZE.1 as usize };
    const RANGE: DepthRange = DepthRange { near: 1.0, far: 20.0 };
    /// Columns that the near surface really covers.
    const TRUE_EDGE: usize = 20;

    #[test]
    fn keeps_the_contract() {
        assert_contract(|_, _| Box::new(CorrectFattening { passes: 1, is_last_cycle: false }));
        assert_contract(|_, _| Box::new(CorrectFattening { passes: 3, is_last_cycle: true }));
    }

    fn camera() -> Camera {
        let (width, height) = SIZE;
        Camera {
            width,
            height,
            fx: 40.0,
            fy: 40.0,
            cx: 23.5,
            cy: 15.5,
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        }
    }

    fn image(gray: impl Fn(usize) -> u8) -> PackedImage {
        let grays = (0..GRID.pixels()).map(gray).collect();
        PackedImage::new(&Picture::from_gray(SIZE.0, SIZE.1, grays).unwrap())
    }

    /// A dark surface left of the edge, a bright one right of it.
    fn two_surfaces() -> PackedImage {
        image(|pixel| if GRID.position(pixel).0 < TRUE_EDGE { 60 } else { 160 })
    }

    fn correct(filter: CorrectFattening, image: &PackedImage, planes: &mut [PixelEstimate]) {
        filter.apply(
            &FilteredView { camera: &camera(), image, range: RANGE, level: SimdLevel::detect() },
            planes,
        );
    }

    fn first_cycles(passes: u32) -> CorrectFattening {
        CorrectFattening { passes, is_last_cycle: false }
    }

    fn last_cycle(passes: u32) -> CorrectFattening {
        CorrectFattening { passes, is_last_cycle: true }
    }

    /// A surface at depth 4, some columns too wide, before a background.
    fn fattened(background: f32, too_wide: usize) -> Vec<PixelEstimate> {
        let is_near = |pixel| GRID.position(pixel).0 < TRUE_EDGE + too_wide;
        let estimate = |pixel| PixelEstimate {
            depth: if is_near(pixel) { 4.0 } else { background },
            normal: Vec3::NEG_Z,
            consistent_views: 3,
            validated: true,
            ..PixelEstimate::default()
        };
        (0..GRID.pixels()).map(estimate).collect()
    }

    #[test]
    fn a_fattened_surface_ends_where_its_gray_value_does() {
        let mut planes = fattened(8.0, 4);
        correct(first_cycles(10), &two_surfaces(), &mut planes);
        for (pixel, plane) in planes.iter().enumerate() {
            let expected = if GRID.position(pixel).0 < TRUE_EDGE { 4.0 } else { 8.0 };
            assert!((plane.depth - expected).abs() < 1e-3, "{} at {pixel}", plane.depth);
            assert!(plane.validated);
        }
    }

    #[test]
    fn several_passes_at_once_equal_as_many_single_ones() {
        let mut at_once = fattened(8.0, 4);
        correct(last_cycle(6), &two_surfaces(), &mut at_once);
        let mut one_by_one = fattened(8.0, 4);
        (0..6).for_each(|_| correct(last_cycle(1), &two_surfaces(), &mut one_by_one));
        assert_eq!(at_once, one_by_one);
    }

    #[test]
    fn without_a_difference_of_gray_values_the_edge_moves_by_one_pixel_at_most() {
        let mut planes = fattened(8.0, 4);
        correct(first_cycles(1), &image(|_| 100), &mut planes);
        let moved = planes.iter().zip(fattened(8.0, 4)).filter(|(after, before)| *after != before).count();
        assert!(moved <= GRID.height, "{moved} pixels moved");
    }

    #[test]
    fn a_single_surface_stays_whatever_its_gray_values() {
        let mut planes = fattened(4.0, 4);
        correct(last_cycle(4), &two_surfaces(), &mut planes);
        assert_eq!(planes, fattened(4.0, 4));
    }

    #[test]
    fn pixels_before_an_empty_background_lose_their_validation_in_the_last_cycle_only() {
        for (filter, kept) in [(first_cycles(4), TRUE_EDGE + 1), (last_cycle(4), TRUE_EDGE)] {
            let mut planes = fattened(0.0, 1);
            planes.iter_mut().for_each(|plane| plane.validated = plane.depth > 0.0);
            correct(filter, &two_surfaces(), &mut planes);
            let row = &planes[GRID.index((0, 16))..][..GRID.width];
            assert_eq!(row.iter().filter(|plane| plane.validated).count(), kept);
        }
    }

    #[test]
    fn pixels_stay_where_the_background_is_out_of_the_depth_range() {
        let view = FilteredView {
            camera: &camera(),
            image: &two_surfaces(),
            range: DepthRange { near: 1.0, far: 6.0 },
            level: SimdLevel::detect(),
        };
        let mut planes = fattened(8.0, 4);
        assert_eq!(first_cycles(4).apply(&view, &mut planes), [0u32; 0]);
        assert_eq!(planes, fattened(8.0, 4));
    }
}
