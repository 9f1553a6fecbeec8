//! Edges of surfaces, beyond the paper: a window at the edge of a near surface matches by that surface's texture even
//! where its center already lies on what is behind, so that near surfaces come out too wide. The gray values tell which
//! of the two a pixel belongs to.

use crate::geometry::Camera;
use crate::geometry::DepthRange;
use crate::geometry::MIN_FACING;
use crate::geometry::SlantedPlane;
use crate::image::PackedImage;
use crate::refine::stencil::Padded;
use crate::scene::{PixelEstimate, surface};
use glam::{DVec2, Vec3};
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Half side of the neighborhood, in pixels: more than that surfaces are hardly widened.
const RADIUS: i32 = 6;
/// Difference of gray values at which a neighbor counts for 1 / sqrt(e).
const GRAY_SIGMA: f32 = 6.0;
/// Distance in pixels at which it counts for 1 / sqrt(e).
const SPATIAL_SIGMA: f32 = 4.0;
/// Relative difference of inverse depths up to which a neighbor lies on the pixel's surface, and from which on it lies
/// on one behind.
const SAME: f32 = 0.01;
const BEHIND: f32 = 0.02;
/// Empty pixels must outweigh the pixel's surface by this factor: they may be gaps in it.
const EMPTY_FACTOR: f32 = 2.0;

/// Neighbors that show whether there is an edge nearby.
const PROBES: [(i32, i32); 12] =
    [(3, 0), (-3, 0), (0, 3), (0, -3), (6, 0), (-6, 0), (0, 6), (0, -6), (4, 4), (-4, 4), (4, -4), (-4, -4)];

/// The neighborhood, and how much neighbors count.
struct Weights {
    neighbors: Vec<Neighbor>,
    by_gray: [f32; 256],
}

/// A place in the neighborhood.
struct Neighbor {
    offset: (i32, i32),
    weight: f32,
}

impl Weights {
    fn new() -> Weights {
        let gaussian = |value: f32, sigma: f32| (-value * value / (2.0 * sigma * sigma)).exp();
        let offsets = (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy)));
        let near = |&(dx, dy): &(i32, i32)| dx * dx + dy * dy <= RADIUS * RADIUS + 1 && (dx, dy) != (0, 0);
        let weigh = |(dx, dy): (i32, i32)| Neighbor {
            offset: (dx, dy),
            weight: gaussian(((dx * dx + dy * dy) as f32).sqrt(), SPATIAL_SIGMA),
        };
        Weights {
            neighbors: offsets.filter(near).map(weigh).collect(),
            by_gray: std::array::from_fn(|difference| gaussian(difference as f32, GRAY_SIGMA)),
        }
    }
}

/// What becomes of a validated pixel.
enum Belongs {
    /// To its own surface.
    ToItsOwn,
    /// To the one behind.
    Behind { depth: f32, normal: Vec3 },
    /// To none that is known.
    Nowhere,
}

/// Gives the validated pixels that look more like a surface behind to that one, in so many passes, each of which moves
/// edges by a few pixels at most. Pixels in the midst of empty ones are given up where no search follows.
pub fn trim(
    camera: &Camera,
    image: &PackedImage,
    range: DepthRange,
    solutions: &mut [PixelEstimate],
    passes: u32,
    is_last: bool,
) {
    let weights = Weights::new();
    let mut moved = Moved::everywhere(image.width, image.height);
    for _ in 0..passes {
        let planes = surface(camera, solutions);
        let near_edges = NearEdges::new((image.width, image.height), &planes, is_last);
        let edges =
            Edges { camera, image, range, planes: &planes, before: solutions, weights: &weights, is_last };
        let width = image.width;
        let mut trimmed = solutions.to_vec();
        trimmed.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            // Where nothing moved in the pass before, nothing moves in this one.
            if !moved.is_near_row(y) {
                return;
            }
            let near_edges = near_edges.of_row(y, width);
            for (x, solution) in row.iter_mut().enumerate() {
                if !near_edges[x] || !solution.validated || !moved.is_near(x, y) {
                    continue;
                }
                match edges.judge((x, y)) {
                    Belongs::ToItsOwn => {}
                    Belongs::Behind { depth, normal } => (solution.depth, solution.normal) = (depth, normal),
                    Belongs::Nowhere => solution.validated = false,
                }
            }
        });
        moved = Moved::between(solutions, &trimmed, width);
        solutions.copy_from_slice(&trimmed);
    }
}

/// The blocks of the image in which a pass moved an edge.
struct Moved {
    blocks: Vec<bool>,
    columns: usize,
}

impl Moved {
    /// Side of a block, in pixels: more than the neighborhood's half side.
    const BLOCK: usize = 8;

    fn everywhere(width: usize, height: usize) -> Moved {
        let columns = width.div_ceil(Moved::BLOCK);
        Moved { blocks: vec![true; columns * height.div_ceil(Moved::BLOCK)], columns }
    }

    fn between(before: &[PixelEstimate], after: &[PixelEstimate], width: usize) -> Moved {
        let mut moved = Moved::everywhere(width, before.len().div_ceil(width.max(1)));
        moved.blocks.fill(false);
        for pixel in (0..before.len()).filter(|&pixel| before[pixel] != after[pixel]) {
            let (column, row) = (pixel % width / Moved::BLOCK, pixel / width / Moved::BLOCK);
            moved.blocks[row * moved.columns + column] = true;
        }
        moved
    }

    /// Whether anything in the neighborhood of a pixel moved.
    fn is_near(&self, x: usize, y: usize) -> bool {
        let columns = Moved::span(x, self.columns);
        self.rows_near(y).any(|row| row[columns.clone()].contains(&true))
    }

    /// Whether anything in the neighborhood of a row moved.
    fn is_near_row(&self, y: usize) -> bool {
        self.rows_near(y).any(|row| row.contains(&true))
    }

    fn rows_near(&self, y: usize) -> impl Iterator<Item = &[bool]> {
        let rows = Moved::span(y, self.blocks.len() / self.columns);
        self.blocks.chunks_exact(self.columns).take(rows.end() + 1).skip(*rows.start())
    }

    /// The blocks the neighborhood reaches along one axis.
    fn span(at: usize, count: usize) -> RangeInclusive<usize> {
        let last = (at + RADIUS as usize) / Moved::BLOCK;
        at.saturating_sub(RADIUS as usize) / Moved::BLOCK..=last.min(count - 1)
    }
}

/// Tells, row by row, which pixels have an edge nearby: the others are their surface's own.
struct NearEdges {
    /// Of the validated planes; not a number where nothing is compared.
    inverse_depth: Padded,
    slope_x: Padded,
    slope_y: Padded,
}

impl NearEdges {
    /// Empty pixels lie behind all others where no search follows, and say nothing where one does.
    fn new(size: (usize, usize), planes: &[SlantedPlane], is_last: bool) -> NearEdges {
        let empty = if is_last { 0.0 } else { f32::NAN };
        let padded = |beyond, value: &(dyn Fn(&SlantedPlane) -> f32 + Sync)| {
            Padded::new(size, (RADIUS as usize, beyond), |pixel| value(&planes[pixel]))
        };
        NearEdges {
            inverse_depth: padded(f32::NAN, &|plane| match plane.inverse_depth {
                inverse_depth if inverse_depth > 0.0 => inverse_depth,
                _ => empty,
            }),
            slope_x: padded(0.0, &|plane| plane.slope_x),
            slope_y: padded(0.0, &|plane| plane.slope_y),
        }
    }

    fn of_row(&self, y: usize, width: usize) -> Vec<bool> {
        let own = self.inverse_depth.row(y, (0, 0), width);
        let mut is_near = vec![false; width];
        for (dx, dy) in PROBES {
            let inverse_depth = self.inverse_depth.row(y, (dx, dy), width);
            let slope_x = self.slope_x.row(y, (dx, dy), width);
            let slope_y = self.slope_y.row(y, (dx, dy), width);
            let (dx, dy) = (dx as f32, dy as f32);
            for x in 0..width {
                let there = inverse_depth[x] - slope_x[x] * dx - slope_y[x] * dy;
                is_near[x] |= there < own[x] * (1.0 - BEHIND);
            }
        }
        is_near
    }
}

struct Edges<'a> {
    camera: &'a Camera,
    image: &'a PackedImage,
    range: DepthRange,
    planes: &'a [SlantedPlane],
    before: &'a [PixelEstimate],
    weights: &'a Weights,
    /// Whether no search follows.
    is_last: bool,
}

impl Edges<'_> {
    /// Column and row of the pixel at an offset, `None` outside the image.
    fn neighbor(&self, (x, y): (usize, usize), (dx, dy): (i32, i32)) -> Option<(usize, usize)> {
        let (column, row) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
        (column < self.image.width && row < self.image.height).then_some((column, row))
    }

    /// Relative difference to a pixel's inverse depth of what the plane of its neighbor at an offset has there; `None`
    /// without one.
    fn difference(&self, own: f32, (x, y): (usize, usize), (dx, dy): (i32, i32)) -> Option<f32> {
        let plane = &self.planes[y * self.image.width + x];
        let there = plane.inverse_depth_at(-dx as f32, -dy as f32);
        (plane.inverse_depth > 0.0).then_some(there / own - 1.0)
    }

    fn judge(&self, at: (usize, usize)) -> Belongs {
        let pixel = at.1 * self.image.width + at.0;
        let own = self.planes[pixel].inverse_depth;
        let gray = self.image.gray(at.0, at.1);
        let (mut same, mut behind, mut empty) = (1.0, 0.0, 0.0);
        let (mut inverse_depth, mut normal) = (0.0, Vec3::ZERO);
        for &Neighbor { offset, weight } in &self.weights.neighbors {
            let Some(other) = self.neighbor(at, offset) else { continue };
            let difference_of_grays = gray.abs_diff(self.image.gray(other.0, other.1));
            let weight = weight * self.weights.by_gray[usize::from(difference_of_grays)];
            match self.difference(own, other, offset) {
                None => empty += weight,
                Some(difference) if difference.abs() < SAME => same += weight,
                Some(difference) if difference < -BEHIND => {
                    behind += weight;
                    inverse_depth += weight * own * (1.0 + difference);
                    normal += weight * self.before[other.1 * self.image.width + other.0].normal;
                }
                Some(_) => {}
            }
        }
        if behind > same {
            let (depth, normal) = (behind / inverse_depth, normal.normalize_or_zero());
            let ray = self.camera.ray(DVec2::new(at.0 as f64, at.1 as f64)).as_vec3();
            let in_range = depth >= self.range.near as f32 && depth <= self.range.far as f32;
            if in_range && normal.dot(ray) < -MIN_FACING {
                return Belongs::Behind { depth, normal };
            }
        }
        if self.is_last && empty > EMPTY_FACTOR * same { Belongs::Nowhere } else { Belongs::ToItsOwn }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Camera;
    use crate::image::Picture;
    use glam::DMat3;

    const SIZE: (u32, u32) = (48, 32);
    const RANGE: DepthRange = DepthRange { near: 1.0, far: 20.0 };
    /// Columns the near surface really covers.
    const TRUE_EDGE: usize = 20;

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
            translation: glam::DVec3::ZERO,
        }
    }

    /// A dark surface at depth 4 left of the edge, a bright one at depth 8 right of it.
    fn image() -> PackedImage {
        let (width, height) = SIZE;
        let gray = (0..width * height).map(|pixel| if (pixel % width) < TRUE_EDGE as u32 { 60 } else { 160 });
        PackedImage::new(&Picture::from_gray(width, height, gray.collect()).unwrap())
    }

    /// The near surface comes out some columns too wide.
    fn solutions(behind: f32, too_wide: usize) -> Vec<PixelEstimate> {
        let of = |pixel: usize| PixelEstimate {
            depth: if pixel % SIZE.0 as usize >= TRUE_EDGE + too_wide { behind } else { 4.0 },
            normal: Vec3::NEG_Z,
            consistent: 3,
            validated: true,
            ..PixelEstimate::default()
        };
        (0..(SIZE.0 * SIZE.1) as usize).map(of).collect()
    }

    #[test]
    fn a_near_surface_that_came_out_too_wide_ends_where_the_gray_values_do() {
        let mut trimmed = solutions(8.0, 4);
        trim(&camera(), &image(), RANGE, &mut trimmed, 10, false);
        for (pixel, solution) in trimmed.iter().enumerate() {
            let expected = if pixel % SIZE.0 as usize >= TRUE_EDGE { 8.0 } else { 4.0 };
            assert!((solution.depth - expected).abs() < 1e-3, "{} at {pixel}", solution.depth);
            assert!(solution.validated);
        }
    }

    #[test]
    fn passes_that_only_look_where_something_moved_find_all_that_moves() {
        let mut at_once = solutions(8.0, 4);
        trim(&camera(), &image(), RANGE, &mut at_once, 6, true);
        let mut one_by_one = solutions(8.0, 4);
        for _ in 0..6 {
            trim(&camera(), &image(), RANGE, &mut one_by_one, 1, true);
        }
        assert_eq!(at_once, one_by_one);
    }

    #[test]
    fn what_looks_alike_stays_and_so_does_a_single_surface() {
        let (width, height) = SIZE;
        let gray = vec![100; (width * height) as usize];
        let plain = PackedImage::new(&Picture::from_gray(width, height, gray).unwrap());
        let mut same = solutions(8.0, 4);
        trim(&camera(), &plain, RANGE, &mut same, 1, false);
        let moved = same.iter().zip(solutions(8.0, 4)).filter(|(after, before)| *after != before).count();
        // Where nothing tells the surfaces apart the nearer neighbors decide: no more than a column of ties.
        assert!(moved <= height as usize, "{moved}");
        let mut single = solutions(4.0, 4);
        trim(&camera(), &image(), RANGE, &mut single, 4, true);
        assert_eq!(single, solutions(4.0, 4));
    }

    #[test]
    fn pixels_before_nothing_are_given_up_where_no_search_follows() {
        for (is_last, kept) in [(false, TRUE_EDGE + 1), (true, TRUE_EDGE)] {
            let mut before_nothing = solutions(0.0, 1);
            before_nothing.iter_mut().for_each(|solution| solution.validated = solution.depth > 0.0);
            trim(&camera(), &image(), RANGE, &mut before_nothing, 4, is_last);
            let row = &before_nothing[16 * SIZE.0 as usize..][..SIZE.0 as usize];
            assert_eq!(row.iter().filter(|solution| solution.validated).count(), kept);
        }
    }

    #[test]
    fn a_surface_behind_that_leaves_the_depth_range_is_not_given_anything() {
        let range = DepthRange { near: 1.0, far: 6.0 };
        let mut trimmed = solutions(8.0, 4);
        trim(&camera(), &image(), range, &mut trimmed, 4, false);
        assert_eq!(trimmed, solutions(8.0, 4));
    }
}
