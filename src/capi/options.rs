//! Options in C: by name, so that an option more breaks nobody.

use super::pointers::{self, destroy, get, out, text};
use super::scene::give_text;
use super::status::{Failure, guard, skep_status};
use crate::options::{OptionValue, Options};
use std::ffi::c_char;
use std::sync::RwLock;

/// Every number the method depends on. May be used from several threads at once.
pub struct skep_options {
    pub(super) options: RwLock<Options>,
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

/// Sets an option that is a number. Switches are 0 or 1; whole numbers must be whole. The list of options above explains
/// each; where a name is the only one without its group, it may be left out.
///
/// SKEP_ERR_ARGUMENT: no option of this name, or one that is a text, or a value out of its range.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_set(
    options: *mut skep_options,
    name: *const c_char,
    value: f64,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (options, name) = unsafe { (get(options, "options")?, text(name, "name")?) };
        Ok(pointers::write(&options.options)?.set_number(name, value)?)
    })
}

/// Gets an option that is a number; switches are 0 or 1.
///
/// SKEP_ERR_ARGUMENT: no option of this name, or one that is a text.
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
        let value = pointers::read(&options.options)?.get(name)?;
        out.set(match value {
            OptionValue::Count(value) => value as f64,
            OptionValue::Number(value) => value,
            OptionValue::Switch(value) => f64::from(u8::from(value)),
            OptionValue::Text(value) => {
                let expected = "an option that is a number; skep_options_get_text gets this one";
                return Err(Failure::argument(&format!("option {name}"), format!("`{value}`"), expected));
            }
        });
        Ok(())
    })
}

/// Sets any option from its text: a number, "true" or "false", a name, or a schedule such as
/// "downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1".
///
/// SKEP_ERR_ARGUMENT: no option of this name, or a text or value that it does not take.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_set_text(
    options: *mut skep_options,
    name: *const c_char,
    value: *const c_char,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (options, name, value) =
            unsafe { (get(options, "options")?, text(name, "name")?, text(value, "value")?) };
        Ok(pointers::write(&options.options)?.set(name, value)?)
    })
}

/// Copies the text of any option, which skep_options_set_text takes; see skep_scene_get_name for the buffer.
///
/// SKEP_ERR_ARGUMENT: no option of this name.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_get_text(
    options: *const skep_options,
    name: *const c_char,
    buffer: *mut c_char,
    capacity: usize,
    needed_out: *mut usize,
) -> skep_status {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        let (options, name) = unsafe { (get(options, "options")?, text(name, "name")?) };
        let value = pointers::read(&options.options)?.get(name)?.to_string();
        // SAFETY: as the header demands of the caller.
        unsafe { give_text(&value, buffer, capacity, needed_out) }
    })
}

/// The name of the option with this index, counted from 0; static. NULL after the last.
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
