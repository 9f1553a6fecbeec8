//! What is known of one view between two steps, in C.

use super::maps::{self, Plain};
use super::pointers::{destroy, get, give_list, out, slice, wanted};
use super::status::{Failure, guard, skep_status};
use super::steps::skep_steps;
use crate::maps::Maps;
use crate::solve::{OwnMaps, State};

/// What is known of one view after it was searched in a step or, once checked, after the check. Never changes: may be
/// used from several threads at once.
pub struct skep_state {
    state: State,
}

/// What a state is.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_state_info {
    /// The view it is of.
    pub view: u32,
    /// The step it was searched in, or whose scale it was handed up to.
    pub step: u32,
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

impl skep_state {
    pub fn new(state: State) -> skep_state {
        skep_state { state }
    }

    pub fn inner(&self) -> &State {
        &self.state
    }
}

/// Makes a state from the caller's own maps, as if it had been checked in `step`. The maps have the size that
/// skep_steps_get_size tells for that step: `depth` in world units, 0 for none; `normal` unit x, y, z in the camera
/// frame, facing the camera, where there is a depth. `validated_or_null`: one byte a pixel, not 0 where the solution
/// counts as validated; NULL validates all that have a depth. `cost_or_null`: at least 0, kept to a 256th, ranks what is
/// offered to other views; NULL is 0. Strides in bytes; those of NULL maps are ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_state_from_maps(
    steps: *const skep_steps,
    step: u32,
    view: u32,
    depth: *const f32,
    depth_stride_bytes: usize,
    normal: *const f32,
    normal_stride_bytes: usize,
    validated_or_null: *const u8,
    validated_stride_bytes: usize,
    cost_or_null: *const f32,
    cost_stride_bytes: usize,
    state_out: *mut *mut skep_state,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, out) = unsafe { (get(steps, "steps")?, out(state_out, "state_out")?) };
        let size = steps.inner().size(step as usize, view as usize)?;
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
        let make = || State::from_maps(steps.inner(), step as usize, view as usize, &own);
        out.give(skep_state { state: steps.install(make)? });
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

/// Destroys a state; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_state_destroy(state: *mut skep_state) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(state) };
        Ok(())
    });
}

/// What a state is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_state_get_info(
    state: *const skep_state,
    info_out: *mut skep_state_info,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (state, out) = unsafe { (&get(state, "state")?.state, out(info_out, "info_out")?) };
        out.set(skep_state_info {
            view: state.view() as u32,
            step: state.step() as u32,
            is_checked: u32::from(state.is_marked()),
            reserved: 0,
            pixels: state.pixels() as u64,
            changed: state.cycles().last().map_or(0, |cycle| cycle.changed),
            validated: state.verdicts().filter(|verdict| verdict.1).count() as u64,
            ncc_evaluations: state.counts().ncc_evaluations,
        });
        Ok(())
    })
}

/// Copies a state's maps, row after row without gaps, `capacity` pixels of room in each: `depth` (1 float a pixel, 0
/// where there is none), `normal` (3 floats), `cost` (1 float, the aggregated cost of the search, to a
/// 256th), `validated` (1 byte, 1 where the check validated the solution). Any of them may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_state_get_maps(
    state: *const skep_state,
    depth: *mut f32,
    normal: *mut f32,
    cost: *mut f32,
    validated: *mut u8,
    capacity: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let state = &unsafe { get(state, "state") }?.state;
        let (maps, costs) = (state.maps(), state.cost().collect::<Vec<f32>>());
        let verdicts: Vec<u8> = state.verdicts().map(|verdict| u8::from(verdict.1)).collect();
        let needed = state.pixels();
        // SAFETY: as the header demands of the caller.
        unsafe {
            let depth = wanted(depth, capacity, needed, "depth")?;
            let normal = wanted(normal.cast::<[f32; 3]>(), capacity, needed, "normal")?;
            let cost = wanted(cost, capacity, needed, "cost")?;
            let validated = wanted(validated, capacity, needed, "validated")?;
            depth.into_iter().for_each(|out| out.set(&maps.depth));
            normal.into_iter().for_each(|out| out.set(&maps.normal));
            cost.into_iter().for_each(|out| out.set(&costs));
            validated.into_iter().for_each(|out| out.set(&verdicts));
        }
        Ok(())
    })
}

/// Saves a state as bytes, to keep it or to send it to another machine. `size_out` receives how many there are; with
/// `buffer` NULL nothing else happens.
///
/// SKEP_ERR_CAPACITY: they do not fit into `capacity`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_state_save(
    state: *const skep_state,
    buffer: *mut u8,
    capacity: usize,
    size_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let state = &unsafe { get(state, "state") }?.state;
        if buffer.is_null() {
            // SAFETY: as the header demands of the caller.
            unsafe { out(size_out, "size_out") }?.set(state.byte_len());
            return Ok(());
        }
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(&state.to_bytes(), buffer, capacity, size_out, ("buffer", "size_out")) }
    })
}

/// Loads a state that was saved by the same version of the library, for steps of the same scene and options.
///
/// SKEP_ERR_ARGUMENT: bytes that are no state, are cut or too many, or do not fit the steps.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_state_load(
    steps: *const skep_steps,
    bytes: *const u8,
    size: usize,
    state_out: *mut *mut skep_state,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (steps, bytes, out) =
            unsafe { (get(steps, "steps")?, slice(bytes, size, "bytes")?, out(state_out, "state_out")?) };
        out.give(skep_state { state: steps.install(|| State::from_bytes(steps.inner(), bytes))? });
        Ok(())
    })
}
