//! Estimates of single views in C.

use super::maps::{self, Plain};
use super::pointers::{destroy, get, give_list, out, slice, wanted};
use super::status::{Failure, guard, skep_status};
use super::stepper::skep_stepper;
use crate::pipeline::{AnyEstimate, OwnMaps, ViewEstimate};
use crate::scene::Maps;

/// Planes and costs of the pixels of one view after a search, or after the check that follows; before the
/// check also the view sets that it uses. Immutable.
pub struct skep_estimate {
    estimate: AnyEstimate,
}

/// Identity and numbers of an estimate.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_estimate_info {
    /// Number of the view.
    pub view: u32,
    /// Number of the cycle it was searched in, or to whose scale it was upsampled.
    pub cycle: u32,
    /// 1 for a checked estimate, 0 for a searched one.
    pub is_checked: u32,
    /// Always 0.
    pub reserved: u32,
    /// Number of pixels.
    pub pixels: u64,
    /// Pixels whose depth the last search changed by more than 0.1 %.
    pub changed: u64,
    /// Pixels that the last check validated.
    pub validated: u64,
    /// NCC evaluations of the view so far.
    pub ncc_evaluations: u64,
}

impl skep_estimate {
    pub fn new(estimate: AnyEstimate) -> skep_estimate {
        skep_estimate { estimate }
    }

    pub fn inner(&self) -> &AnyEstimate {
        &self.estimate
    }
}

/// Makes a checked estimate from the caller's own maps, of the size that skep_stepper_get_size returns.
///
/// @param stepper                 The stepper.
/// @param cycle                   Number of the cycle that the estimate is of.
/// @param view                    Number of the view.
/// @param depth                   height rows of width floats: depth in world units, 0 for none; copied.
/// @param depth_stride_bytes      Bytes from a row of `depth` to the next, at least 4 * width.
/// @param normal                  height rows of 3 * width floats: x, y, z in the camera frame, a unit vector
///                                that faces the camera where there is a depth; copied.
/// @param normal_stride_bytes     Bytes from a row of `normal` to the next, at least 12 * width.
/// @param validated_or_null       height rows of width bytes, not 0 where the plane is validated, copied;
///                                NULL: wherever there is a depth.
/// @param validated_stride_bytes  Bytes from a row to the next, at least width; ignored with NULL.
/// @param cost_or_null            height rows of width floats, at least 0, rounded to 1/256, copied: ranks
///                                the planes in the propagation to other views; NULL: 0.
/// @param cost_stride_bytes       Bytes from a row to the next, at least 4 * width; ignored with NULL.
/// @param estimate_out            Receives the estimate; destroy it with skep_estimate_destroy.
/// @retval SKEP_ERR_ARGUMENT  No such cycle or view; a stride that is too small; a depth, normal or cost that
///                            cannot be used, with its column and row.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_estimate_from_maps(
    stepper: *const skep_stepper,
    cycle: u32,
    view: u32,
    depth: *const f32,
    depth_stride_bytes: usize,
    normal: *const f32,
    normal_stride_bytes: usize,
    validated_or_null: *const u8,
    validated_stride_bytes: usize,
    cost_or_null: *const f32,
    cost_stride_bytes: usize,
    estimate_out: *mut *mut skep_estimate,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, out) = unsafe { (get(stepper, "stepper")?, out(estimate_out, "estimate_out")?) };
        let size = stepper.inner().size(cycle as usize, view as usize)?;
        // SAFETY: as the header demands of the caller.
        let (maps, validated, cost) = unsafe {
            let normal = normal.cast::<[f32; 3]>();
            maps::check(normal, size, normal_stride_bytes, "normal")?;
            let maps = Maps {
                depth: maps::read(depth, size, depth_stride_bytes, "depth")?,
                normal: maps::read(normal, size, normal_stride_bytes, "normal")?,
            };
            let validated = optional(validated_or_null, size, validated_stride_bytes, "validated")?;
            (maps, validated, optional(cost_or_null, size, cost_stride_bytes, "cost")?)
        };
        let validated: Option<Vec<bool>> = validated.map(|map| map.iter().map(|&byte| byte != 0).collect());
        let own = OwnMaps { maps: &maps, validated: validated.as_deref(), cost: cost.as_deref() };
        let make = || ViewEstimate::from_maps(stepper.inner(), cycle as usize, view as usize, &own);
        out.give(skep_estimate::new(AnyEstimate::Checked(stepper.install(make)?)));
        Ok(())
    })
}

/// # Safety
/// Like [`maps::read`].
unsafe fn optional<T: Plain>(
    data: *const T,
    size: (u32, u32),
    stride_bytes: usize,
    name: &str,
) -> Result<Option<Vec<T>>, Failure> {
    // SAFETY: as promised by the caller.
    (!data.is_null()).then(|| unsafe { maps::read(data, size, stride_bytes, name) }).transpose()
}

/// Destroys an estimate.
///
/// @param estimate  The estimate; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_estimate_destroy(estimate: *mut skep_estimate) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(estimate) };
        Ok(())
    });
}

/// Gets the identity and the numbers of an estimate.
///
/// @param estimate  The estimate.
/// @param info_out  Receives them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_estimate_get_info(
    estimate: *const skep_estimate,
    info_out: *mut skep_estimate_info,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (estimate, out) = unsafe { (&get(estimate, "estimate")?.estimate, out(info_out, "info_out")?) };
        out.set(skep_estimate_info {
            view: estimate.view() as u32,
            cycle: estimate.cycle() as u32,
            is_checked: u32::from(estimate.checked().is_some()),
            reserved: 0,
            pixels: estimate.pixels() as u64,
            changed: estimate.cycles().last().map_or(0, |cycle| cycle.changed),
            validated: estimate.validated().iter().filter(|validated| **validated).count() as u64,
            ncc_evaluations: estimate.counts().ncc_evaluations,
        });
        Ok(())
    })
}

/// Copies the maps of an estimate, row after row without gaps.
///
/// @param estimate   The estimate.
/// @param depth      Receives pixels floats: depth in world units, 0 where there is none; may be NULL.
/// @param normal     Receives 3 * pixels floats: x, y, z in the camera frame; may be NULL.
/// @param cost       Receives pixels floats: aggregated cost of the search, rounded to 1/256; may be NULL.
/// @param validated  Receives pixels bytes: 1 where the check validated the plane, else 0; may be NULL.
/// @param capacity   Pixels of room in each buffer; skep_estimate_get_info returns how many are needed.
/// @retval SKEP_ERR_CAPACITY  `capacity` is below the number of pixels.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_estimate_get_maps(
    estimate: *const skep_estimate,
    depth: *mut f32,
    normal: *mut f32,
    cost: *mut f32,
    validated: *mut u8,
    capacity: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let estimate = &unsafe { get(estimate, "estimate") }?.estimate;
        let needed = estimate.pixels();
        // SAFETY: as the header demands of the caller.
        unsafe {
            let depth = wanted(depth, capacity, needed, "depth")?;
            let normal = wanted(normal.cast::<[f32; 3]>(), capacity, needed, "normal")?;
            let cost = wanted(cost, capacity, needed, "cost")?;
            let validated = wanted(validated, capacity, needed, "validated")?;
            let (maps, costs) = (estimate.maps(), estimate.cost());
            let flags: Vec<u8> = estimate.validated().into_iter().map(u8::from).collect();
            depth.into_iter().for_each(|out| out.set(&maps.depth));
            normal.into_iter().for_each(|out| out.set(&maps.normal));
            cost.into_iter().for_each(|out| out.set(&costs));
            validated.into_iter().for_each(|out| out.set(&flags));
        }
        Ok(())
    })
}

/// Saves an estimate as bytes, to keep it or to send it to another machine.
///
/// @param estimate  The estimate.
/// @param buffer    Receives `*size_out` bytes; may be NULL to ask for their number.
/// @param capacity  Bytes of room in `buffer`.
/// @param size_out  Receives the number of bytes.
/// @retval SKEP_ERR_CAPACITY  `capacity` is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_estimate_save(
    estimate: *const skep_estimate,
    buffer: *mut u8,
    capacity: usize,
    size_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let estimate = &unsafe { get(estimate, "estimate") }?.estimate;
        if buffer.is_null() {
            // SAFETY: as the header demands of the caller.
            unsafe { out(size_out, "size_out") }?.set(estimate.byte_len());
            return Ok(());
        }
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(&estimate.to_bytes(), buffer, capacity, size_out, ("buffer", "size_out")) }
    })
}

/// Loads an estimate that the same version of the library saved.
///
/// @param stepper       A stepper of the same scene and options as the one it was made with.
/// @param bytes         `size` bytes of skep_estimate_save; read during the call only.
/// @param size          Number of bytes.
/// @param estimate_out  Receives the estimate; destroy it with skep_estimate_destroy.
/// @retval SKEP_ERR_ARGUMENT  Bytes that are not an estimate, are truncated or too many, or do not fit the
///                            stepper.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_estimate_load(
    stepper: *const skep_stepper,
    bytes: *const u8,
    size: usize,
    estimate_out: *mut *mut skep_estimate,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (stepper, bytes, out) = unsafe {
            (get(stepper, "stepper")?, slice(bytes, size, "bytes")?, out(estimate_out, "estimate_out")?)
        };
        let load = || AnyEstimate::from_bytes(stepper.inner(), bytes);
        out.give(skep_estimate::new(stepper.install(load)?));
        Ok(())
    })
}
