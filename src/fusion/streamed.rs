//! Fusion of views that are loaded when they are needed: a view and those that overlap with it are in memory
//! at a time, and as many others as a limit allows.

use super::{Body, Check, FusionInput, FusionView};
use crate::error::Result;
use crate::geometry::Camera;
use crate::image::Picture;
use crate::memory::Cache;
use crate::scene::Maps;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes of a view in memory for each pixel: depth, normal, confidence, gray and color.
const BYTES_PER_PIXEL: u64 = 24;

/// Views that are read at the same time, at most: where there is memory for so many times their bytes. The
/// allocator has a heap for each thread, and keeps part of what is freed in each.
const LOADED_AT_A_TIME: usize = 4;
const HEAP_FACTOR: usize = 8;
/// Bytes for each pixel that decoding takes besides.
const DECODING_BYTES_PER_PIXEL: u64 = 8;

/// A view in memory.
pub(crate) struct LoadedView {
    pub maps: Maps,
    pub confidence: Option<Vec<f32>>,
    pub picture: Option<Picture>,
}

/// Views that are loaded when they are needed.
pub(crate) struct StreamedViews<'a> {
    cameras: Vec<&'a Camera>,
    /// By view, the views that may see the same surface.
    overlaps: &'a [Vec<u32>],
    load: &'a (dyn Fn(usize) -> Result<LoadedView> + Sync),
    kept: Cache<usize, LoadedView>,
    loaded_at_a_time: usize,
    /// The views of the last group, which the next one has mostly in common.
    last: Mutex<HashMap<usize, Arc<LoadedView>>>,
}

impl<'a> StreamedViews<'a> {
    /// Keeps the views used last in memory besides those that are fused, in three quarters of `limit` bytes:
    /// the allocator keeps part of what is freed when they change. What `load` gives must be valid and of the
    /// camera's size.
    pub(crate) fn new(
        cameras: Vec<&'a Camera>,
        overlaps: &'a [Vec<u32>],
        load: &'a (dyn Fn(usize) -> Result<LoadedView> + Sync),
        limit: usize,
    ) -> StreamedViews<'a> {
        let largest =
            cameras.iter().map(|camera| camera.pixels() * BYTES_PER_PIXEL as usize).max().unwrap_or(0);
        let loaded_at_a_time = (limit / (HEAP_FACTOR * largest).max(1)).clamp(1, LOADED_AT_A_TIME);
        let kept = Cache::new(limit / 4 * 3);
        StreamedViews { cameras, overlaps, load, kept, loaded_at_a_time, last: Mutex::default() }
    }

    fn load(&self, index: usize) -> Result<Arc<LoadedView>> {
        if let Some(kept) = self.kept.get(index) {
            return Ok(kept);
        }
        let loaded = Arc::new((self.load)(index)?);
        self.kept.insert(index, loaded.clone(), self.cameras[index].pixels() * BYTES_PER_PIXEL as usize);
        Ok(loaded)
    }
}

impl FusionInput for StreamedViews<'_> {
    fn len(&self) -> usize {
        self.cameras.len()
    }

    fn camera(&self, view: usize) -> &Camera {
        self.cameras[view]
    }

    fn overlap(&self, view: usize) -> &[u32] {
        &self.overlaps[view]
    }

    fn with_views(&self, views: &[u32], check: Check, body: Body) -> Result<()> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        // Others are dropped before any is loaded: one group at a time is in memory, besides the cache.
        last.retain(|view, _| views.contains(&(*view as u32)));
        let missing: Vec<usize> =
            views.iter().map(|&view| view as usize).filter(|view| !last.contains_key(view)).collect();
        for some in missing.chunks(self.loaded_at_a_time) {
            let load = |&view: &usize| {
                check()?;
                Ok((view, self.load(view)?))
            };
            last.extend(some.par_iter().with_max_len(1).map(load).collect::<Result<Vec<_>>>()?);
        }
        let view = |&view: &u32| {
            let (view, loaded) = (view as usize, &last[&(view as usize)]);
            FusionView {
                camera: self.camera(view),
                maps: &loaded.maps,
                status: None,
                confidence: loaded.confidence.as_deref(),
                picture: loaded.picture.as_ref(),
                overlap: self.overlap(view),
            }
        };
        let group: Vec<FusionView> = views.iter().map(view).collect();
        body(&group)
    }
}

/// Bytes that the fusion of streamed views needs: the largest group of a view and those it is compared with,
/// what decoding takes, and one bit for each pixel of all views, which tells whether it is part of a point.
pub(crate) fn streamed_bytes(cameras: &[&Camera], overlaps: &[Vec<u32>]) -> u64 {
    let bytes = |view: usize| cameras[view].pixels() as u64 * BYTES_PER_PIXEL;
    let group =
        |view: usize| bytes(view) + overlaps[view].iter().map(|&other| bytes(other as usize)).sum::<u64>();
    let pixels: u64 = cameras.iter().map(|camera| camera.pixels() as u64).sum();
    let largest = cameras.iter().map(|camera| camera.pixels() as u64).max().unwrap_or(0);
    let decoding = largest * DECODING_BYTES_PER_PIXEL * LOADED_AT_A_TIME as u64;
    (0..cameras.len()).map(group).max().unwrap_or(0) + decoding + pixels / 8
}
