//! The depths at which surfaces are searched.

use crate::error::{Error, Result};

/// The depths at which surfaces are looked for, in world units, `0 < near < far`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthRange {
    /// The smallest depth.
    pub near: f64,
    /// The largest depth.
    pub far: f64,
}

impl DepthRange {
    /// Refuses a range that holds no depth; `name` is how the error calls it.
    pub fn check(&self, name: &str) -> Result<()> {
        // Beyond these depths or their inverses leave the f32 of the solver.
        let representable = 1e-30..=1e30;
        if self.near < self.far && representable.contains(&self.near) && representable.contains(&self.far) {
            return Ok(());
        }
        Err(Error::argument(
            name,
            format!("{} to {}", self.near, self.far),
            "finite depths of 1e-30 to 1e30 with 0 < near < far",
        ))
    }
}

/// A [`DepthRange`] in the solver's f32.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchRange {
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
    /// Whether a depth lies within it; not where the depth is not a number.
    #[inline(always)]
    pub fn contains(&self, depth: f32) -> bool {
        depth >= self.near && depth <= self.far
    }

    /// The nearest depth within it.
    #[inline(always)]
    pub fn clamp(&self, depth: f32) -> f32 {
        depth.clamp(self.near, self.far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_depth_range_the_solver_cannot_hold_is_refused() {
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
