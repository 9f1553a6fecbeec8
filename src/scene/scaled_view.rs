//! The views of a scene on one scale of the pyramid.

use crate::geometry::Camera;
use crate::geometry::DepthRange;
use crate::image::{Mask, halve_mask};
use crate::scene::Scene;

/// A view reduced to one scale, its image excepted.
#[derive(Debug, Clone)]
pub(crate) struct ScaledView {
    /// Its camera on this scale.
    pub camera: Camera,
    /// `true` where a depth is estimated: where the mask is set in any of the pixels of full size.
    pub mask: Option<Mask>,
    /// The range that depths are limited to.
    pub range: DepthRange,
    /// The part of it in which most surfaces are.
    pub likely_range: DepthRange,
}

impl ScaledView {
    /// The view of a scene with this index, reduced by this power of two.
    pub(crate) fn of(scene: &Scene, index: usize, downscale: u32) -> ScaledView {
        let view = &scene.views()[index];
        let (range, likely_range) = (scene.outer_range(index), scene.depth_range(index));
        let mut camera = view.camera;
        let mut mask = view.mask.as_ref().map(Mask::to_vec);
        for _ in 0..downscale.trailing_zeros() {
            mask = mask.map(|mask| halve_mask(&mask, &camera));
            camera = camera.halved();
        }
        ScaledView { camera, mask: mask.map(Mask::from), range, likely_range }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;
    use crate::scene::{ImageCache, View};
    use glam::{DMat3, DVec3};

    /// Two views of 5 x 3 pixels whose masks are set in one pixel only.
    fn scene(set_pixel: usize) -> Scene {
        let camera = Camera {
            width: 5,
            height: 3,
            fx: 8.0,
            fy: 8.0,
            cx: 2.0,
            cy: 1.0,
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        };
        let view = |name: &str| View {
            name: name.to_owned(),
            picture: Picture::from_gray(5, 3, (0..15).map(|pixel| pixel * 10).collect()).unwrap().into(),
            camera,
            mask: Some((0..15).map(|pixel| pixel == set_pixel).collect::<Vec<_>>().into()),
            depth_range: Some(DepthRange { near: 1.0, far: 2.0 }),
            sources: None,
        };
        Scene::new(vec![view("a"), view("b")], Vec::new()).unwrap()
    }

    #[test]
    fn a_coarse_mask_is_set_where_it_is_in_any_of_the_fine_pixels() {
        for set_pixel in 0..15 {
            let (x, y) = (set_pixel % 5, set_pixel / 5);
            for level in 0..4usize {
                let view = ScaledView::of(&scene(set_pixel), 0, 1 << level);
                let width = view.camera.width as usize;
                let mask = view.mask.as_ref().unwrap().to_vec();
                assert_eq!(mask.len(), view.camera.pixels());
                let expected = (y >> level) * width + (x >> level);
                assert!((0..mask.len()).all(|pixel| mask[pixel] == (pixel == expected)));
            }
        }
    }

    #[test]
    fn image_camera_and_mask_are_halved_together() {
        let scene = scene(0);
        let sizes = [(1, (5, 3)), (2, (3, 2)), (4, (2, 1)), (8, (1, 1)), (16, (1, 1))];
        let photographs = scene.views().iter().map(|view| view.picture.clone()).collect();
        let images = ImageCache::new(photographs, sizes.map(|(downscale, _)| downscale).to_vec(), usize::MAX);
        for (scale, (downscale, size)) in sizes.into_iter().enumerate() {
            for index in 0..2 {
                let (view, image) =
                    (ScaledView::of(&scene, index, downscale), images.get(scale, index).unwrap());
                assert_eq!((view.camera.width, view.camera.height), size);
                assert_eq!((image.width as u32, image.height as u32), size);
                assert_eq!(view.range, DepthRange { near: 1.0, far: 2.0 });
            }
        }
        let halved = images.get(1, 1).unwrap();
        assert_eq!(halved.gray(0, 0), 30, "the mean of 0, 10, 50 and 60");
        assert_eq!(halved.gray(2, 1), 140, "the last pixel alone");
    }
}
