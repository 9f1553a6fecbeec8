//! Texts for C.

use std::ffi::c_char;

/// Copies a text with its NUL, cut between characters where it is too long; returns the bytes the whole of it
/// takes.
///
/// # Safety
/// `buffer` is NULL or points to `capacity` writable bytes.
pub unsafe fn copy_text(text: &str, buffer: *mut c_char, capacity: usize) -> usize {
    // A NUL inside, from a path for example, would cut the text for C.
    let text = text.split('\0').next().unwrap_or_default();
    if !buffer.is_null() && capacity > 0 {
        let length = text.floor_char_boundary(capacity - 1);
        // SAFETY: `length` + 1 <= `capacity` bytes, which the caller promises are writable.
        unsafe {
            buffer.cast::<u8>().copy_from_nonoverlapping(text.as_ptr(), length);
            buffer.add(length).write(0);
        }
    }
    text.len() + 1
}
