//! Cameras in C.

use super::status::Failure;
use crate::geometry::Camera;
use glam::{DMat3, DVec3};

/// A pinhole camera without distortion. x_cam = rotation * X_world + translation, with x right, y down, z
/// forward; depth is z. The center of the top-left pixel is (0, 0), as in OpenCV; COLMAP's principal points
/// are half a pixel larger. The layout of this struct is frozen.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_camera {
    /// Focal length in x, in pixels, of 0.001 to 1e9.
    pub fx: f64,
    /// Focal length in y, in pixels, of 0.001 to 1e9.
    pub fy: f64,
    /// Column of the principal point, in pixels, of -1e9 to 1e9.
    pub cx: f64,
    /// Row of the principal point, in pixels, of -1e9 to 1e9.
    pub cy: f64,
    /// Rotation from world to camera, row by row; orthonormal within 1e-4, determinant 1.
    pub rotation: [f64; 9],
    /// Translation from world to camera, in world units, of -1e18 to 1e18.
    pub translation: [f64; 3],
}

impl skep_camera {
    /// The camera of an image of this size; `name` is how an error calls it.
    pub fn sized(&self, (width, height): (u32, u32), name: &str) -> Result<Camera, Failure> {
        let camera = Camera {
            width,
            height,
            fx: self.fx,
            fy: self.fy,
            cx: self.cx,
            cy: self.cy,
            rotation: DMat3::from_cols_array(&self.rotation).transpose(),
            translation: DVec3::from_array(self.translation),
        };
        camera.check(name)?;
        Ok(camera)
    }

    pub fn of(camera: &Camera) -> skep_camera {
        skep_camera {
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
            rotation: camera.rotation.transpose().to_cols_array(),
            translation: camera.translation.to_array(),
        }
    }
}
