//! Pinhole cameras in f64.
//!
//! Conventions: `x_cam = R * X_world + t` with x right, y down, z forward; pixel centers are integers, the
//! top-left pixel's center is (0, 0); depth is z in the camera frame.

use super::Grid;
use crate::error::{Error, Result};
use glam::{DMat3, DVec2, DVec3};
use std::ops::RangeInclusive;

/// A calibrated pinhole camera without skew or distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Width of its image in pixels.
    pub width: u32,
    /// Height of its image in pixels.
    pub height: u32,
    /// Focal length in pixels along x.
    pub fx: f64,
    /// Focal length in pixels along y.
    pub fy: f64,
    /// Column of the principal point, in pixels; the center of the top-left pixel is 0.
    pub cx: f64,
    /// Row of the principal point, in pixels; the center of the top-left pixel is 0.
    pub cy: f64,
    /// Rotation from the world frame to the camera frame.
    pub rotation: DMat3,
    /// Translation from the world frame to the camera frame, in world units.
    pub translation: DVec3,
}

impl Camera {
    /// Largest width and height of an image, in pixels.
    pub const MAX_SIDE: u32 = 32_768;

    /// Smallest and largest focal length, in pixels: no lens is beyond, and angles stay exact.
    pub(crate) const FOCAL_LENGTHS: RangeInclusive<f64> = 1e-3..=1e9;
    /// Largest distance of the principal point from the top-left pixel along x and y, in pixels.
    pub(crate) const MAX_PRINCIPAL_POINT: f64 = 1e9;
    /// Largest component of the translation, in world units: its square is finite in f32.
    pub(crate) const MAX_TRANSLATION: f64 = 1e18;

    /// Returns an error unless every field is in its valid range; `name` names the camera in the error.
    ///
    /// # Errors
    /// Focal lengths beyond 0.001 to 1e9 pixels; a principal point beyond 1e9 pixels; a translation beyond
    /// 1e18 world units; a matrix that is no rotation; sides beyond 1 to [`Camera::MAX_SIDE`] pixels.
    pub fn check(&self, name: &str) -> Result<()> {
        for (field, side) in [("width", self.width), ("height", self.height)] {
            if side == 0 || side > Self::MAX_SIDE {
                let expected = format!("1 to {} pixels", Self::MAX_SIDE);
                return Err(Error::argument(format!("{name}.{field}"), side, expected));
            }
        }
        for (field, focal) in [("fx", self.fx), ("fy", self.fy)] {
            if !Self::FOCAL_LENGTHS.contains(&focal) {
                let expected = "a finite focal length above 0, of 0.001 to 1e9 pixels";
                return Err(Error::argument(format!("{name}.{field}"), focal, expected));
            }
        }
        for (field, value) in [("cx", self.cx), ("cy", self.cy)] {
            if value.is_nan() || value.abs() > Self::MAX_PRINCIPAL_POINT {
                let expected = "a finite number of pixels, of -1e9 to 1e9";
                return Err(Error::argument(format!("{name}.{field}"), value, expected));
            }
        }
        let is_translation = |value: f64| value.abs() <= Self::MAX_TRANSLATION;
        if !self.translation.to_array().into_iter().all(is_translation) {
            let expected = "finite numbers of -1e18 to 1e18";
            return Err(Error::argument(format!("{name}.translation"), self.translation, expected));
        }
        let deviation = self.rotation * self.rotation.transpose() - DMat3::IDENTITY;
        let is_orthonormal = deviation.to_cols_array().iter().all(|e| e.abs() < 1e-4);
        if !(is_orthonormal && self.rotation.determinant() > 0.0) {
            let expected = "a rotation (orthonormal, determinant 1)";
            return Err(Error::argument(format!("{name}.rotation"), self.rotation, expected));
        }
        Ok(())
    }

    /// Number of pixels of the image.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The pixel grid of the image.
    pub(crate) fn grid(&self) -> Grid {
        Grid { width: self.width as usize, height: self.height as usize }
    }

    /// The calibration matrix K.
    pub fn calibration(&self) -> DMat3 {
        DMat3::from_cols(
            DVec3::new(self.fx, 0.0, 0.0),
            DVec3::new(0.0, self.fy, 0.0),
            DVec3::new(self.cx, self.cy, 1.0),
        )
    }

    /// The center of projection in the world frame.
    pub fn center(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }

    /// `K^-1 [x y 1]`: the direction of a pixel's ray in the camera frame, with z = 1.
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        DVec3::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy, 1.0)
    }

    /// Transforms a world point into the camera frame.
    pub fn to_camera(&self, world: DVec3) -> DVec3 {
        self.rotation * world + self.translation
    }

    /// The world point at `depth` on the ray of `pixel`.
    pub fn unproject(&self, pixel: DVec2, depth: f64) -> DVec3 {
        self.rotation.transpose() * (self.ray(pixel) * depth - self.translation)
    }

    /// Projects a point of the camera frame; `None` at or behind the camera.
    pub fn project_camera(&self, point: DVec3) -> Option<DVec2> {
        (point.z > 0.0)
            .then(|| DVec2::new(self.fx * point.x / point.z + self.cx, self.fy * point.y / point.z + self.cy))
    }

    /// Projects a world point to its pixel and depth; `None` at or behind the camera.
    pub fn project(&self, world: DVec3) -> Option<(DVec2, f64)> {
        let point = self.to_camera(world);
        self.project_camera(point).map(|pixel| (pixel, point.z))
    }

    /// Column and row of the pixel whose area contains `pixel`; `None` outside the image.
    pub fn nearest_pixel(&self, pixel: DVec2) -> Option<(u32, u32)> {
        let (x, y) = ((pixel.x + 0.5).floor(), (pixel.y + 0.5).floor());
        let inside = x >= 0.0 && y >= 0.0 && x < f64::from(self.width) && y < f64::from(self.height);
        inside.then_some((x as u32, y as u32))
    }

    /// The camera of the image at half size, in which a pixel is the mean of 2 x 2. Odd sides are rounded up.
    pub fn halved(&self) -> Camera {
        Camera {
            width: self.width.div_ceil(2),
            height: self.height.div_ceil(2),
            fx: self.fx / 2.0,
            fy: self.fy / 2.0,
            // The center of coarse pixel X lies at fine coordinate 2 X + 0.5.
            cx: (self.cx - 0.5) / 2.0,
            cy: (self.cy - 0.5) / 2.0,
            ..*self
        }
    }
}
