//! Plane-induced homographies in f32, factored so that a hypothesis costs nine multiply-adds.

use crate::geometry::{RelativePose, SlantedPlane};
use glam::Vec3;

/// A homography about a reference pixel: it maps the pixel at offset (dx, dy) to the homogeneous point
/// `center + dx along_x + dy along_y`.
/// The third coordinate is the depth in the source view divided by the depth in the reference view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchHomography {
    /// Image of the pixel itself.
    pub center: Vec3,
    /// Change per pixel along x.
    pub along_x: Vec3,
    /// Change per pixel along y.
    pub along_y: Vec3,
}

impl PatchHomography {
    /// The homography of a plane about a reference pixel with this [`RelativePose::at_infinity`].
    #[inline(always)]
    pub fn of_plane(pose: &RelativePose, at_infinity: Vec3, plane: &SlantedPlane) -> PatchHomography {
        PatchHomography {
            center: at_infinity + pose.epipole * plane.inverse_depth,
            along_x: pose.infinite[0] + pose.epipole * plane.slope_x,
            along_y: pose.infinite[1] + pose.epipole * plane.slope_y,
        }
    }
}
