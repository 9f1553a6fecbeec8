//! Options in C: by name, so that a new option is compatible.

use super::pointers::{self, destroy, get, give_text, out, text};
use super::status::{Failure, guard, skep_status};
use crate::options::{OptionValue, Options};
use std::ffi::c_char;
use std::sync::RwLock;

/// Every number the method depends on, by name.
pub struct skep_options {
    pub(super) options: RwLock<Options>,
}

/// Creates options from a preset.
///
/// @param preset_or_null  "default" (also NULL): most accurate; "fast": less than half of its time; "paper":
///                        follows the paper literally.
/// @param options_out     Receives the options; destroy them with skep_options_destroy.
/// @retval SKEP_ERR_ARGUMENT  No preset of this name.
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

/// Destroys options. Runs and steppers that were created with them are not affected.
///
/// @param options  The options; NULL is ignored.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_options_destroy(options: *mut skep_options) {
    guard(|| {
        // SAFETY: as the header demands of the caller.
        unsafe { destroy(options) };
        Ok(())
    });
}

/// Sets an option that is a number, a whole number or a switch.
///
/// @param options  The options.
/// @param name     Name of the option; the group may be left out where no other group has an option of this
///                 name.
/// @param value    The value in the unit of the option; 0 or 1 for a switch. Whole numbers are exact up to
///                 2^53.
/// @retval SKEP_ERR_ARGUMENT  No option of this name, several, one that is a text, or a value out of its
///                            range.
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

/// Gets an option that is a number, a whole number or a switch.
///
/// @param options    The options.
/// @param name       Name of the option, as in skep_options_set.
/// @param value_out  Receives the value; 0 or 1 for a switch.
/// @retval SKEP_ERR_ARGUMENT  No option of this name, several, or one that is a text.
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

/// Sets any option from its text.
///
/// @param options  The options.
/// @param name     Name of the option, as in skep_options_set.
/// @param value    A number, "true" or "false", a name, or a schedule such as "downscale=2 food_sources=3
///                 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1".
/// @retval SKEP_ERR_ARGUMENT  No option of this name, several, or a text or value that it does not accept.
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

/// Copies the text of any option, in the form that skep_options_set_text accepts.
///
/// @param options     The options.
/// @param name        Name of the option, as in skep_options_set.
/// @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
/// @param capacity    Bytes of room in `buffer`; a longer text is cut.
/// @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
/// @retval SKEP_ERR_ARGUMENT  No option of this name, or several.
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

/// Lists the options.
///
/// @param index  Index of the option, from 0.
/// @return Name of the option with its group, a static text; NULL after the last.
#[unsafe(no_mangle)]
pub extern "C" fn skep_option_name(index: usize) -> *const c_char {
    Options::c_name(index).map_or(std::ptr::null(), |name| name.as_ptr())
}

/// The options of a call; NULL is the default preset.
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
