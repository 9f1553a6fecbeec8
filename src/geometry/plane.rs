//! Planes in three forms: normal and distance (f64), inverse depth (f32), depth and normal at a pixel (f32).

use super::{Camera, SearchRange};
use glam::{DVec2, DVec3, Vec3};

/// Minimum of `-n . ray` for a plane that faces the camera: the homography of a plane at grazing incidence is
/// unstable.
pub(crate) const MIN_FACING: f32 = 0.02;

/// A plane `n . X = -D` in the frame of a camera, with unit normal `n` facing the camera and `D > 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal `n`, facing the camera.
    pub normal: DVec3,
    /// Distance `D` from the camera's center.
    pub distance: f64,
}

impl Plane {
    /// The plane through the point at `depth` on the ray of `pixel`.
    pub fn at(camera: &Camera, pixel: DVec2, depth: f64, normal: DVec3) -> Plane {
        Plane { normal, distance: -depth * normal.dot(camera.ray(pixel)) }
    }

    /// Depth of the plane on the ray of `pixel` (equation 1 of the paper, with the minus sign it lacks).
    pub fn depth(&self, camera: &Camera, pixel: DVec2) -> f64 {
        -self.distance / self.normal.dot(camera.ray(pixel))
    }
}

/// A plane as inverse depth, which is linear in the pixel: `1 / depth(x, y) = q . [x y 1]` with `q = -K^-T n
/// / D`. Stored relative to a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlantedPlane {
    /// Inverse depth at the pixel.
    pub inverse_depth: f32,
    /// Change of the inverse depth per pixel along x.
    pub slope_x: f32,
    /// Change of the inverse depth per pixel along y.
    pub slope_y: f32,
}

impl SlantedPlane {
    /// The plane with unit `normal` through the point at `depth` on `ray` (`K^-1 [x y 1]`). `inverse_focal`
    /// is (1 / fx, 1 / fy).
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

    /// The inverse of [`SlantedPlane::new`]: depth on the ray, and unit normal facing the camera.
    #[inline(always)]
    pub fn depth_and_normal(&self, ray: Vec3, inverse_focal: (f32, f32)) -> (f32, Vec3) {
        let depth = 1.0 / self.inverse_depth;
        // x and y of n / (n . ray); z follows from the product with the ray being 1.
        let (x, y) = (self.slope_x * depth / inverse_focal.0, self.slope_y * depth / inverse_focal.1);
        let normal = -Vec3::new(x, y, 1.0 - x * ray.x - y * ray.y);
        (depth, normal.normalize_or_zero())
    }

    /// Inverse depth at an offset from the pixel, in px.
    #[inline(always)]
    pub fn inverse_depth_at(&self, dx: f32, dy: f32) -> f32 {
        self.inverse_depth + self.slope_x * dx + self.slope_y * dy
    }
}

/// A plane hypothesis of a pixel: depth at the pixel and normal. In this form clamping to the depth range is
/// exact, and the hypothesis of another pixel has to be transferred.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct PlaneHypothesis {
    /// Depth at the pixel; 0 where there is no hypothesis.
    pub depth: f32,
    /// Unit normal in the camera frame, facing the camera.
    pub normal: Vec3,
}

impl PlaneHypothesis {
    /// Whether the depth lies in the range and the normal faces the camera along the pixel's ray by
    /// [`MIN_FACING`].
    #[inline(always)]
    pub(crate) fn is_usable(&self, ray: Vec3, range: &SearchRange) -> bool {
        range.contains(self.depth) && self.normal.dot(ray) < -MIN_FACING
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usable_planes_lie_in_the_range_and_face_the_camera() {
        let range = SearchRange { near: 2.0, far: 5.0 };
        let is_usable = |depth, normal: Vec3| {
            PlaneHypothesis { depth, normal: normal.normalize() }.is_usable(Vec3::new(0.5, 0.0, 1.0), &range)
        };
        assert!(is_usable(2.0, Vec3::NEG_Z) && is_usable(5.0, Vec3::NEG_Z));
        for depth in [1.99, 5.01, 0.0, f32::NAN, f32::INFINITY] {
            assert!(!is_usable(depth, Vec3::NEG_Z), "{depth}");
        }
        // Perpendicular to the ray, and facing away.
        assert!(!is_usable(3.0, Vec3::new(1.0, 0.0, -0.5)) && !is_usable(3.0, Vec3::Z));
    }
}
