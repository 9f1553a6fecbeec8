//! How a source camera is projections relative to the reference camera.

use super::{Camera, Plane};
use glam::{DMat3, DVec3, Vec3};

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
}

/// The homography a plane of `reference`'s frame induces from `reference`'s to `source`'s pixels:
/// `H = K' (R - t n^T / D) K^-1` (equation 2 of the paper).
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
