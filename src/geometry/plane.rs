//! Planes: in f64 by normal and distance, in f32 by what the solver keeps of them.

use super::{Camera, SearchRange};
use glam::{DVec2, DVec3, Vec3};

/// The smallest `-n . ray` of a plane that faces the camera: flatter ones have no stable homography.
pub const MIN_FACING: f32 = 0.02;

/// A plane `n . X = -D` in a camera's frame, with unit `n` facing the camera and `D > 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal, facing the camera.
    pub normal: DVec3,
    /// Distance from the camera's center.
    pub distance: f64,
}

impl Plane {
    /// The plane through the point at `depth` behind `pixel`.
    pub fn at(camera: &Camera, pixel: DVec2, depth: f64, normal: DVec3) -> Plane {
        Plane { normal, distance: -depth * normal.dot(camera.ray(pixel)) }
    }

    /// Depth of the plane behind `pixel` (equation 1 of the paper with its sign mended).
    pub fn depth(&self, camera: &Camera, pixel: DVec2) -> f64 {
        -self.distance / self.normal.dot(camera.ray(pixel))
    }
}

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

/// A plane at a pixel as the solver keeps it: the depth at the pixel and the normal, so that the same plane at another
/// pixel is a transfer and clamping to the depth range is exact.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PlaneHypothesis {
    /// Depth at the pixel, 0 where there is none.
    pub depth: f32,
    /// Unit normal in the camera frame, facing the camera.
    pub normal: Vec3,
}

impl PlaneHypothesis {
    /// Whether the depth lies within the range and the normal faces the camera along the pixel's ray.
    #[inline(always)]
    pub fn is_usable(&self, ray: Vec3, range: &SearchRange) -> bool {
        range.contains(self.depth) && self.normal.dot(ray) < -MIN_FACING
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_usable_within_the_range_and_facing_the_camera() {
        let range = SearchRange { near: 2.0, far: 5.0 };
        let is_usable = |depth, normal: Vec3| {
            PlaneHypothesis { depth, normal: normal.normalize() }.is_usable(Vec3::new(0.5, 0.0, 1.0), &range)
        };
        assert!(is_usable(2.0, Vec3::NEG_Z) && is_usable(5.0, Vec3::NEG_Z));
        for depth in [1.99, 5.01, 0.0, f32::NAN, f32::INFINITY] {
            assert!(!is_usable(depth, Vec3::NEG_Z), "{depth}");
        }
        // Perpendicular to the ray, and turned away.
        assert!(!is_usable(3.0, Vec3::new(1.0, 0.0, -0.5)) && !is_usable(3.0, Vec3::Z));
    }
}
