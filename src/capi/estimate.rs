//! What is known of one view between two stepper, in C.

use super::maps::{self, Plain};
use super::pointers::{destroy, get, give_list, out, slice, wanted};
use super::status::{Failure, guard, skep_status};
use super::stepper::skep_stepper;
use crate::pipeline::{AnyEstimate, OwnMaps, ViewEstimate};
use crate::scene::Maps;

/// What is known of one view after it was searched in a step or, once checked, after the check. Never changes: may be
/// used from several threads at once.
pub struct skep_estimate {
    estimate: AnyEstimate,
}

/// What a estimate is.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_estimate_info {
    /// The view it is of.
    pub view: u32,
    /// The step it was searched in, or whose scale it was handed up to.
    pub cycle: u32,
    /// 1 when it carries the verdicts of a check, else 0.
    pub is_checked: u32,
    /// Always 0.
    pub reserved: u32,
    /// Number of pixels.
    pub pixels: u64,
    /// Pixels whose solution the last search changed.
    pub changed: u64,
    /// Pixels the last check validated.
    pub validated: u64,
    /// NCC evaluations spent on the view so far.
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

/// Makes a estimate from the caller's own maps, as if it had been checked in `step`. The maps have the size that
/// skep_stepper_get_size tells for that step: `depth` in world units, 0 for none; `normal` unit x, y, z in the camera
/// frame, facing the camera, where there is a depth. `validated_or_null`: one byte a pixel, not 0 where the solution
/// counts as validated; NULL validates all that have a depth. `cost_or_null`: at least 0, kept to a 256th, ranks what is
/// offered to other views; NULL is 0. Strides in bytes; those of NULL maps are ignored.
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

/// Destroys a estimate; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_estimate_destroy(estimate: *mut skep_estimate) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(estimate) };
        Ok(())
    });
}

/// What a estimate is.
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

/// Copies a estimate's maps, row after row without gaps, `capacity` pixels of room in each: `depth` (1 float a pixel, 0
/// where there is none), `normal` (3 floats), `cost` (1 float, the aggregated cost of the search, to a
/// 256th), `validated` (1 byte, 1 where the check validated the solution). Any of them may be NULL.
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
        let (maps, costs) = (estimate.maps(), estimate.cost());
        let flags: Vec<u8> = estimate.validated().into_iter().map(u8::from).collect();
        let needed = estimate.pixels();
        // SAFETY: as the header demands of the caller.
        unsafe {
            let depth = wanted(depth, capacity, needed, "depth")?;
            let normal = wanted(normal.cast::<[f32; 3]>(), capacity, needed, "normal")?;
            let cost = wanted(cost, capacity, needed, "cost")?;
            let validated = wanted(validated, capacity, needed, "validated")?;
            depth.into_iter().for_each(|out| out.set(&maps.depth));
            normal.into_iter().for_each(|out| out.set(&maps.normal));
            cost.into_iter().for_each(|out| out.set(&costs));
            validated.into_iter().for_each(|out| out.set(&flags));
        }
        Ok(())
    })
}

/// Saves a estimate as bytes, to keep it or to send it to another machine. `size_out` receives how many there are; with
/// `buffer` NULL nothing else happens.
///
/// SKEP_ERR_CAPACITY: they do not fit into `capacity`.
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

/// Loads a estimate that was saved by the same version of the library, for stepper of the same scene and options.
///
/// SKEP_ERR_ARGUMENT: bytes that are no estimate, are cut or too many, or do not fit the stepper.
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
