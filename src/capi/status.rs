//! Status codes, the text of the last error, versions.

use super::text::copy_text;
use crate::error::Error;
use crate::simd::SimdLevel;
use std::cell::RefCell;
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Result of a call: SKEP_OK or one of the negative SKEP_ERR_ codes; skep_last_error returns the text.
pub type skep_status = i32;

/// Version of this interface; it rises with every incompatible change. The SONAME follows the library's
/// version.
pub const SKEP_ABI_VERSION: u32 = 1;

/// Success.
pub const SKEP_OK: i32 = 0;
/// A pointer that must not be NULL is NULL.
pub const SKEP_ERR_NULL: i32 = -1;
/// A value cannot be used: out of range, not finite, of the wrong size, unknown, or in the wrong order.
pub const SKEP_ERR_ARGUMENT: i32 = -2;
/// A scene or options object cannot be used any more: a call that was changing it panicked. Destroy it.
pub const SKEP_ERR_POISONED: i32 = -3;
/// The progress callback returned non-zero.
pub const SKEP_ERR_CANCELLED: i32 = -4;
/// A file cannot be read, parsed or written.
pub const SKEP_ERR_FILE: i32 = -5;
/// A buffer is too small for the output.
pub const SKEP_ERR_CAPACITY: i32 = -6;
/// An error in the library itself; please report the text.
pub const SKEP_ERR_PANIC: i32 = -7;

/// There is not enough memory for the call.
pub const SKEP_ERR_MEMORY: i32 = -8;

/// A failed call.
pub struct Failure {
    status: skep_status,
    text: String,
}

impl Failure {
    pub fn new(status: skep_status, text: impl Into<String>) -> Failure {
        Failure { status, text: text.into() }
    }

    pub fn argument(name: &str, value: impl std::fmt::Display, expected: impl Into<String>) -> Failure {
        Error::argument(name, value, expected).into()
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        let status = match error {
            Error::Argument { .. } => SKEP_ERR_ARGUMENT,
            Error::File { .. } => SKEP_ERR_FILE,
            Error::Memory { .. } => SKEP_ERR_MEMORY,
            Error::Cancelled => SKEP_ERR_CANCELLED,
        };
        Failure::new(status, error.to_string())
    }
}

/// Result of the body of an entry.
pub type Status = Result<(), Failure>;

thread_local! {
    static LAST_ERROR: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Runs the body of an entry. A panic is caught here: unwinding into C would be undefined behavior.
pub fn guard(entry: impl FnOnce() -> Status) -> skep_status {
    let failure = match catch_unwind(AssertUnwindSafe(entry)) {
        Ok(Ok(())) => return SKEP_OK,
        Ok(Err(failure)) => failure,
        Err(panic) => {
            let message = panic.downcast_ref::<&str>().copied();
            let message = message.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
            let text = format!("the library panicked: {}", message.unwrap_or("no message"));
            Failure::new(SKEP_ERR_PANIC, text)
        }
    };
    // The thread-local text of a thread that is exiting may be gone already.
    let _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = failure.text);
    failure.status
}

/// Version of the interface that the library was built with; compare it with SKEP_ABI_VERSION of the header.
///
/// @return The version.
#[unsafe(no_mangle)]
pub extern "C" fn skep_abi_version() -> u32 {
    SKEP_ABI_VERSION
}

/// Version of the library, such as "0.1.0".
///
/// @return A static text.
#[unsafe(no_mangle)]
pub extern "C" fn skep_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// Instruction set that runs use unless option "simd" says otherwise: "scalar", "baseline" or "v3" (AVX2).
/// Results do not depend on it. The environment variable SKEP_SIMD selects another one, lowered to what the
/// machine has.
///
/// @return A static text.
#[unsafe(no_mangle)]
pub extern "C" fn skep_simd_level_name() -> *const c_char {
    let name: &CStr = match SimdLevel::detect() {
        SimdLevel::Scalar => c"scalar",
        SimdLevel::Baseline => c"baseline",
        SimdLevel::X86V3 => c"v3",
    };
    name.as_ptr()
}

/// Short name of a status, such as "argument".
///
/// @param status  Any number.
/// @return A static text, never NULL; "unknown" for other numbers.
#[unsafe(no_mangle)]
pub extern "C" fn skep_status_name(status: skep_status) -> *const c_char {
    let name: &CStr = match status {
        SKEP_OK => c"ok",
        SKEP_ERR_NULL => c"null",
        SKEP_ERR_ARGUMENT => c"argument",
        SKEP_ERR_POISONED => c"poisoned",
        SKEP_ERR_CANCELLED => c"cancelled",
        SKEP_ERR_FILE => c"file",
        SKEP_ERR_MEMORY => c"memory",
        SKEP_ERR_CAPACITY => c"capacity",
        SKEP_ERR_PANIC => c"panic",
        _ => c"unknown",
    };
    name.as_ptr()
}

/// Copies the error text of the last failed call of the calling thread: the argument, its value and what was
/// expected. It is empty before the first failure; calls that succeed do not change it.
///
/// A text that is too long is cut between characters, and still ends with NUL.
///
/// @param buffer    Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
/// @param capacity  Bytes of room in `buffer`.
/// @return Bytes of the whole text with its NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_last_error(buffer: *mut c_char, capacity: usize) -> usize {
    let copy = |last: &RefCell<String>| {
        // SAFETY: the caller hands in `capacity` writable bytes, or NULL.
        unsafe { copy_text(&last.borrow(), buffer, capacity) }
    };
    LAST_ERROR.try_with(copy).unwrap_or(1)
}
