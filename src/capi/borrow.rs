//! Maps inside a result, for hosts that would rather look than copy.

use super::pointers::{get, out};
use super::result::skep_result;
use super::status::{guard, skep_status};

/// The raw depth map inside the result, without a copy: height rows of width floats, dense. Valid until the result is
/// destroyed; only to be read.
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

/// The raw normal map inside the result, without a copy: height rows of width times x, y, z, dense. Valid until the
/// result is destroyed; only to be read.
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

/// The costs inside the result, without a copy, as skep_result_get_cost explains them. Valid until the result is
/// destroyed; only to be read.
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

/// The SKEP_PIXEL_ values inside the result, without a copy: height rows of width bytes, dense. Valid until the result
/// is destroyed; only to be read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_result_borrow_status(
    result: *const skep_result,
    view: u32,
    status_out: *mut *const u8,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (result, out) = unsafe { (get(result, "result")?, out(status_out, "status_out")?) };
        // An status is one byte, its discriminant.
        out.set(result.view(view)?.status.as_ptr().cast());
        Ok(())
    })
}
