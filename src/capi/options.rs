//! Options in C: by name, so that an option more breaks nobody.

use super::pointers::{self, destroy, get, give_list, out, slice, text};
use super::status::{Failure, guard, skep_status};
use crate::options::{Options, Scale};
use crate::simd::Level;
use std::ffi::c_char;
use std::sync::RwLock;

/// Every number the method depends on. May be used from several threads at once.
pub struct skep_options {
    pub(super) options: RwLock<Options>,
}

/// The search on one scale of the image pyramid.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_scale {
    /// How often the images are halved: 0 is full size.
    pub halvings: u32,
    /// Food sources of each pixel's colony, 2 to 64.
    pub foods: u32,
    /// Iterations of the first cycle on this scale.
    pub first_iterations: u32,
    /// Cycles after the first.
    pub cycles: u32,
    /// Iterations of each of those.
    pub cycle_iterations: u32,
}

/// Makes options from a preset: "default" (or NULL), which measures best, "fast", which takes less than half of
/// its time, or "paper", which follows the paper to the letter.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_create(
    preset_or_null: *const c_char,
    options_out: *mut *mut skep_options,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let out = unsafe { out(options_out, "options_out") }?;
        let preset = match preset_or_null.is_null() {
            true => "default",
            // SAFETY: as the header demands of the caller.
            false => unsafe { text(preset_or_null, "preset") }?,
        };
        out.give(skep_options { options: RwLock::new(Options::preset(preset)?) });
        Ok(())
    })
}

/// Destroys options; NULL is ignored. Runs that were started with them are not touched.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_destroy(options: *mut skep_options) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(options) };
        Ok(())
    });
}

/// Sets an option that is a number. Switches are 0 or 1; whole numbers must be whole. skep_option_name lists the names;
/// `skep info` shows them with the values of the presets.
///
/// SKEP_ERR_ARGUMENT: no option of this name, or a value out of its range; the text says what would be right.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_set(
    options: *mut skep_options,
    name: *const c_char,
    value: f64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (options, name) = unsafe { (get(options, "options")?, text(name, "name")?) };
        Ok(pointers::write(&options.options)?.set(name, value)?)
    })
}

/// Gets an option that is a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_get(
    options: *const skep_options,
    name: *const c_char,
    value_out: *mut f64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (options, name, out) =
            unsafe { (get(options, "options")?, text(name, "name")?, out(value_out, "value_out")?) };
        out.set(pointers::read(&options.options)?.get(name)?);
        Ok(())
    })
}

/// Sets the seed of the random generator. The same seed, input and library version give the same bits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_set_seed(options: *mut skep_options, seed: u64) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let options = unsafe { get(options, "options") }?;
        pointers::write(&options.options)?.seed = seed;
        Ok(())
    })
}

/// Gets the seed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_get_seed(
    options: *const skep_options,
    seed_out: *mut u64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (options, out) = unsafe { (get(options, "options")?, out(seed_out, "seed_out")?) };
        out.set(pointers::read(&options.options)?.seed);
        Ok(())
    })
}

/// Sets the instruction set: "scalar", "base", "v3", or NULL for the best the machine has. A level that the machine does
/// not have is lowered to one it has. The result does not depend on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_set_simd(
    options: *mut skep_options,
    level_or_null: *const c_char,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let options = unsafe { get(options, "options") }?;
        let level = match level_or_null.is_null() {
            true => None,
            false => {
                // SAFETY: as the header demands of the caller.
                let name = unsafe { text(level_or_null, "level") }?;
                let level = Level::ALL.into_iter().find(|level| level.name() == name);
                Some(level.ok_or_else(|| Failure::argument("level", name, "one of scalar, base, v3"))?)
            }
        };
        pointers::write(&options.options)?.simd = level;
        Ok(())
    })
}

/// Sets the scales from coarse to fine: halvings descend one by one to 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_set_scales(
    options: *mut skep_options,
    scales: *const skep_scale,
    count: usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (options, scales) = unsafe { (get(options, "options")?, slice(scales, count, "scales")?) };
        let mut options = pointers::write(&options.options)?;
        let scales = scales.iter().map(|scale| Scale {
            halvings: scale.halvings,
            foods: scale.foods,
            first_iterations: scale.first_iterations,
            cycles: scale.cycles,
            cycle_iterations: scale.cycle_iterations,
        });
        let changed = Options { scales: scales.collect(), ..options.clone() };
        changed.check_scales()?;
        *options = changed;
        Ok(())
    })
}

/// Gets the scales. `scales` may be NULL to only ask for their number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_get_scales(
    options: *const skep_options,
    scales: *mut skep_scale,
    capacity: usize,
    count_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let options = unsafe { get(options, "options") }?;
        let list: Vec<skep_scale> = pointers::read(&options.options)?
            .scales
            .iter()
            .map(|scale| skep_scale {
                halvings: scale.halvings,
                foods: scale.foods,
                first_iterations: scale.first_iterations,
                cycles: scale.cycles,
                cycle_iterations: scale.cycle_iterations,
            })
            .collect();
        // SAFETY: as the header demands of the caller.
        unsafe { give_list(&list, scales, capacity, count_out, ("scales", "count_out")) }
    })
}

/// The name of the option that is a number with this index, counted from 0; static. NULL after the last.
#[unsafe(no_mangle)]
pub extern "C" fn skep_option_name(index: usize) -> *const c_char {
    Options::c_name(index).map_or(std::ptr::null(), |name| name.as_ptr())
}

/// The options of a call: the caller's, or the default preset where there are none.
///
/// # Safety
/// `options` is NULL or points to options.
pub unsafe fn options_or_default(options: *const skep_options) -> Result<Options, Failure> {
    if options.is_null() {
        return Ok(Options::default());
    }
    // SAFETY: as promised by the caller.
    let options = unsafe { get(options, "options") }?;
    Ok(pointers::read(&options.options)?.clone())
}
