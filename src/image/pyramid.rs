//! The views of a scene on one scale of the pyramid.

use super::{PackedImage, Picture};
use crate::camera::Camera;
use crate::scene::{DepthRange, Scene, View};

/// A view reduced to one scale.
#[derive(Debug, Clone)]
pub struct ScaledView {
    /// Its camera on this scale.
    pub camera: Camera,
    /// Its grey image in the layout the kernels sample.
    pub image: PackedImage,
    /// Where a depth is wanted: where any pixel of full size wants one.
    pub mask: Option<Vec<bool>>,
    /// Where surfaces are looked for.
    pub range: DepthRange,
}

impl ScaledView {
    /// The view of a scene with this index, its image halved this many times.
    pub fn of(scene: &Scene, index: usize, halvings: u32) -> ScaledView {
        ScaledView::new(&scene.views()[index], scene.depth_range(index), halvings)
    }

    fn new(view: &View, range: DepthRange, halvings: u32) -> ScaledView {
        let mut camera = view.camera;
        let mut halved: Option<Picture> = None;
        let mut mask = view.mask.clone();
        for _ in 0..halvings {
            halved = Some(halved.as_ref().unwrap_or(&view.picture).halved());
            mask = mask.map(|mask| halve_mask(&mask, &camera));
            camera = camera.halved();
        }
        ScaledView { camera, image: PackedImage::new(halved.as_ref().unwrap_or(&view.picture)), mask, range }
    }
}

fn halve_mask(mask: &[bool], camera: &Camera) -> Vec<bool> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let coarse = camera.halved();
    let (coarse_width, coarse_height) = (coarse.width as usize, coarse.height as usize);
    let wanted = |x: usize, y: usize| mask[y.min(height - 1) * width + x.min(width - 1)];
    let any = |pixel: usize| {
        let (x, y) = (2 * (pixel % coarse_width), 2 * (pixel / coarse_width));
        wanted(x, y) || wanted(x + 1, y) || wanted(x, y + 1) || wanted(x + 1, y + 1)
    };
    (0..coarse_width * coarse_height).map(any).collect()
}
