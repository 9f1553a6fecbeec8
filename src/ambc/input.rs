//! The input of a search.

use super::colony::Candidate;
use super::rules::SearchRules;
use crate::matching::{Problem, Window};
use crate::parallel::Advance;
use crate::scene::PixelEstimate;
use crate::simd::SimdLevel;

/// The input of a search.
pub(crate) struct Search<'a> {
    /// The view and its sources, with their published surfaces.
    pub problem: &'a Problem<'a>,
    /// Shape and weights of the patches.
    pub window: &'a Window,
    /// The same for previous estimates of pixels without texture in that window: they stay only where more
    /// samples tell them from noise.
    pub evidence_window: &'a Window,
    /// The numbers it depends on.
    pub rules: SearchRules,
    /// The pixels that are searched; `None` for all.
    pub mask: Option<&'a [bool]>,
    /// The previous estimate of each pixel; `None` in the very first cycle.
    pub start: Option<&'a [PixelEstimate]>,
    /// The planes that other views propagate, one for each pixel.
    pub candidates: Option<&'a [Candidate]>,
    /// Names the random numbers of this view and cycle.
    pub random_stream: u64,
    /// Instruction set.
    pub level: SimdLevel,
    /// Told of the food sources of each band of colonies that is filled or searched.
    pub advance: Advance<'a>,
}
