//! The input of a run: views with image, camera, mask and depth range, and sparse points.

mod bounds;
mod compact_plane;
mod depth_ranges;
mod image_cache;
mod maps;
mod nearest_views;
mod plane_map;
mod scaled_view;
mod tracks;

use crate::error::{Error, Result};
use crate::geometry::{Camera, DepthRange};
use crate::image::{Mask, Photograph};
pub(crate) use bounds::is_inside;
pub(crate) use compact_plane::CompactPlane;
use depth_ranges::{DepthRanges, depth_ranges};
use glam::DVec3;
pub(crate) use image_cache::ImageCache;
pub use maps::{Maps, PixelStatus};
pub(crate) use nearest_views::{MAX_VIEWS_FOR_ALL_PAIRS, nearest_views};
pub(crate) use plane_map::{PixelEstimate, PlaneMap, Verdict, validated_planes};
pub(crate) use scaled_view::ScaledView;
pub(crate) use tracks::Tracks;

/// One calibrated photograph.
#[derive(Debug, Clone)]
pub struct View {
    /// A name for messages and files.
    pub name: String,
    /// The photograph, of the camera's size, in memory or decoded when it is needed.
    pub picture: Photograph,
    /// Its calibration and pose.
    pub camera: Camera,
    /// `true` where a depth is estimated, one value for each pixel, row by row; `None` estimates all. Other
    /// views are matched with masked pixels too.
    pub mask: Option<Mask>,
    /// The depth range of the search; `None` derives it from the sparse points.
    pub depth_range: Option<DepthRange>,
    /// The views to match it with, as indices into the scene's views, the most important first; `None`
    /// selects them by triangulation angle.
    pub sources: Option<Vec<u32>>,
}

/// A point triangulated by structure from motion.
#[derive(Debug, Clone, PartialEq)]
pub struct SparsePoint {
    /// World position.
    pub position: DVec3,
    /// Indices into the scene's views that saw it.
    pub views: Vec<u32>,
}

/// Calibrated photographs and sparse points, checked.
#[derive(Debug, Clone)]
pub struct Scene {
    views: Vec<View>,
    points: Vec<SparsePoint>,
    depth_ranges: Vec<DepthRange>,
    outer_ranges: Vec<DepthRange>,
    warnings: Vec<String>,
}

impl Scene {
    /// Checks every view and point and determines the depth range of each view: its own, else from three
    /// quarters of the 1st to twice the 99th percentile of the depths of the sparse points it saw. A view
    /// that saw none takes those that project into its image, whichever views saw them; where there are none
    /// either, the smallest to the largest depth of the other views' ranges. [`Scene::warnings`] names it.
    ///
    /// # Errors
    /// Fewer than two views; a name that occurs twice; a picture or mask of another size than its camera; an
    /// invalid camera, range or point; a point or source list with an index that is no view; a source list
    /// with the view itself or a view twice; a view without range where there are no sparse points, or
    /// where no view has a range.
    pub fn new(mut views: Vec<View>, mut points: Vec<SparsePoint>) -> Result<Scene> {
        Scene::take(&mut views, &mut points)
    }

    /// [`Scene::new`], which takes the views and points only where they are valid: a caller who changes and
    /// checks them in turns needs no copy.
    ///
    /// # Errors
    /// The errors of [`Scene::new`]; the views and points stay as they are.
    pub(crate) fn take(views: &mut Vec<View>, points: &mut Vec<SparsePoint>) -> Result<Scene> {
        let DepthRanges { ranges: depth_ranges, outer: outer_ranges, warnings } = check(views, points)?;
        let (views, points) = (std::mem::take(views), std::mem::take(points));
        Ok(Scene { views, points, depth_ranges, outer_ranges, warnings })
    }

    /// Returns the views and points, to change them.
    pub fn into_parts(self) -> (Vec<View>, Vec<SparsePoint>) {
        (self.views, self.points)
    }

    /// The views in the order they were passed in.
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// The sparse points.
    pub fn points(&self) -> &[SparsePoint] {
        &self.points
    }

    /// The depth range of one view. Beyond one that is derived a small part of the search goes on, to 0.7
    /// times its near and 4 times its far end: surfaces may have no sparse points.
    pub fn depth_range(&self, view: usize) -> DepthRange {
        self.depth_ranges[view]
    }

    /// The range that depths of one view are limited to.
    pub(crate) fn outer_range(&self, view: usize) -> DepthRange {
        self.outer_ranges[view]
    }

    /// The scene with warnings from before it was a scene, ahead of its own.
    #[cfg(feature = "io")]
    pub(crate) fn with_warnings(mut self, earlier: Vec<String>) -> Scene {
        self.warnings.splice(..0, earlier);
        self
    }

    /// What reading it found out, then a sentence for each view whose depth range is neither its own nor that of sparse points it saw, and so
    /// may miss surfaces; a single sentence for all views where no point names a view.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

/// Checks views and points, and determines the depth ranges.
fn check(views: &[View], points: &[SparsePoint]) -> Result<DepthRanges> {
    if views.len() < 2 {
        return Err(Error::argument("views", views.len(), "at least 2 views"));
    }
    check_names(views)?;
    for (index, view) in views.iter().enumerate() {
        let name = format!("views[{index}] ({})", view.name);
        check_view(view, &name)?;
        check_sources(&name, index, view.sources.as_deref().unwrap_or_default(), views.len())?;
    }
    for (index, point) in points.iter().enumerate() {
        if !point.position.is_finite() {
            return Err(Error::argument(format!("points[{index}]"), point.position, "finite coordinates"));
        }
        if let Some(view) = point.views.iter().find(|&&view| view as usize >= views.len()) {
            let expected = format!("an index below the number of views, {}", views.len());
            return Err(Error::argument(format!("points[{index}].views"), view, expected));
        }
    }
    depth_ranges(views, points)
}

fn check_names(views: &[View]) -> Result<()> {
    let mut seen = std::collections::HashSet::new();
    match views.iter().find(|view| !seen.insert(view.name.as_str())) {
        Some(view) => {
            Err(Error::argument("views", format!("{} twice", view.name), "a different name for each view"))
        }
        None => Ok(()),
    }
}

fn check_view(view: &View, name: &str) -> Result<()> {
    view.camera.check(&format!("{name}.camera"))?;
    let (width, height) = view.picture.size();
    if (width, height) != (view.camera.width, view.camera.height) {
        let expected = format!("the camera's size, {}x{}", view.camera.width, view.camera.height);
        return Err(Error::argument(format!("{name}.picture"), format!("{width}x{height}"), expected));
    }
    if let Some(mask) = &view.mask
        && mask.pixels() != view.camera.pixels()
    {
        let expected = format!("one for each of the {} pixels", view.camera.pixels());
        return Err(Error::argument(format!("{name}.mask"), format!("{} values", mask.pixels()), expected));
    }
    match view.depth_range {
        Some(range) => range.check(&format!("{name}.depth_range")),
        None => Ok(()),
    }
}

fn check_sources(name: &str, view: usize, sources: &[u32], views: usize) -> Result<()> {
    for (place, &source) in sources.iter().enumerate() {
        let known = (source as usize) < views && source as usize != view;
        if !known || sources[..place].contains(&source) {
            let expected = format!("other views below {views}, each once");
            return Err(Error::argument(format!("{name}.sources[{place}]"), source, expected));
        }
    }
    Ok(())
}
