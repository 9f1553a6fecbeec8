//! Filters of the planes of one view, beyond the paper. In the order of a run:
//!
//! | filter | when | replaces |
//! |---|---|---|
//! | [`FillTextureless`] | after every search | planes in and around textureless regions |
//! | [`CorrectFattening`] | after a check that may be the last of its scale | validated planes |
//! | [`SmoothPlanes`] | after every check | validated planes |
//! | [`FillGaps`] | after the last cycle | planes that are not validated |
//! | [`RemoveSpeckles`] | after gap filling | validated planes, which lose their validation |
//!
//! All of them implement [`Filter`] and pass the test in `contract.rs`.
//!
//! [`FillTextureless`]: textureless::FillTextureless
//! [`CorrectFattening`]: foreground_fattening::CorrectFattening
//! [`SmoothPlanes`]: plane_smoothing::SmoothPlanes
//! [`FillGaps`]: gap_filling::FillGaps
//! [`RemoveSpeckles`]: speckles::RemoveSpeckles

pub(crate) mod foreground_fattening;
pub(crate) mod gap_filling;
pub(crate) mod plane_smoothing;
pub(crate) mod speckles;
pub(crate) mod stencil;
pub(crate) mod textureless;

#[cfg(test)]
mod contract;

use crate::geometry::{Camera, DepthRange, Grid, PlaneHypothesis, Position};
use crate::image::PackedImage;
use crate::scene::PixelEstimate;
use crate::simd::SimdLevel;
use glam::{DVec2, Vec3};

/// The view whose planes are filtered.
#[derive(Clone, Copy)]
pub(crate) struct FilteredView<'a> {
    /// Its camera on the scale of the planes.
    pub camera: &'a Camera,
    /// Its gray image, of the camera's size.
    pub image: &'a PackedImage,
    /// The range that depths are limited to.
    pub range: DepthRange,
    /// Instruction set.
    pub level: SimdLevel,
}

impl FilteredView<'_> {
    /// Its pixel grid.
    fn grid(&self) -> Grid {
        Grid { width: self.image.width, height: self.image.height }
    }

    /// `K^-1 [x y 1]` of a pixel.
    fn ray(&self, (x, y): Position) -> Vec3 {
        self.camera.ray(DVec2::new(x as f64, y as f64)).as_vec3()
    }

    /// Whether a plane at a pixel is within the depth range and faces the camera.
    fn is_usable(&self, plane: PlaneHypothesis, position: Position) -> bool {
        plane.is_usable(self.ray(position), &self.range.into())
    }
}

/// The pixels whose planes a filter may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Domain {
    /// Pixels with a validated plane.
    Validated,
    /// Pixels with a plane that is not validated.
    Unvalidated,
    /// Pixels with a plane.
    All,
}

impl Domain {
    /// Whether it includes a pixel with this estimate.
    pub(crate) fn includes(self, estimate: &PixelEstimate) -> bool {
        let has_plane = estimate.depth > 0.0;
        match self {
            Domain::Validated => has_plane && estimate.validated,
            Domain::Unvalidated => has_plane && !estimate.validated,
            Domain::All => has_plane,
        }
    }
}

/// A filter of the planes of one view, in place.
///
/// The contract, which `contract.rs` tests for every filter:
/// - pixels outside of the domain keep their estimates, to the bit; pixels without a plane are outside of
///   every domain;
/// - new planes are usable: depth in the range, unit normal that faces the camera, no NaN;
/// - a plane that the surrounding planes agree with stays the same up to rounding (relative 1e-5);
/// - the result is the same, to the bit, for every number of threads;
/// - a new estimate depends on nothing farther away than the reach.
pub(crate) trait Filter: Sync {
    /// Largest distance in pixels, along x or y, of a plane or gray value that the new estimate of a pixel
    /// depends on; `None` where it depends on a region of any size.
    #[cfg_attr(
        not(test),
        allow(dead_code, reason = "filters run on whole images so far; the contract test reads it")
    )]
    fn reach(&self) -> Option<usize>;

    /// The pixels whose estimates it may replace.
    fn domain(&self) -> Domain;

    /// Replaces estimates and returns the pixels with a replaced one (also where the new one is equal),
    /// ascending, each once.
    fn apply(&self, view: &FilteredView, planes: &mut [PixelEstimate]) -> Vec<u32>;
}

/// The pixels that are marked, ascending.
fn marked_pixels(is_marked: &[bool]) -> Vec<u32> {
    (0u32..).zip(is_marked).filter_map(|(pixel, &is_marked)| is_marked.then_some(pixel)).collect()
}
