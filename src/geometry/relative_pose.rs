//! The pose of a source camera relative to the reference camera, and plane-induced homographies.

use super::{Camera, Plane};
use glam::{DMat3, DVec3, Vec3};

/// The pose of a source camera relative to the reference camera, in pixel coordinates: a reference pixel at
/// inverse depth w projects to the homogeneous source pixel `K'R K^-1 [x y 1] + w K't`.
#[derive(Debug, Clone, Copy)]
pub struct RelativePose {
    /// Columns of `K'R K^-1`, the homography of the plane at infinity.
    pub infinite: [Vec3; 3],
    /// `K't`, the epipole of the reference camera in the source view.
    pub epipole: Vec3,
}

impl RelativePose {
    /// The pose of `source` relative to `reference`, computed in f64: large world coordinates lose no digits.
    pub fn new(reference: &Camera, source: &Camera) -> RelativePose {
        let rotation = source.rotation * reference.rotation.transpose();
        let translation: DVec3 = source.translation - rotation * reference.translation;
        let infinite: DMat3 = source.calibration() * rotation * reference.calibration().inverse();
        RelativePose {
            infinite: [infinite.x_axis.as_vec3(), infinite.y_axis.as_vec3(), infinite.z_axis.as_vec3()],
            epipole: (source.calibration() * translation).as_vec3(),
        }
    }

    /// `K'R K^-1 [x y 1]`: the homogeneous source pixel of a reference pixel at infinite depth.
    #[inline(always)]
    pub fn at_infinity(&self, x: f32, y: f32) -> Vec3 {
        self.infinite[0] * x + self.infinite[1] * y + self.infinite[2]
    }
}

/// The homography from pixels of `reference` to pixels of `source` that a plane in the frame of `reference`
/// induces: `H = K' (R - t n^T / D) K^-1` (equation 2 of the paper).
pub fn plane_homography(reference: &Camera, source: &Camera, plane: &Plane) -> DMat3 {
    let rotation = source.rotation * reference.rotation.transpose();
    let translation = source.translation - rotation * reference.translation;
    let scaled_normal = plane.normal / plane.distance;
    let outer = DMat3::from_cols(
        translation * scaled_normal.x,
        translation * scaled_normal.y,
        translation * scaled_normal.z,
    );
    source.calibration() * (rotation - outer) * reference.calibration().inverse()
}
