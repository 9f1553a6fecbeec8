//! Fusion of maps in files, of which those of overlapping views are in memory at a time.

use crate::error::Result;
use crate::fusion::{FusionInput, FusionView};
use crate::geometry::Camera;
use crate::image::Picture;
use crate::io::{MapKind, Workspace, read_depth_map};
use crate::memory::Cache;
use crate::scene::{Maps, Scene};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::{Arc, Mutex, PoisonError};

/// The finished views of a run.
pub(super) struct FinishedViews<'a> {
    pub scene: &'a Scene,
    pub workspace: &'a Workspace,
    /// The views that may see the same surface as a view.
    pub overlaps: &'a [Vec<u32>],
    kept: Cache<usize, Finished>,
    /// The views of the last group, which the next one has mostly in common.
    last: Mutex<HashMap<usize, Arc<Finished>>>,
}

/// A view in memory.
struct Finished {
    maps: Maps,
    confidence: Vec<f32>,
    picture: Picture,
}

/// Bytes of a view in memory for each pixel: depth, normal, confidence, gray and color.
pub(super) const BYTES_PER_PIXEL: usize = 24;

impl<'a> FinishedViews<'a> {
    /// Keeps the views used last, of up to `limit` bytes, in memory.
    pub(super) fn new(
        scene: &'a Scene,
        workspace: &'a Workspace,
        overlaps: &'a [Vec<u32>],
        limit: usize,
    ) -> FinishedViews<'a> {
        FinishedViews { scene, workspace, overlaps, kept: Cache::new(limit), last: Mutex::default() }
    }

    fn load(&self, index: usize) -> Result<Arc<Finished>> {
        if let Some(kept) = self.kept.get(index) {
            return Ok(kept);
        }
        let view = &self.scene.views()[index];
        let maps = self.workspace.read_maps(&view.name, MapKind::Validated, &view.camera)?;
        let confidence =
            read_depth_map(&self.workspace.confidence_map(&view.name, MapKind::Validated))?.values;
        let finished = Arc::new(Finished { maps, confidence, picture: view.picture.load()? });
        self.kept.insert(index, finished.clone(), view.camera.pixels() * BYTES_PER_PIXEL);
        Ok(finished)
    }
}

impl FusionInput for FinishedViews<'_> {
    fn len(&self) -> usize {
        self.scene.views().len()
    }

    fn camera(&self, view: usize) -> &Camera {
        &self.scene.views()[view].camera
    }

    fn overlap(&self, view: usize) -> &[u32] {
        &self.overlaps[view]
    }

    fn with_views(&self, views: &[u32], body: &mut dyn FnMut(&[FusionView]) -> Result<()>) -> Result<()> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        // Others are dropped before any is loaded: one group at a time is in memory, besides the cache.
        last.retain(|view, _| views.contains(&(*view as u32)));
        for &view in views {
            let view = view as usize;
            if let Entry::Vacant(place) = last.entry(view) {
                place.insert(self.load(view)?);
            }
        }
        let view = |&view: &u32| {
            let (view, finished) = (view as usize, &last[&(view as usize)]);
            FusionView {
                camera: self.camera(view),
                maps: &finished.maps,
                status: None,
                confidence: Some(&finished.confidence),
                picture: Some(&finished.picture),
                overlap: self.overlap(view),
            }
        };
        let group: Vec<FusionView> = views.iter().map(view).collect();
        body(&group)
    }
}
