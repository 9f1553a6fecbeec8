//! Immutable data that all stages of a run share: options, images of all scales, source lists, order of the
//! cycles.

use super::cycle::{Cycle, CycleRecord, Place};
use super::sources::PublishedSurfaces;
use crate::error::{Error, Result};
use crate::image::PackedImage;
use crate::matching::{Problem, Source, Window};
use crate::options::{Options, Scale};
use crate::parallel::{Advance, Phase, Progress};
use crate::refine::FilteredView;
use crate::scene::{ImageCache, ScaledView, Scene};
use crate::simd::SimdLevel;
use crate::view_selection::{SourceLists, source_lists};
use rayon::prelude::*;
use std::sync::Arc;

/// What all stages of a run share.
pub(super) struct RunContext {
    pub options: Options,
    pub level: SimdLevel,
    /// By scale.
    windows: Vec<Window>,
    evidence_window: Window,
    sources: SourceLists,
    /// By view, the views that have it among their sources, ascending.
    readers: Vec<Vec<u32>>,
    cycles: Vec<Cycle>,
    /// By scale and view.
    scaled: Vec<Vec<ScaledView>>,
    images: ImageCache,
}

/// The images of a view and of its sources on one scale.
pub(super) struct ViewImages {
    pub own: Arc<PackedImage>,
    sources: Vec<Arc<PackedImage>>,
}

impl RunContext {
    /// Chooses the source views and keeps the images of all scales in memory; calls `advance` with 0 units
    /// before each image.
    ///
    /// # Errors
    /// An option out of its range, named; a photograph that cannot be decoded; what `advance` returns.
    pub(super) fn new(scene: &Scene, options: &Options, advance: Advance) -> Result<RunContext> {
        let context = RunContext::with_image_limit(scene, options, usize::MAX)?;
        context.images.fill(|| advance(0))?;
        Ok(context)
    }

    /// Chooses the source views. Images are decoded when they are needed; those of up to `limit` bytes stay
    /// in memory.
    ///
    /// # Errors
    /// An option out of its range, named.
    pub(super) fn with_image_limit(scene: &Scene, options: &Options, limit: usize) -> Result<RunContext> {
        options.check()?;
        let bounded = options.input.bounds()?.map(|bounds| scene.bounded(bounds));
        let scene = bounded.as_ref().unwrap_or(scene);
        let scales = &options.schedule.scales;
        let views = || (0..scene.views().len()).into_par_iter();
        let scaled =
            |scale: &Scale| views().map(|view| ScaledView::of(scene, view, scale.downscale)).collect();
        let scaled = scales.iter().map(scaled).collect();
        let photographs = scene.views().iter().map(|view| view.picture.clone()).collect();
        let downscales = scales.iter().map(|scale| scale.downscale).collect();
        let sources = source_lists(scene, options);
        let mut readers = vec![Vec::new(); scene.views().len()];
        for (view, list) in (0u32..).zip(&sources.lists) {
            list.iter().for_each(|&source| readers[source as usize].push(view));
        }
        Ok(RunContext {
            options: options.clone(),
            level: options.simd.unwrap_or_else(SimdLevel::detect),
            windows: (0..scales.len()).map(|scale| window(options, scale)).collect(),
            evidence_window: evidence_window(options),
            sources,
            readers,
            cycles: Cycle::all(options),
            scaled,
            images: ImageCache::new(photographs, downscales, limit),
        })
    }

    /// The same with another limit of the images in memory, none of which is kept.
    #[cfg(feature = "io")]
    pub(super) fn limited_to(mut self, limit: usize) -> RunContext {
        self.images = self.images.limited_to(limit);
        self
    }

    /// The cycles in order.
    pub(super) fn cycles(&self) -> &[Cycle] {
        &self.cycles
    }

    /// Number of views.
    pub(super) fn views(&self) -> usize {
        self.sources.lists.len()
    }

    /// The source views of a view, which its view sets index.
    pub(super) fn sources(&self, view: usize) -> &[u32] {
        &self.sources.lists[view]
    }

    /// The views that have a view among their sources, ascending.
    pub(super) fn readers(&self, view: usize) -> &[u32] {
        &self.readers[view]
    }

    /// Warnings about the selection of source views, as sentences.
    pub(super) fn warnings(&self) -> &[String] {
        &self.sources.warnings
    }

    /// The window of the patches on the scale of a cycle.
    pub(super) fn window(&self, cycle: usize) -> &Window {
        &self.windows[self.cycles[cycle].scale_index]
    }

    /// The window in which planes of textureless pixels must match.
    pub(super) fn evidence_window(&self) -> &Window {
        &self.evidence_window
    }

    /// A view on the scale of a cycle.
    pub(super) fn scaled(&self, at: Place) -> &ScaledView {
        &self.scaled[self.cycles[at.cycle].scale_index][at.view]
    }

    /// The image of a view on the scale of a cycle.
    ///
    /// # Errors
    /// A photograph that cannot be decoded.
    pub(super) fn image(&self, at: Place) -> Result<Arc<PackedImage>> {
        self.images.get(self.cycles[at.cycle].scale_index, at.view)
    }

    /// The images of a view and of its sources on the scale of a cycle.
    ///
    /// # Errors
    /// A photograph that cannot be decoded.
    pub(super) fn images(&self, at: Place) -> Result<ViewImages> {
        let of_source = |&source: &u32| self.image(Place { view: source as usize, ..at });
        let sources = self.sources(at.view).iter().map(of_source).collect::<Result<_>>()?;
        Ok(ViewImages { own: self.image(at)?, sources })
    }

    /// The data of a view that the filters of its planes read.
    pub(super) fn filtered_view<'b>(&'b self, at: Place, image: &'b PackedImage) -> FilteredView<'b> {
        let ScaledView { camera, range, .. } = self.scaled(at);
        FilteredView { camera, image, range: *range, level: self.level }
    }

    /// A view and its sources with their published surfaces.
    pub(super) fn problem<'b>(
        &'b self,
        at: Place,
        images: &'b ViewImages,
        surfaces: PublishedSurfaces<'b>,
    ) -> Problem<'b> {
        let ScaledView { camera, range, likely_range, .. } = self.scaled(at);
        let mut problem = Problem::new(camera, &images.own, *range);
        problem.likely_range = (*likely_range).into();
        let sources = self.sources(at.view).iter().zip(&images.sources);
        for ((&source, image), surface) in sources.zip(surfaces.0) {
            let ScaledView { camera: other, .. } = self.scaled(Place { view: source as usize, ..at });
            problem.sources.push(Source::new(camera, other, image, surface));
        }
        problem
    }

    /// The cycle after this one, whose records these are; `None` after the last. From its second cycle on,
    /// a scale ends early once fewer pixels changed than the option `schedule.min_changed_fraction` asks for.
    pub(super) fn next_cycle<'e>(
        &self,
        cycle: usize,
        records: impl Iterator<Item = &'e CycleRecord>,
    ) -> Option<usize> {
        let (mut changed, mut pixels) = (0, 0);
        for record in records {
            changed += record.changed;
            pixels += record.pixels;
        }
        let min_changed = self.options.schedule.min_changed_fraction;
        let ends_scale =
            self.cycles[cycle].cycle > 0 && (changed as f64 / pixels.max(1) as f64) < min_changed;
        let is_next = |&other: &usize| {
            !(ends_scale && self.cycles[other].scale_index == self.cycles[cycle].scale_index)
        };
        (cycle + 1..self.cycles.len()).find(is_next)
    }

    /// Whether the scale may end with a cycle, as far as the record of one view determines it.
    pub(super) fn may_end_scale(&self, cycle: usize, record: Option<&CycleRecord>) -> bool {
        let scale = |cycle: usize| self.cycles.get(cycle).map(|cycle| cycle.scale_index);
        let min_changed = self.options.schedule.min_changed_fraction;
        scale(cycle + 1) != scale(cycle)
            || record.is_some_and(|record| (record.changed as f64) < min_changed * record.pixels as f64)
    }

    /// Units of work of searching all views in the cycles before this one.
    pub(super) fn work_before(&self, cycle: usize) -> u64 {
        let pixels = |scale: usize| self.scaled[scale].iter().map(|view| view.camera.pixels() as u64).sum();
        let works = self.cycles[..cycle].iter().map(|cycle| cycle.work(pixels(cycle.scale_index)));
        works.fold(0, u64::saturating_add)
    }

    /// The progress of the run in a phase of a view.
    pub(super) fn progress(&self, phase: Phase, at: Place) -> Progress {
        let cycle = &self.cycles[at.cycle];
        let (downscale, views) = (cycle.scale.downscale, self.views());
        Progress { phase, downscale, cycle: cycle.cycle, view: at.view, views, done: 0.0 }
    }

    /// Returns an error for a cycle or view that does not exist.
    pub(super) fn check_place(&self, at: Place) -> Result<()> {
        if at.cycle >= self.cycles.len() {
            let expected = format!("a cycle below the number of cycles, {}", self.cycles.len());
            return Err(Error::argument("cycle", at.cycle, expected));
        }
        if at.view >= self.views() {
            let expected = format!("a view below the number of views, {}", self.views());
            return Err(Error::argument("view", at.view, expected));
        }
        Ok(())
    }
}

/// Radius in px of the window in which planes of textureless pixels must match: as small as that of textured
/// pixels, so that it does not reach what is beside a textureless region, but with all samples.
const EVIDENCE_RADIUS: u32 = 4;
/// Variance under which that window has no texture: twice that of rounding to 1 / 255.
const EVIDENCE_MIN_VARIANCE: f64 = 2.0 / 12.0 / (255.0 * 255.0);

fn evidence_window(options: &Options) -> Window {
    let own = &options.window;
    Window::disc(EVIDENCE_RADIUS, 1, own.sigma_spatial, own.sigma_color, EVIDENCE_MIN_VARIANCE)
}

/// The window of a scale. At full size after coarser scales the planes are approximately known, and a smaller
/// window covers fewer surfaces at edges.
fn window(options: &Options, scale: usize) -> Window {
    let own = &options.window;
    let is_full_size_after_coarser = scale > 0 && options.schedule.scales[scale].downscale == 1;
    let (radius, is_circular) = match is_full_size_after_coarser && own.full_size_window_radius > 0 {
        true => (own.full_size_window_radius, false),
        false => (own.window_radius, own.circular_window),
    };
    let make = if is_circular { Window::disc } else { Window::new };
    make(radius, own.window_step, own.sigma_spatial, own.sigma_color, own.min_variance)
}
