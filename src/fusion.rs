//! Fusion of depth and normal maps into points (section 6 of the paper).

use crate::camera::Camera;
use crate::error::Result;
use crate::image::Picture;
use crate::maps::{Maps, PointCloud};
use crate::options::FusionOptions;
use crate::progress::Hook;

/// A view with its maps, as fusion needs it.
#[derive(Debug, Clone, Copy)]
pub struct FusionView<'a> {
    /// The camera of the maps.
    pub camera: &'a Camera,
    /// Depth and normal, 0 where there is none.
    pub maps: &'a Maps,
    /// For the colours; grey (128) without.
    pub picture: Option<&'a Picture>,
    /// The views that may see the same surface, as indices into the list of views.
    pub overlap: &'a [u32],
}

/// Fuses the maps of all views.
pub fn fuse(_views: &[FusionView], _options: &FusionOptions, _hook: Hook) -> Result<PointCloud> {
    Ok(PointCloud::default())
}
