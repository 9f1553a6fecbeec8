//! Depth ranges: the depths between which surfaces are searched.

use crate::error::{Error, Result};
use std::ops::RangeInclusive;

/// Depths that are finite in f32, as are their inverses.
const REPRESENTABLE: RangeInclusive<f64> = 1e-30..=1e30;

/// The range of depths in which surfaces are searched, in world units, `0 < near < far`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthRange {
    /// The smallest depth.
    pub near: f64,
    /// The largest depth.
    pub far: f64,
}

impl DepthRange {
    /// Returns an error unless `0 < near < far` and both are representable; `name` names the range in the
    /// error.
    pub fn check(&self, name: &str) -> Result<()> {
        let is_representable = |depth| REPRESENTABLE.contains(&depth);
        if self.near < self.far && is_representable(self.near) && is_representable(self.far) {
            return Ok(());
        }
        Err(Error::argument(
            name,
            format!("{} to {}", self.near, self.far),
            "finite depths of 1e-30 to 1e30 with 0 < near < far",
        ))
    }
}

/// A [`DepthRange`] in f32, as the search uses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchRange {
    /// The smallest depth.
    pub near: f32,
    /// The largest depth.
    pub far: f32,
}

impl From<DepthRange> for SearchRange {
    fn from(range: DepthRange) -> SearchRange {
        SearchRange { near: range.near as f32, far: range.far as f32 }
    }
}

impl SearchRange {
    /// Whether a depth lies in the range; false for NaN.
    #[inline(always)]
    pub(crate) fn contains(&self, depth: f32) -> bool {
        depth >= self.near && depth <= self.far
    }

    /// The nearest depth in the range.
    #[inline(always)]
    pub(crate) fn clamp(&self, depth: f32) -> f32 {
        depth.clamp(self.near, self.far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_ranges_that_are_empty_or_not_representable_are_errors() {
        let check = |near, far| DepthRange { near, far }.check("range");
        assert_eq!(check(0.5, 12.0), Ok(()));
        for (near, far) in [(2.0, 1.0), (1.0, 1.0), (0.0, 1.0), (-1.0, 1.0), (1e-60, 1.0), (1.0, 1e60)] {
            assert!(check(near, far).is_err(), "{near} to {far}");
        }
        for (near, far) in [(f64::NAN, 1.0), (1.0, f64::NAN), (1.0, f64::INFINITY)] {
            assert!(check(near, far).is_err(), "{near} to {far}");
        }
    }
}
