//! Maps inside a result, without a copy.

use super::pointers::{get, out};
use super::result::skep_result;
use super::status::{guard, skep_status};

/// Borrows the raw depth map of a view.
///
/// @param result     The result.
/// @param view       Number of a view in the result.
/// @param depth_out  Receives the address of width * height floats, row after row; owned by the result.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_borrow_depth(
    result: *const skep_result,
    view: u32,
    depth_out: *mut *const f32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(depth_out, "depth_out")?) };
        out.set(result.view(view)?.raw.depth.as_ptr());
        Ok(())
    })
}

/// Borrows the raw normal map of a view.
///
/// @param result      The result.
/// @param view        Number of a view in the result.
/// @param normal_out  Receives the address of 3 * width * height floats, row after row; owned by the result.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_borrow_normal(
    result: *const skep_result,
    view: u32,
    normal_out: *mut *const f32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(normal_out, "normal_out")?) };
        out.set(result.view(view)?.raw.normal.as_ptr().cast());
        Ok(())
    })
}

/// Borrows the matching costs of a view; see skep_result_get_cost.
///
/// @param result    The result.
/// @param view      Number of a view in the result.
/// @param cost_out  Receives the address of width * height floats, row after row; owned by the result.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_borrow_cost(
    result: *const skep_result,
    view: u32,
    cost_out: *mut *const f32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(cost_out, "cost_out")?) };
        out.set(result.view(view)?.cost.as_ptr());
        Ok(())
    })
}

/// Borrows the confidences of a view; see skep_result_get_confidence.
///
/// @param result          The result.
/// @param view            Number of a view in the result.
/// @param confidence_out  Receives the address of width * height floats, row after row; owned by the result.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_borrow_confidence(
    result: *const skep_result,
    view: u32,
    confidence_out: *mut *const f32,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(confidence_out, "confidence_out")?) };
        out.set(result.view(view)?.confidence.as_ptr());
        Ok(())
    })
}

/// Borrows the status of the pixels of a view, SKEP_PIXEL_ values.
///
/// @param result      The result.
/// @param view        Number of a view in the result.
/// @param status_out  Receives the address of width * height bytes, row after row; owned by the result.
/// @retval SKEP_ERR_ARGUMENT  No such view in the result.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_borrow_status(
    result: *const skep_result,
    view: u32,
    status_out: *mut *const u8,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(status_out, "status_out")?) };
        // A status is one byte, its discriminant.
        out.set(result.view(view)?.status.as_ptr().cast());
        Ok(())
    })
}
