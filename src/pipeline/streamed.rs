//! The tasks of one view with the estimates of other views loaded when they are read, for runs that keep them
//! in files.

use super::cycle::Place;
use super::estimate::{Checked, CheckedPlanes, Searched, ViewEstimate};
use super::progress::Tracker;
use super::result::ViewResult;
use super::sources::{PublishedSurfaces, SourcePlanes};
use super::stages::{self, Propagation, SearchInput};
use super::stepper::Stepper;
use super::view_tasks;
use crate::error::Result;
use crate::parallel::{Advance, Phase, ProgressFn};
use crate::scene::CompactPlane;
use std::sync::Arc;

/// The estimates of all views after a check, on the scale of the task that reads them.
pub(crate) trait CheckedEstimates {
    /// The planes of a view.
    ///
    /// # Errors
    /// An estimate that cannot be read.
    fn planes(&self, view: usize) -> Result<Arc<ViewEstimate<CheckedPlanes>>>;

    /// The surface that a view published, one plane for each pixel.
    ///
    /// # Errors
    /// A surface that cannot be read.
    fn surface(&self, view: usize) -> Result<Arc<Vec<CompactPlane>>>;
}

impl Stepper {
    /// The planes that other views propagate to a view, and its search: [`Stepper::propagate`] and
    /// [`Stepper::search`]. `checked` has the estimates of the cycle before; there are none before the first.
    ///
    /// # Errors
    /// A cycle or view that does not exist; an estimate or photograph that cannot be read;
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub(crate) fn search_streamed(
        &self,
        cycle: usize,
        view: usize,
        checked: Option<&dyn CheckedEstimates>,
        progress: ProgressFn,
    ) -> Result<ViewEstimate<Searched>> {
        let (context, at) = (self.context(), Place { cycle, view });
        context.check_place(at)?;
        let pixels = context.scaled(at).camera.pixels() as u64;
        let tracker = Tracker::with_work(progress, self.cycles()[cycle].work(pixels));
        let advance = |units| tracker.advance(units, context.progress(Phase::Search, at));
        advance(0)?;
        let Some(checked) = checked else {
            let input = SearchInput { own: None, candidates: None, is_guided: false };
            let surfaces = PublishedSurfaces::none(self.sources(view));
            return view_tasks::search(context, at, surfaces, input, &advance);
        };
        let own = checked.planes(view)?;
        // One donor at a time is in memory.
        let mut propagation = Propagation::new(context, at, Some(own.as_own()));
        for &donor in propagation.donors() {
            let found = checked.planes(donor as usize)?;
            propagation.add(donor as usize, found.planes(), &advance)?;
        }
        let candidates = propagation.finish();
        let surfaces = surfaces(self.sources(view), checked, &advance)?;
        let input = SearchInput { own: Some(own.as_own()), candidates: Some(&candidates), is_guided: true };
        view_tasks::search(context, at, published(&surfaces), input, &advance)
    }

    /// [`Stepper::check`] with progress. `searched` gives the estimate of a view after the search of the cycle.
    ///
    /// # Errors
    /// The errors of `searched`; a photograph that cannot be read;
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub(crate) fn check_streamed(
        &self,
        cycle: usize,
        view: usize,
        searched: &dyn Fn(usize) -> Result<Arc<ViewEstimate<Searched>>>,
        progress: ProgressFn,
    ) -> Result<ViewEstimate<Checked>> {
        let (context, at) = (self.context(), Place { cycle, view });
        context.check_place(at)?;
        let tracker = Tracker::with_work(progress, 1);
        let advance = |units| tracker.advance(units, context.progress(Phase::Check, at));
        let sources = self.sources(view);
        let load = |&source: &u32| {
            advance(0)?;
            searched(source as usize)
        };
        let loaded: Vec<_> = sources.iter().map(load).collect::<Result<_>>()?;
        let planes = SourcePlanes::of(loaded.iter().map(|found| found.planes()).collect());
        view_tasks::check(context, &*searched(view)?, planes, &advance)
    }

    /// [`Stepper::finish`].
    ///
    /// # Errors
    /// A view that does not exist; an estimate or photograph that cannot be read;
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub(crate) fn finish_streamed(
        &self,
        view: usize,
        checked: &dyn CheckedEstimates,
        progress: ProgressFn,
    ) -> Result<ViewResult> {
        let (context, at) = (self.context(), Place { cycle: self.cycles().len() - 1, view });
        context.check_place(at)?;
        let tracker = Tracker::with_work(progress, 1);
        let advance = |units| tracker.advance(units, context.progress(Phase::Check, at));
        let sources = self.sources(view);
        let surfaces = surfaces(sources, checked, &advance)?;
        let load = |&source: &u32| {
            advance(0)?;
            checked.planes(source as usize)
        };
        let loaded: Vec<_> = sources.iter().map(load).collect::<Result<_>>()?;
        let planes = SourcePlanes::of(loaded.iter().map(|found| found.planes()).collect());
        let own = checked.planes(view)?;
        view_tasks::finish(context, at, published(&surfaces), own.as_own(), planes, &advance)
    }

    /// The published surface of an estimate, apart from it.
    pub(crate) fn surface_of(&self, planes: &ViewEstimate<CheckedPlanes>) -> Vec<CompactPlane> {
        stages::surface(self.context(), planes)
    }

    /// The planes of an estimate on the scale of a cycle, the next finer one: see [`Stepper::upsample`].
    pub(crate) fn upsample_planes(
        &self,
        cycle: usize,
        planes: &ViewEstimate<CheckedPlanes>,
    ) -> ViewEstimate<CheckedPlanes> {
        let at = Place { cycle, view: planes.view() };
        stages::upsampled(self.context(), at, planes)
    }
}

fn surfaces(
    sources: &[u32],
    checked: &dyn CheckedEstimates,
    advance: Advance,
) -> Result<Vec<Arc<Vec<CompactPlane>>>> {
    let load = |&source: &u32| {
        advance(0)?;
        checked.surface(source as usize)
    };
    sources.iter().map(load).collect()
}

fn published(surfaces: &[Arc<Vec<CompactPlane>>]) -> PublishedSurfaces<'_> {
    PublishedSurfaces(surfaces.iter().map(|surface| surface.as_slice()).collect())
}
