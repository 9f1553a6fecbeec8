//! A reference view and its source views at one scale, in f32 and in the reference camera's frame.

use crate::geometry::{Camera, DepthRange, RelativePose, SearchRange};
use crate::image::PackedImage;
use crate::scene::CompactPlane;
use glam::{Mat3, Vec3};

/// A matching problem: the reference view, whose maps are estimated, and its source views.
#[derive(Debug, Clone)]
pub(crate) struct Problem<'a> {
    /// Gray image of the reference view.
    pub image: &'a PackedImage,
    /// 1 / fx and 1 / fy, in 1 / px.
    pub inverse_focal: (f32, f32),
    /// cx and cy, in px.
    pub principal: (f32, f32),
    /// Range that depths are limited to.
    pub range: SearchRange,
    /// The part of it in which most surfaces are; all of it unless a caller narrows it.
    pub likely_range: SearchRange,
    /// The source views, in the order of the reference view's source list.
    pub sources: Vec<Source<'a>>,
}

/// A source view: one that the reference view is matched with.
#[derive(Debug, Clone)]
pub(crate) struct Source<'a> {
    /// Gray image of the source view.
    pub image: &'a PackedImage,
    /// Pose relative to the reference camera, in pixel coordinates.
    pub pose: RelativePose,
    /// Rotation from the reference camera's frame to the source camera's.
    pub rotation: Mat3,
    /// Center of projection in the reference camera's frame.
    pub center: Vec3,
    /// Validated planes of the source view, one per pixel; empty where none are published.
    pub surface: &'a [CompactPlane],
}

impl<'a> Problem<'a> {
    /// A reference view, without source views yet.
    pub(crate) fn new(camera: &Camera, image: &'a PackedImage, range: DepthRange) -> Problem<'a> {
        Problem {
            image,
            inverse_focal: ((1.0 / camera.fx) as f32, (1.0 / camera.fy) as f32),
            principal: (camera.cx as f32, camera.cy as f32),
            range: range.into(),
            likely_range: range.into(),
            sources: Vec::new(),
        }
    }

    /// `K^-1 [x y 1]`: the ray of a pixel, with z = 1.
    #[inline(always)]
    pub(crate) fn ray(&self, x: f32, y: f32) -> Vec3 {
        Vec3::new(
            (x - self.principal.0) * self.inverse_focal.0,
            (y - self.principal.1) * self.inverse_focal.1,
            1.0,
        )
    }
}

impl<'a> Source<'a> {
    /// A source view with this camera, relative to the reference camera.
    pub(crate) fn new(
        reference: &Camera,
        camera: &Camera,
        image: &'a PackedImage,
        surface: &'a [CompactPlane],
    ) -> Source<'a> {
        let rotation = camera.rotation * reference.rotation.transpose();
        let center = rotation.transpose() * (rotation * reference.translation - camera.translation);
        Source {
            image,
            pose: RelativePose::new(reference, camera),
            rotation: rotation.as_mat3(),
            center: center.as_vec3(),
            surface,
        }
    }
}

/// The pixel that a point projects to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Projection {
    /// Column in pixels.
    pub x: f32,
    /// Row in pixels.
    pub y: f32,
}

impl Source<'_> {
    /// Dehomogenizes a point of the source view; `None` behind the camera or outside the image.
    #[inline(always)]
    pub(crate) fn project(&self, point: Vec3) -> Option<Projection> {
        let inverse = 1.0 / point.z;
        let (x, y) = (point.x * inverse, point.y * inverse);
        let (right, bottom) = ((self.image.width - 1) as f32, (self.image.height - 1) as f32);
        let inside = point.z > 0.0 && x >= 0.0 && y >= 0.0 && x <= right && y <= bottom;
        inside.then_some(Projection { x, y })
    }
}
