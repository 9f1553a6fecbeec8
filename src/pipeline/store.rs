//! What a run keeps of each view between stages, today in memory.

use super::cycle::CycleRecord;
use super::estimate::{Checked, ViewEstimate};
use super::sources::{PublishedSurfaces, SourcePlanes};
use crate::error::Result;
use crate::scene::{CompactPlane, PixelEstimate};
use rayon::prelude::*;

/// One value for each view.
pub(super) struct Store<T>(Vec<T>);

/// The published surfaces of all views.
pub(super) struct SurfaceStore(Vec<Vec<CompactPlane>>);

/// Threads that one view keeps busy.
const THREADS_PER_VIEW: usize = 4;

impl SurfaceStore {
    /// The surfaces of a view's sources.
    pub(super) fn of_sources(&self, sources: &[u32]) -> PublishedSurfaces<'_> {
        PublishedSurfaces::new(sources, |source| &self.0[source])
    }
}

impl<T: Send> Store<T> {
    /// Runs a stage for all views, a few at a time: the threads share the work of a view, and those without
    /// work in it take that of another one. The limit on concurrent views bounds the memory.
    pub(super) fn map<R: Send>(self, stage: impl Fn(usize, T) -> Result<R> + Sync) -> Result<Store<R>> {
        let at_a_time = 1 + (rayon::current_num_threads() + THREADS_PER_VIEW / 2) / THREADS_PER_VIEW;
        let mut turns: Vec<Vec<(usize, T)>> = (0..at_a_time).map(|_| Vec::new()).collect();
        for (view, input) in self.0.into_iter().enumerate() {
            turns[view % at_a_time].push((view, input));
        }
        let one_by_one = |views: Vec<(usize, T)>| -> Result<Vec<(usize, R)>> {
            views.into_iter().map(|(view, input)| Ok((view, stage(view, input)?))).collect()
        };
        let done: Vec<_> = turns.into_par_iter().with_max_len(1).map(one_by_one).collect::<Result<_>>()?;
        let mut done: Vec<(usize, R)> = done.into_iter().flatten().collect();
        done.sort_unstable_by_key(|(view, _)| *view);
        Ok(Store(done.into_iter().map(|(_, result)| result).collect()))
    }

    /// Like `map`, but keeps the values of all views.
    pub(super) fn map_ref<R: Send>(&self, stage: impl Fn(usize, &T) -> Result<R> + Sync) -> Result<Store<R>>
    where
        T: Sync,
    {
        Store((0..self.0.len()).collect()).map(|_, view: usize| stage(view, &self.0[view]))
    }

    /// Both values of each view.
    pub(super) fn zip<U: Send>(self, other: Store<U>) -> Store<(T, U)> {
        Store(self.0.into_iter().zip(other.0).collect())
    }

    /// By view.
    pub(super) fn into_vec(self) -> Vec<T> {
        self.0
    }
}

impl Store<Option<ViewEstimate<Checked>>> {
    /// No estimates, as before the first cycle.
    pub(super) fn unknown(views: usize) -> Self {
        Store((0..views).map(|_| None).collect())
    }

    /// The record of the last cycle of every view.
    pub(super) fn last_records(&self) -> impl Iterator<Item = &CycleRecord> {
        self.0.iter().flatten().filter_map(|own| own.cycles().last())
    }

    /// The estimates of all views, which exist after the first cycle.
    pub(super) fn all_known(self) -> Store<ViewEstimate<Checked>> {
        Store(self.0.into_iter().flatten().collect())
    }

    /// The checked planes of a view.
    pub(super) fn planes(&self, view: usize) -> Option<&[PixelEstimate]> {
        self.0[view].as_ref().map(ViewEstimate::planes)
    }

    /// Takes the published surfaces out of the estimates.
    pub(super) fn take_surfaces(mut self) -> (Self, SurfaceStore) {
        let take = |own: &mut Option<ViewEstimate<Checked>>| own.as_mut().map(ViewEstimate::take_surface);
        let surfaces = self.0.iter_mut().map(|own| take(own).unwrap_or_default()).collect();
        (self, SurfaceStore(surfaces))
    }
}

impl<S> Store<ViewEstimate<S>> {
    /// The planes of a view's sources.
    pub(super) fn planes_of_sources(&self, sources: &[u32]) -> SourcePlanes<'_, S> {
        SourcePlanes::new(sources, |source| Some(self.0[source].planes()))
    }
}

impl Store<ViewEstimate<Checked>> {
    /// The published surfaces of a view's sources.
    pub(super) fn surfaces_of_sources(&self, sources: &[u32]) -> PublishedSurfaces<'_> {
        PublishedSurfaces::new(sources, |source| self.0[source].surface())
    }

    /// Takes the published surfaces out of the estimates.
    pub(super) fn take_surfaces(mut self) -> (Self, SurfaceStore) {
        let surfaces = self.0.iter_mut().map(ViewEstimate::take_surface).collect();
        (self, SurfaceStore(surfaces))
    }
}
