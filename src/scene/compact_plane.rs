//! The validated planes that a view publishes to other views.

use crate::geometry::SlantedPlane;

/// A validated plane as other views read it: a [`SlantedPlane`] in eight bytes, so that more of them stay in
/// cache. Slopes are rounded to the upper 16 bits of an f32, a relative error of at most 2^-9: half a pixel
/// away that is less than a millionth of most depths.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct CompactPlane {
    /// 0 where nothing is validated.
    inverse_depth: f32,
    /// Along x in the upper half, along y in the lower one.
    slopes: u32,
}

impl CompactPlane {
    /// Inverse depth at the pixel, 0 where nothing is validated.
    #[inline(always)]
    pub(crate) fn inverse_depth(&self) -> f32 {
        self.inverse_depth
    }

    /// As bytes, for a file of this version of the crate.
    #[cfg(feature = "io")]
    pub(crate) fn to_bytes(self) -> [u8; 8] {
        (u64::from(self.slopes) << 32 | u64::from(self.inverse_depth.to_bits())).to_le_bytes()
    }

    /// The plane of [`CompactPlane::to_bytes`].
    #[cfg(feature = "io")]
    pub(crate) fn from_bytes(bytes: [u8; 8]) -> CompactPlane {
        let bits = u64::from_le_bytes(bytes);
        CompactPlane { inverse_depth: f32::from_bits(bits as u32), slopes: (bits >> 32) as u32 }
    }

    /// Its change per pixel along x and y.
    #[inline(always)]
    pub(crate) fn slopes(&self) -> (f32, f32) {
        (f32::from_bits(self.slopes & 0xffff_0000), f32::from_bits(self.slopes << 16))
    }
}

impl From<SlantedPlane> for CompactPlane {
    fn from(plane: SlantedPlane) -> CompactPlane {
        // Rounds to nearest; the slopes of planes that face the camera are far from the largest f32.
        let upper_half = |slope: f32| slope.to_bits().saturating_add(0x8000) >> 16;
        let slopes = upper_half(plane.slope_x) << 16 | upper_half(plane.slope_y);
        CompactPlane { inverse_depth: plane.inverse_depth, slopes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_kept_to_a_half_thousandth_and_inverse_depths_exactly() {
        for slope in [0.0, 1e-3, -1e-3, 0.123_456, -7.0, 3.3e-9] {
            let plane = SlantedPlane { inverse_depth: 0.7, slope_x: slope, slope_y: -0.5 * slope };
            let compact = CompactPlane::from(plane);
            assert_eq!(compact.inverse_depth(), 0.7);
            let (x, y) = compact.slopes();
            assert!((x - slope).abs() <= slope.abs() / 512.0, "{x} for {slope}");
            assert!((y + 0.5 * slope).abs() <= slope.abs() / 1024.0, "{y} for {}", -0.5 * slope);
        }
        assert_eq!(CompactPlane::default().slopes(), (0.0, 0.0));
    }
}
