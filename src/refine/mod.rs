//! Filters of one view's planes, beyond the paper: textureless regions are filled, foreground fattening is corrected,
//! planes are smoothed, small gaps are filled.

pub mod foreground_fattening;
pub mod gap_filling;
pub mod plane_smoothing;
pub mod stencil;
pub mod textureless;

use crate::geometry::{Camera, DepthRange};
use crate::image::PackedImage;
use crate::scene::PixelEstimate;

/// What a filter knows of the view.
#[derive(Clone, Copy)]
pub struct FilteredView<'a> {
    /// Its camera on the scale of the planes.
    pub camera: &'a Camera,
    /// Its gray image.
    pub image: &'a PackedImage,
    /// The depths its planes must keep to.
    pub range: DepthRange,
}

/// Which planes a filter may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// Validated ones.
    Validated,
    /// Those that are not validated but have a depth.
    Unvalidated,
}

/// A filter of the planes of one view, in place.
pub trait Filter: Sync {
    /// The farthest pixel, along either axis, whose plane or gray value the new plane of a pixel depends on; `None` for a
    /// filter that looks at whole regions.
    fn reach(&self) -> Option<usize>;

    /// The planes that it may replace; the others stay as they are, to the bit.
    fn domain(&self) -> Domain;

    /// Replaces planes and returns the pixels that got a new one, ascending. New planes are usable: within the depth range
    /// and facing the camera. The result does not depend on the number of threads.
    fn apply(&self, view: &FilteredView, planes: &mut [PixelEstimate]) -> Vec<u32>;
}
