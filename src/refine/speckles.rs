//! Speckle removal: small islands of validated planes that no surface around them continues are chance
//! matches of weak or repeated texture, and lose their validation, as stereo matchers commonly do with the
//! speckles of a disparity map.
//!
//! Neighboring pixels belong to the same island where the plane of either predicts the depth of the other.
//! O(1) for each pixel.

use super::{Domain, Filter, FilteredView};
use crate::geometry::{SlantedPlane, for_each_component};
use crate::scene::PixelEstimate;

/// Relative error of the inverse depth up to which a plane predicts that of a neighbor: the largest error
/// that the default check tolerates, of both.
const SAME_SURFACE: f32 = 0.02;

/// Takes the validation from islands of at most this many pixels.
pub(crate) struct RemoveSpeckles {
    /// Largest number of pixels of a speckle; 0 removes none.
    pub max_size: u32,
}

impl Filter for RemoveSpeckles {
    fn reach(&self) -> Option<usize> {
        Some(self.max_size as usize + 1)
    }

    fn domain(&self) -> Domain {
        Domain::Validated
    }

    fn apply(&self, view: &FilteredView, planes: &mut [PixelEstimate]) -> Vec<u32> {
        if self.max_size == 0 {
            return Vec::new();
        }
        let mut speckles: Vec<u32> = Vec::new();
        let is_validated = |pixel: usize| self.domain().includes(&planes[pixel]);
        let is_connected = |a: usize, b: usize| is_same_surface(view, planes, a, b);
        for_each_component(view.grid(), is_validated, is_connected, |pixels| {
            if pixels.len() <= self.max_size as usize {
                speckles.extend(pixels.iter().map(|&pixel| pixel as u32));
            }
        });
        speckles.sort_unstable();
        speckles.iter().for_each(|&pixel| planes[pixel as usize].validated = false);
        speckles
    }
}

/// Whether the plane of either of two neighboring pixels predicts the depth of the other.
fn is_same_surface(view: &FilteredView, planes: &[PixelEstimate], a: usize, b: usize) -> bool {
    let inverse_focal = (1.0 / view.camera.fx as f32, 1.0 / view.camera.fy as f32);
    let predicts = |from: usize, to: usize| {
        let ((x, y), (to_x, to_y)) = (view.grid().position(from), view.grid().position(to));
        let plane =
            SlantedPlane::new(planes[from].depth, planes[from].normal, view.ray((x, y)), inverse_focal);
        let predicted = plane.inverse_depth_at(to_x as f32 - x as f32, to_y as f32 - y as f32);
        (predicted * planes[to].depth - 1.0).abs() <= SAME_SURFACE
    };
    predicts(a, b) || predicts(b, a)
}

#[cfg(test)]
mod tests {
    use super::super::contract::assert_contract;
    use super::*;
    use crate::geometry::Grid;
    use crate::testing::{self, RANGE, World};

    /// The exact wall, validated, with these pixels at another depth or not validated.
    fn wall_with(changes: impl Fn(usize, usize) -> Option<f32>) -> (World, Vec<PixelEstimate>) {
        let world = World::five();
        let mut planes = testing::exact(&world.cameras[0]).planes;
        let grid = Grid { width: 36, height: 28 };
        for (pixel, plane) in planes.iter_mut().enumerate() {
            let (x, y) = grid.position(pixel);
            let scale = changes(x, y);
            plane.validated = scale.is_some();
            plane.depth *= scale.unwrap_or(1.0);
        }
        (world, planes)
    }

    /// The pixels that lose their validation.
    fn removed(max_size: u32, (world, mut planes): (World, Vec<PixelEstimate>)) -> usize {
        let (camera, image) = (&world.cameras[0], &world.images[0]);
        let view = FilteredView { camera, image, range: RANGE, level: crate::simd::SimdLevel::detect() };
        RemoveSpeckles { max_size }.apply(&view, &mut planes).len()
    }

    #[test]
    fn keeps_the_contract() {
        // Of the size of the contract's strip before the wall.
        assert_contract(|_, _| Box::new(RemoveSpeckles { max_size: 1000 }));
    }

    #[test]
    fn islands_up_to_the_size_are_removed_and_larger_ones_stay() {
        let island = |x: usize, y: usize| (10..14).contains(&x) && (10..13).contains(&y);
        let in_front = |x, y| Some(if island(x, y) { 0.9 } else { 1.0 });
        let alone = |x, y| island(x, y).then_some(1.0);
        for (max_size, expected) in [(0, 0), (11, 0), (12, 12)] {
            assert_eq!(removed(max_size, wall_with(in_front)), expected, "in front of a surface");
            assert_eq!(removed(max_size, wall_with(alone)), expected, "without a surface around it");
        }
    }

    #[test]
    fn a_slanted_surface_is_one_island() {
        // Depths of the wall differ by more than 2 % between pixels that are a few columns apart.
        assert_eq!(removed(300, wall_with(|_, _| Some(1.0))), 0);
        let checkered = |x: usize, y: usize| (x + y).is_multiple_of(2).then_some(1.0);
        assert_eq!(removed(1, wall_with(checkered)), 36 * 28 / 2, "each pixel by itself");
    }
}
