//! What a stage reads of a view's sources, in types that name the stage it comes from.

use crate::scene::{CompactPlane, PixelEstimate};
use std::marker::PhantomData;

/// The surfaces that the sources of a view published after a check, in the order of its source list; empty
/// where nothing is known.
pub(super) struct PublishedSurfaces<'a>(pub Vec<&'a [CompactPlane]>);

/// The planes of the sources of a view after the stage `S`, in the order of its source list; empty where
/// nothing is known.
pub(super) struct SourcePlanes<'a, S> {
    planes: Vec<&'a [PixelEstimate]>,
    stage: PhantomData<S>,
}

impl<'a, S> SourcePlanes<'a, S> {
    /// The planes of these sources.
    pub(super) fn new(
        sources: &[u32],
        planes: impl Fn(usize) -> Option<&'a [PixelEstimate]>,
    ) -> SourcePlanes<'a, S> {
        let of_source = |&source: &u32| planes(source as usize).unwrap_or_default();
        SourcePlanes { planes: sources.iter().map(of_source).collect(), stage: PhantomData }
    }

    /// These planes, by source.
    #[cfg(feature = "io")]
    pub(super) fn of(planes: Vec<&'a [PixelEstimate]>) -> SourcePlanes<'a, S> {
        SourcePlanes { planes, stage: PhantomData }
    }

    /// By source.
    pub(super) fn into_vec(self) -> Vec<&'a [PixelEstimate]> {
        self.planes
    }
}

impl<'a> PublishedSurfaces<'a> {
    /// The surfaces of these sources.
    pub(super) fn new(
        sources: &[u32],
        surface: impl Fn(usize) -> &'a [CompactPlane],
    ) -> PublishedSurfaces<'a> {
        PublishedSurfaces(sources.iter().map(|&source| surface(source as usize)).collect())
    }
}

impl PublishedSurfaces<'_> {
    /// None of these sources has one.
    pub(super) fn none(sources: &[u32]) -> Self {
        PublishedSurfaces(vec![&[]; sources.len()])
    }
}
