//! The stages of a run, one function each: what it reads are its arguments, what it changes is what it
//! returns or takes by `&mut`. The order is in [`pipeline`](super).

mod check;
mod end;
mod search;

pub(super) use check::{apply_check, check, correct_fattening, publish, smooth_planes};
pub(super) use end::{average_across_views, classify, fill_gaps, fuse, recheck, remove_speckles};
pub use search::Candidates;
pub(super) use search::{
    Propagation, SearchInput, fill_textureless, record_search, search, surface, upsample, upsampled,
};

use crate::scene::PixelEstimate;
use glam::Vec3;

/// Pixels with depth and normal.
pub(super) fn pixels_with_planes(pixels: &[u32], planes: &[PixelEstimate]) -> Vec<(usize, f32, Vec3)> {
    let with_plane = |&pixel: &u32| {
        let PixelEstimate { depth, normal, .. } = planes[pixel as usize];
        (pixel as usize, depth, normal)
    };
    pixels.iter().map(with_plane).collect()
}
