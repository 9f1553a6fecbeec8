//! Sampling a source image through a homography, eight samples at a time.

use super::PatchHomography;
use crate::image::PackedImage;
use crate::simd::Simd;
use glam::Vec3;

/// A homography and the source's border, in all lanes.
#[derive(Clone, Copy)]
pub(super) struct Warp<S: Simd> {
    centre: [S::F32; 3],
    along_x: [S::F32; 3],
    along_y: [S::F32; 3],
    right: S::F32,
    bottom: S::F32,
}

impl<S: Simd> Warp<S> {
    #[inline(always)]
    pub fn new(simd: S, source: &PackedImage, homography: &PatchHomography) -> Warp<S> {
        Warp {
            centre: splat(simd, homography.centre),
            along_x: splat(simd, homography.along_x),
            along_y: splat(simd, homography.along_y),
            right: simd.splat((source.width - 1) as f32),
            bottom: simd.splat((source.height - 1) as f32),
        }
    }

    /// The bilinear samples at these offsets from the pixel; beyond the border it repeats itself.
    #[inline(always)]
    pub fn sample(&self, simd: S, source: &PackedImage, dx: S::F32, dy: S::F32) -> S::F32 {
        let zero = simd.splat(0.0);
        let inverse_z = simd.div(simd.splat(1.0), self.at(simd, 2, dx, dy));
        // max gives 0 for what is not a number: samples on the source camera's plane.
        let x = simd.min(simd.max(simd.mul(self.at(simd, 0, dx, dy), inverse_z), zero), self.right);
        let y = simd.min(simd.max(simd.mul(self.at(simd, 1, dx, dy), inverse_z), zero), self.bottom);
        let (column, row) = (simd.whole(x), simd.whole(y));
        let (fraction_x, fraction_y) = (simd.sub(x, column), simd.sub(y, row));
        let [top_left, bottom_left, top_right, bottom_right] =
            simd.gather_bytes(&source.pairs, source.stride(), column, row);
        let top = simd.mul_add(fraction_x, simd.sub(top_right, top_left), top_left);
        let low = simd.mul_add(fraction_x, simd.sub(bottom_right, bottom_left), bottom_left);
        simd.mul_add(fraction_y, simd.sub(low, top), top)
    }
    /// A homogeneous coordinate of the samples.
    #[inline(always)]
    fn at(&self, simd: S, axis: usize, dx: S::F32, dy: S::F32) -> S::F32 {
        let across = simd.mul_add(dx, self.along_x[axis], self.centre[axis]);
        simd.mul_add(dy, self.along_y[axis], across)
    }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, vector: Vec3) -> [S::F32; 3] {
    [simd.splat(vector.x), simd.splat(vector.y), simd.splat(vector.z)]
}
