//! Plane-induced homographies in f32, split so that little is left to do for each hypothesis.

use crate::camera::Camera;
use glam::{DMat3, DVec3, Vec3};

/// A plane of the reference view written as inverse depth, which is linear in the pixel:
/// `1 / depth(x, y) = q . [x y 1]` with `q = -K^-T n / D`. Stored about a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlantedPlane {
    /// Inverse depth at the pixel.
    pub inverse_depth: f32,
    /// Its change per pixel along x.
    pub slope_x: f32,
    /// Its change per pixel along y.
    pub slope_y: f32,
}

impl SlantedPlane {
    /// The plane with unit `normal` through `depth` on `ray` (`K^-1 [x y 1]`) of a camera with these focal lengths.
    #[inline(always)]
    pub fn new(depth: f32, normal: Vec3, ray: Vec3, inverse_focal: (f32, f32)) -> SlantedPlane {
        let inverse_depth = 1.0 / depth;
        let scale = inverse_depth / normal.dot(ray);
        SlantedPlane {
            inverse_depth,
            slope_x: normal.x * inverse_focal.0 * scale,
            slope_y: normal.y * inverse_focal.1 * scale,
        }
    }

    /// What [`SlantedPlane::new`] makes it of: depth on the ray, and unit normal that faces the camera.
    #[inline(always)]
    pub fn depth_and_normal(&self, ray: Vec3, inverse_focal: (f32, f32)) -> (f32, Vec3) {
        let depth = 1.0 / self.inverse_depth;
        // The normal over its product with the ray.
        let (x, y) = (self.slope_x * depth / inverse_focal.0, self.slope_y * depth / inverse_focal.1);
        let normal = -Vec3::new(x, y, 1.0 - x * ray.x - y * ray.y);
        (depth, normal.normalize_or_zero())
    }

    /// Inverse depth at an offset in pixels.
    #[inline(always)]
    pub fn inverse_depth_at(&self, dx: f32, dy: f32) -> f32 {
        self.inverse_depth + self.slope_x * dx + self.slope_y * dy
    }
}

/// Where a source camera stands relative to the reference camera, in pixels: a reference pixel at inverse depth w
/// projects to `K'R K^-1 [x y 1] + w K't`, up to scale.
#[derive(Debug, Clone, Copy)]
pub struct RelativePose {
    /// Columns of `K' R K^-1`.
    pub infinite: [Vec3; 3],
    /// `K' t`.
    pub epipole: Vec3,
}

impl RelativePose {
    /// The pose of `source` seen from `reference`; worked out in f64, so that large world coordinates lose no digits.
    pub fn new(reference: &Camera, source: &Camera) -> RelativePose {
        let rotation = source.rotation * reference.rotation.transpose();
        let translation: DVec3 = source.translation - rotation * reference.translation;
        let infinite: DMat3 = source.calibration() * rotation * reference.calibration().inverse();
        RelativePose {
            infinite: [infinite.x_axis.as_vec3(), infinite.y_axis.as_vec3(), infinite.z_axis.as_vec3()],
            epipole: (source.calibration() * translation).as_vec3(),
        }
    }

    /// `K'R K^-1 [x y 1]`.
    #[inline(always)]
    pub fn at_infinity(&self, x: f32, y: f32) -> Vec3 {
        self.infinite[0] * x + self.infinite[1] * y + self.infinite[2]
    }

    /// The homography of a plane about a reference pixel with this [`RelativePose::at_infinity`].
    #[inline(always)]
    pub fn homography(&self, at_infinity: Vec3, plane: &SlantedPlane) -> PatchHomography {
        self.homography_about(at_infinity + self.epipole * plane.inverse_depth, plane)
    }

    /// The homography of a plane about a reference pixel that goes to `centre`.
    #[inline(always)]
    pub fn homography_about(&self, centre: Vec3, plane: &SlantedPlane) -> PatchHomography {
        PatchHomography {
            centre,
            along_x: self.infinite[0] + self.epipole * plane.slope_x,
            along_y: self.infinite[1] + self.epipole * plane.slope_y,
        }
    }
}

/// A homography about a reference pixel: the offset (dx, dy) goes to `centre + dx along_x + dy along_y`, homogeneous.
/// The third coordinate is the depth in the source view divided by the depth in the reference view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchHomography {
    /// Where the pixel itself goes.
    pub centre: Vec3,
    /// Change per pixel along x.
    pub along_x: Vec3,
    /// Change per pixel along y.
    pub along_y: Vec3,
}
