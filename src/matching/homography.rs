//! Plane-induced homographies in f32, split so that little is left to do for each hypothesis.

use crate::geometry::{RelativePose, SlantedPlane};
use glam::Vec3;

/// A homography about a reference pixel: the offset (dx, dy) goes to `center + dx along_x + dy along_y`, homogeneous.
/// The third coordinate is the depth in the source view divided by the depth in the reference view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchHomography {
    /// Where the pixel itself goes.
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
