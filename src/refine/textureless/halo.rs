//! Halos of textureless regions: beside the outline of a region without a surface, windows reach over the
//! outline and match by what is beyond, up to half a window's width into the region. Such pixels have the
//! gray value of the region, or, in the glow of its edge, one nearer to it than to that of the surface.

use crate::geometry::{Grid, for_each_component};
use crate::image::{PackedImage, blurred, deviation};
use glam::Vec2;

/// Pixels by which a halo reaches into a region: the half side of a window at half size, at full size.
const MAX_WIDTH: usize = 12;
/// Fewest pixels of a region: smaller ones are spots of a surface.
const MIN_AREA: usize = 400;
/// Largest difference of blurred gray values to the region, in deviations of the noise.
const MAX_DIFFERENCE_NOISE: f32 = 1.0;
/// Allowance on top of it, in gray values: ringing of compressed images.
const MAX_DIFFERENCE_OFFSET: f32 = 1.0;
/// The same, as a fraction of the difference of the surface, [`AHEAD`] pixels farther from the region: the
/// outline is where half of the light is the region's.
const MAX_DIFFERENCE_FRACTION: f32 = 0.5;
/// Pixels beyond which the blur of an edge is over.
const AHEAD: f32 = 4.0;

/// A pixel that a halo grows from.
#[derive(Clone, Copy)]
struct Front {
    pixel: usize,
    /// The pixel of the region that it was reached from.
    origin: usize,
    /// Gray value of the region there.
    gray: f32,
}

/// Mean gray value of the region within two columns and rows of one of its pixels.
fn region_gray(image: &PackedImage, is_region: &[bool], pixel: usize) -> f32 {
    let grid = Grid { width: image.width, height: image.height };
    let offsets = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy)));
    let (mut sum, mut count) = (0u32, 0u32);
    for (x, y) in offsets.filter_map(|offset| grid.neighbor(grid.position(pixel), offset)) {
        if is_region[grid.index((x, y))] {
            sum += u32::from(image.gray(x, y));
            count += 1;
        }
    }
    sum as f32 / count as f32
}

/// The pixel [`AHEAD`] beyond another, seen from an origin; `None` outside of the image.
fn ahead(grid: Grid, origin: usize, pixel: usize) -> Option<usize> {
    let [from, to] = [origin, pixel].map(|pixel| {
        let (x, y) = grid.position(pixel);
        Vec2::new(x as f32, y as f32)
    });
    let step = ((to - from).normalize_or_zero() * AHEAD).round();
    grid.neighbor(grid.position(pixel), (step.x as i32, step.y as i32)).map(|position| grid.index(position))
}

/// The pixels around regions without evidence that have the gray value of the region, ascending.
pub(crate) fn halos(image: &PackedImage, has_no_evidence: &[bool]) -> Vec<u32> {
    let grid = Grid { width: image.width, height: image.height };
    let mut is_taken = has_no_evidence.to_vec();
    let neighbors = |pixel| grid.four_neighbors(pixel).into_iter().flatten();
    let is_at_rim = |&&pixel: &&usize| neighbors(pixel).any(|other| !has_no_evidence[other]);
    let start = |&pixel: &usize| {
        let gray = region_gray(image, has_no_evidence, pixel);
        Front { pixel, origin: pixel, gray }
    };
    let mut front: Vec<Front> = Vec::new();
    for_each_component(
        grid,
        |pixel| has_no_evidence[pixel],
        |_, _| true,
        |region| {
            if region.len() >= MIN_AREA {
                front.extend(region.iter().filter(is_at_rim).map(start));
            }
        },
    );
    let mut halo = Vec::new();
    for _ in 0..MAX_WIDTH {
        let mut next = Vec::new();
        for from in front {
            let Front { pixel, origin, gray } = from;
            for other in neighbors(pixel) {
                if is_taken[other] {
                    continue;
                }
                let difference = |pixel| (blurred(image, pixel, 1) - gray).abs();
                let of_surface = ahead(grid, origin, other).map_or(0.0, difference);
                let limit = MAX_DIFFERENCE_NOISE * deviation(image, other) + MAX_DIFFERENCE_OFFSET;
                if difference(other) < limit.max(MAX_DIFFERENCE_FRACTION * of_surface) {
                    is_taken[other] = true;
                    halo.push(other as u32);
                    next.push(Front { pixel: other, ..from });
                }
            }
        }
        front = next;
    }
    halo.sort_unstable();
    halo
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;

    const GRID: Grid = Grid { width: 60, height: 40 };

    /// The rows of the halo in column 30 below a region of 20 rows, with gray values by row.
    fn halo_below(gray: impl Fn(usize) -> u8, rows: usize) -> Vec<usize> {
        let grays = (0..GRID.pixels()).map(|pixel| gray(GRID.position(pixel).1)).collect();
        let image = PackedImage::new(&Picture::from_gray(60, 40, grays).unwrap());
        let region: Vec<bool> = (0..GRID.pixels()).map(|pixel| GRID.position(pixel).1 < rows).collect();
        let positions = halos(&image, &region).into_iter().map(|pixel| GRID.position(pixel as usize));
        positions.filter(|position| position.0 == 30).map(|position| position.1).collect()
    }

    #[test]
    fn a_halo_ends_where_the_gray_value_is_nearer_to_that_of_the_surface() {
        // The blur of the edge goes from row 23 to row 27.
        let gray = |row: usize| 240 - 32 * (row.clamp(22, 27) - 22) as u8;
        let halo = halo_below(gray, 20);
        assert_eq!(halo, (20..25).collect::<Vec<_>>());
    }

    #[test]
    fn a_halo_is_no_wider_than_a_window_reaches_and_small_regions_have_none() {
        assert_eq!(halo_below(|_| 200, 20), (20..32).collect::<Vec<_>>());
        assert!(halo_below(|_| 200, 6).is_empty(), "360 pixels");
    }

    #[test]
    fn a_surface_without_blur_keeps_all_its_pixels() {
        let halo = halo_below(|row| if row < 20 { 240 } else { 80 }, 20);
        assert!(halo.is_empty(), "{halo:?}");
    }
}
