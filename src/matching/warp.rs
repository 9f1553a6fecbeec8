//! Sample positions of a patch in a source image under a homography, eight at a time.

use super::PatchHomography;
use crate::image::PackedImage;
use crate::simd::{SUBPIXEL_STEPS, Simd, Taps};
use glam::Vec3;

/// A homography, broadcast to all lanes, and the source image it maps to.
#[derive(Clone, Copy)]
pub(super) struct Warp<'a, S: Simd> {
    center: [S::F32; 3],
    along_x: [S::F32; 3],
    along_y: [S::F32; 3],
    source: &'a Taps,
}

impl<'a, S: Simd> Warp<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, source: &'a PackedImage, homography: &PatchHomography) -> Warp<'a, S> {
        Warp {
            center: splat(simd, homography.center),
            along_x: splat(simd, homography.along_x),
            along_y: splat(simd, homography.along_y),
            source: &source.taps,
        }
    }

    /// Positions of these offsets from the pixel. Where the third homogeneous coordinate is 0, the quotient
    /// is infinite or NaN and is clamped to the border of the image.
    #[inline(always)]
    pub(super) fn positions(&self, simd: S, dx: S::F32, dy: S::F32) -> S::SamplePositions<'a> {
        let [x, y, z] = self.center;
        let [step_x, step_y, step_z] = self.step(simd, dx, dy);
        self.positions_at(simd, [simd.add(x, step_x), simd.add(y, step_y), simd.add(z, step_z)])
    }

    /// Positions of these offsets and of their opposites.
    #[inline(always)]
    pub(super) fn mirrored_positions(&self, simd: S, dx: S::F32, dy: S::F32) -> [S::SamplePositions<'a>; 2] {
        let [x, y, z] = self.center;
        let [step_x, step_y, step_z] = self.step(simd, dx, dy);
        [
            self.positions_at(simd, [simd.add(x, step_x), simd.add(y, step_y), simd.add(z, step_z)]),
            self.positions_at(simd, [simd.sub(x, step_x), simd.sub(y, step_y), simd.sub(z, step_z)]),
        ]
    }

    /// Position of the pixel itself, in all lanes.
    #[inline(always)]
    pub(super) fn center_position(&self, simd: S) -> S::SamplePositions<'a> {
        self.positions_at(simd, self.center)
    }

    /// Positions of homogeneous points.
    #[inline(always)]
    fn positions_at(&self, simd: S, [x, y, z]: [S::F32; 3]) -> S::SamplePositions<'a> {
        let scale = simd.div(simd.splat(SUBPIXEL_STEPS), z);
        simd.sample_positions(self.source, simd.mul(x, scale), simd.mul(y, scale))
    }

    /// `dx along_x + dy along_y`: the steps from the pixel's homogeneous point to the samples'.
    #[inline(always)]
    fn step(&self, simd: S, dx: S::F32, dy: S::F32) -> [S::F32; 3] {
        let mut steps = self.center;
        for (axis, step) in steps.iter_mut().enumerate() {
            *step = simd.mul_add(dy, self.along_y[axis], simd.mul(dx, self.along_x[axis]));
        }
        steps
    }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, vector: Vec3) -> [S::F32; 3] {
    [simd.splat(vector.x), simd.splat(vector.y), simd.splat(vector.z)]
}
