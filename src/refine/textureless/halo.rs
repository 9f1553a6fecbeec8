//! Halos of textureless regions: beside the outline of a region without a surface, windows reach over the
//! outline and match by what is beyond, up to half a window's width into the region. Such pixels have the
//! gray value of the region.

use crate::geometry::Grid;
use crate::image::{PackedImage, blurred, deviation};

/// Pixels by which a halo reaches into a region: the half side of a window at half size, at full size.
const MAX_WIDTH: usize = 12;
/// Fewest pixels of a region: smaller ones are spots of a surface.
const MIN_AREA: usize = 400;
/// Largest difference of blurred gray values to the region, in deviations of the noise.
const MAX_DIFFERENCE_NOISE: f32 = 1.0;
/// Allowance on top of it, in gray values: ringing of compressed images.
const MAX_DIFFERENCE_OFFSET: f32 = 1.0;

/// The pixels around regions without evidence that have the gray value of the region, ascending.
pub(crate) fn halos(image: &PackedImage, has_no_evidence: &[bool]) -> Vec<u32> {
    let grid = Grid { width: image.width, height: image.height };
    let mut is_taken = has_no_evidence.to_vec();
    let mut is_traced = vec![false; grid.pixels()];
    let neighbors = |pixel| grid.four_neighbors(pixel).into_iter().flatten();
    let mut front: Vec<(usize, f32)> = Vec::new();
    for first in 0..grid.pixels() {
        if !has_no_evidence[first] || is_traced[first] {
            continue;
        }
        is_traced[first] = true;
        let mut region = vec![first];
        let mut next = 0;
        while next < region.len() {
            for other in neighbors(region[next]) {
                if has_no_evidence[other] && !std::mem::replace(&mut is_traced[other], true) {
                    region.push(other);
                }
            }
            next += 1;
        }
        if region.len() >= MIN_AREA {
            let is_at_rim = |&&pixel: &&usize| neighbors(pixel).any(|other| !has_no_evidence[other]);
            front.extend(region.iter().filter(is_at_rim).map(|&pixel| (pixel, blurred(image, pixel, 2))));
        }
    }
    let mut halo = Vec::new();
    for _ in 0..MAX_WIDTH {
        let mut next = Vec::new();
        for (pixel, gray) in front {
            for other in neighbors(pixel) {
                if is_taken[other] {
                    continue;
                }
                let difference = (blurred(image, other, 1) - gray).abs();
                if difference < MAX_DIFFERENCE_NOISE * deviation(image, other) + MAX_DIFFERENCE_OFFSET {
                    is_taken[other] = true;
                    halo.push(other as u32);
                    next.push((other, gray));
                }
            }
        }
        front = next;
    }
    halo.sort_unstable();
    halo
}
