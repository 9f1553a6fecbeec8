//! Copies of the maps of a result in C.

use super::maps::{self, Plain};
use super::pointers::get;
use super::result::{SKEP_MAPS_RAW, SKEP_MAPS_VALIDATED, skep_result};
use super::status::{Failure, guard, skep_status};
use crate::pipeline::ViewResult;
use crate::scene::PixelStatus;

/// Fills the caller's map with `value` of each pixel of a view that `check` accepts.
///
/// # Safety `result` is NULL or points to a result; `data` is NULL or points to rows of the view's size,
/// `stride_bytes` apart.
unsafe fn give_map<T: Plain>(
    result: *const skep_result,
    view: u32,
    data: *mut T,
    stride_bytes: usize,
    check: impl FnOnce(&ViewResult) -> Result<(), Failure>,
    value: impl Fn(&ViewResult, usize) -> T,
) -> skep_status {
    guard(|| {
        // SAFETY: as promised by the caller.
        let view = unsafe { get(result, "result") }?.view(view)?;
        check(view)?;
        // SAFETY: as promised by the caller.
        let out = unsafe { maps::out(data, view.size(), stride_bytes, "out") }?;
        out.set(|pixel| value(view, pixel));
        Ok(())
    })
}

/// Refuses other numbers than the SKEP_MAPS_ values.
fn check_which(which: u32) -> Result<(), Failure> {
    match which {
        SKEP_MAPS_RAW | SKEP_MAPS_VALIDATED => Ok(()),
        _ => Err(Failure::argument("which", which, "SKEP_MAPS_RAW or SKEP_MAPS_VALIDATED")),
    }
}

/// Whether the map of this kind contains the pixel.
fn is_given(view: &ViewResult, pixel: usize, which: u32) -> bool {
    which == SKEP_MAPS_RAW || view.status[pixel] == PixelStatus::Validated
}

/// Copies the depth map of a view.
///
/// @param result        The result.
/// @param view          Number of a view in the result.
/// @param which         SKEP_MAPS_RAW or SKEP_MAPS_VALIDATED.
/// @param out           Receives height rows of width floats: depth in world units, 0 where there is none.
/// @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result, another `which`, or a stride that is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_depth(
    result: *const skep_result,
    view: u32,
    which: u32,
    out: *mut f32,
    stride_bytes: usize,
) -> skep_status {
    let depth = |view: &ViewResult, pixel| match is_given(view, pixel, which) {
        true => view.raw.depth[pixel],
        false => 0.0,
    };
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| check_which(which), depth) }
}

/// Copies the normal map of a view.
///
/// @param result        The result.
/// @param view          Number of a view in the result.
/// @param which         SKEP_MAPS_RAW or SKEP_MAPS_VALIDATED.
/// @param out           Receives height rows of 3 * width floats: x, y, z of each pixel, a unit vector in the
///                      camera frame of the view that faces the camera; zeros where there is none.
/// @param stride_bytes  Bytes from a row of `out` to the next, at least 12 * width.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result, another `which`, or a stride that is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_normal(
    result: *const skep_result,
    view: u32,
    which: u32,
    out: *mut f32,
    stride_bytes: usize,
) -> skep_status {
    let normal = |view: &ViewResult, pixel| match is_given(view, pixel, which) {
        true => view.raw.normal[pixel],
        false => [0.0; 3],
    };
    let out = out.cast::<[f32; 3]>();
    // SAFETY: as the header demands of the caller; rows of triples are rows of floats.
    unsafe { give_map(result, view, out, stride_bytes, |_| check_which(which), normal) }
}

/// Copies the matching cost of the raw planes of a view: the mean of 1 - NCC over the view set of each pixel,
/// 0 to 2; lower is better.
///
/// @param result        The result.
/// @param view          Number of a view in the result.
/// @param out           Receives height rows of width floats.
/// @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_cost(
    result: *const skep_result,
    view: u32,
    out: *mut f32,
    stride_bytes: usize,
) -> skep_status {
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| Ok(()), |view, pixel| view.cost[pixel]) }
}

/// Copies the confidence of the raw depths of a view: the probability of each to be within 1 % of the true
/// one, 0 to 1; 0 where there is none.
///
/// @param result        The result.
/// @param view          Number of a view in the result.
/// @param out           Receives height rows of width floats.
/// @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_confidence(
    result: *const skep_result,
    view: u32,
    out: *mut f32,
    stride_bytes: usize,
) -> skep_status {
    let confidence = |view: &ViewResult, pixel: usize| view.confidence[pixel];
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| Ok(()), confidence) }
}

/// Copies the status of the pixels of a view: a SKEP_PIXEL_ value for each.
///
/// @param result        The result.
/// @param view          Number of a view in the result.
/// @param out           Receives height rows of width bytes.
/// @param stride_bytes  Bytes from a row of `out` to the next, at least width.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_status(
    result: *const skep_result,
    view: u32,
    out: *mut u8,
    stride_bytes: usize,
) -> skep_status {
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| Ok(()), |view, pixel| view.status[pixel] as u8) }
}

/// Copies the number of source views in the view set of every pixel.
///
/// @param result        The result.
/// @param view          Number of a view in the result.
/// @param out           Receives height rows of width uint16_t.
/// @param stride_bytes  Bytes from a row of `out` to the next, at least 2 * width.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_source_count(
    result: *const skep_result,
    view: u32,
    out: *mut u16,
    stride_bytes: usize,
) -> skep_status {
    let count = |view: &ViewResult, pixel| u16::try_from(view.view_sets.count(pixel)).unwrap_or(u16::MAX);
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, |_| Ok(()), count) }
}

/// Copies the view sets of the pixels, 32 source views at a time: bit i of a pixel stands for entry 32 * word
/// + i of skep_result_get_sources.
///
/// @param result        The result.
/// @param view          Number of a view in the result.
/// @param word          Which 32 source views, from 0.
/// @param out           Receives height rows of width uint32_t.
/// @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result, 32 * word beyond its source views, or a stride that
///                            is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_get_source_bits(
    result: *const skep_result,
    view: u32,
    word: u32,
    out: *mut u32,
    stride_bytes: usize,
) -> skep_status {
    let check = |view: &ViewResult| match view.view_sets.words_per_pixel() {
        words if (word as usize) < words => Ok(()),
        words => Err(Failure::argument("word", word, format!("below the number of words, {words}"))),
    };
    let bits = |view: &ViewResult, pixel| view.view_sets.words_of(pixel)[word as usize];
    // SAFETY: as the header demands of the caller.
    unsafe { give_map(result, view, out, stride_bytes, check, bits) }
}
