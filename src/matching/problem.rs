//! A reference view and its source views on one scale, in f32 and in the reference camera's frame.

use crate::geometry::{Camera, DepthRange, RelativePose, SearchRange};
use crate::image::PackedImage;
use crate::scene::CompactPlane;
use glam::{Mat3, Vec3};

/// The view whose maps are estimated.
#[derive(Debug, Clone)]
pub struct Problem<'a> {
    /// Its gray image.
    pub image: &'a PackedImage,
    /// 1 / fx and 1 / fy.
    pub inverse_focal: (f32, f32),
    /// cx and cy.
    pub principal: (f32, f32),
    /// The depths searched.
    pub range: SearchRange,
    /// Its source views, in the order of its list.
    pub sources: Vec<Source<'a>>,
}

/// A view the reference is matched with.
#[derive(Debug, Clone)]
pub struct Source<'a> {
    /// Its gray image.
    pub image: &'a PackedImage,
    /// Where it stands, in pixels.
    pub pose: RelativePose,
    /// Rotation from the reference camera's frame to its own.
    pub rotation: Mat3,
    /// Its center of projection in the reference camera's frame.
    pub center: Vec3,
    /// Its validated solutions, one a pixel.
    pub surface: &'a [CompactPlane],
}

impl<'a> Problem<'a> {
    /// A reference view without sources yet.
    pub fn new(camera: &Camera, image: &'a PackedImage, range: DepthRange) -> Problem<'a> {
        Problem {
            image,
            inverse_focal: ((1.0 / camera.fx) as f32, (1.0 / camera.fy) as f32),
            principal: (camera.cx as f32, camera.cy as f32),
            range: range.into(),
            sources: Vec::new(),
        }
    }

    /// `K^-1 [x y 1]`.
    #[inline(always)]
    pub fn ray(&self, x: f32, y: f32) -> Vec3 {
        Vec3::new(
            (x - self.principal.0) * self.inverse_focal.0,
            (y - self.principal.1) * self.inverse_focal.1,
            1.0,
        )
    }
}

impl<'a> Source<'a> {
    /// The source with this camera, seen from the reference camera.
    pub fn new(
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

/// Where a point falls in the source view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Column in pixels.
    pub x: f32,
    /// Row in pixels.
    pub y: f32,
}

impl Source<'_> {
    /// The pixel a homogeneous point falls on, `None` behind the camera or outside the image.
    #[inline(always)]
    pub fn project(&self, point: Vec3) -> Option<Projection> {
        let inverse = 1.0 / point.z;
        let (x, y) = (point.x * inverse, point.y * inverse);
        let (right, bottom) = ((self.image.width - 1) as f32, (self.image.height - 1) as f32);
        let inside = point.z > 0.0 && x >= 0.0 && y >= 0.0 && x <= right && y <= bottom;
        inside.then_some(Projection { x, y })
    }
}
