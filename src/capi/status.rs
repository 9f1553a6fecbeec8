//! Status codes, the text of the last error, versions.

use super::pointers::copy_text;
use crate::error::Error;
use crate::simd::SimdLevel;
use std::cell::RefCell;
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a call came to: SKEP_OK or one of the negative SKEP_ERR_ codes. skep_last_error tells the rest.
pub type skep_status = i32;

/// Version of this interface, which rises with every incompatible change. The SONAME follows the library's version.
pub const SKEP_ABI_VERSION: u32 = 1;

/// Done.
pub const SKEP_OK: i32 = 0;
/// A pointer that must not be NULL is.
pub const SKEP_ERR_NULL: i32 = -1;
/// A value cannot be used: out of range, not a number, of the wrong size, unknown, or in the wrong order.
pub const SKEP_ERR_ARGUMENT: i32 = -2;
/// The object cannot be used any more: a call that was changing it panicked. Destroy it.
pub const SKEP_ERR_POISONED: i32 = -3;
/// The progress callback asked to stop.
pub const SKEP_ERR_CANCELLED: i32 = -4;
/// A file cannot be read, understood or written.
pub const SKEP_ERR_FILE: i32 = -5;
/// A buffer is smaller than what goes into it.
pub const SKEP_ERR_CAPACITY: i32 = -6;
/// An error of the library itself; please report the text.
pub const SKEP_ERR_PANIC: i32 = -7;

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
            Error::Cancelled => SKEP_ERR_CANCELLED,
        };
        Failure::new(status, error.to_string())
    }
}

/// Result of the inside of an entry.
pub type Status = Result<(), Failure>;

thread_local! {
    static LAST_ERROR: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Runs the inside of an entry. A panic ends here: unwinding into C would be undefined behavior.
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
    // Threads that are just ending have no place for a text any more.
    let _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = failure.text);
    failure.status
}

/// The SKEP_ABI_VERSION the library was built with. Compare it with the one of the header you compiled against.
#[unsafe(no_mangle)]
pub extern "C" fn skep_abi_version() -> u32 {
    SKEP_ABI_VERSION
}

/// The library's version, such as "0.1.0"; static.
#[unsafe(no_mangle)]
pub extern "C" fn skep_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// The instruction set that runs are made on unless an option says otherwise: "scalar", "baseline" or "v3" (AVX2); static.
/// The environment variable SKEP_SIMD forces one of them, lowered to what the machine has. Results do not depend on it.
#[unsafe(no_mangle)]
pub extern "C" fn skep_simd_level_name() -> *const c_char {
    let name: &CStr = match SimdLevel::detect() {
        SimdLevel::Scalar => c"scalar",
        SimdLevel::Baseline => c"baseline",
        SimdLevel::X86V3 => c"v3",
    };
    name.as_ptr()
}

/// A word for a status, such as "argument"; static, never NULL.
#[unsafe(no_mangle)]
pub extern "C" fn skep_status_name(status: skep_status) -> *const c_char {
    let name: &CStr = match status {
        SKEP_OK => c"ok",
        SKEP_ERR_NULL => c"null",
        SKEP_ERR_ARGUMENT => c"argument",
        SKEP_ERR_POISONED => c"state",
        SKEP_ERR_CANCELLED => c"cancelled",
        SKEP_ERR_FILE => c"file",
        SKEP_ERR_CAPACITY => c"capacity",
        SKEP_ERR_PANIC => c"panic",
        _ => c"unknown",
    };
    name.as_ptr()
}

/// Copies the text of the last call of this thread that failed: the argument, its value, and what would have been
/// right. Empty before the first failure; calls that succeed leave it alone.
///
/// At most `capacity` bytes are written, the last of them NUL; a longer text is cut between characters. (NULL, 0) only
/// asks for the length. Returns the bytes the whole text takes with its NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn skep_last_error(buffer: *mut c_char, capacity: usize) -> usize {
    let copy = |last: &RefCell<String>| {
        // SAFETY: the caller hands in `capacity` writable bytes, or NULL.
        unsafe { copy_text(&last.borrow(), buffer, capacity) }
    };
    LAST_ERROR.try_with(copy).unwrap_or(1)
}
