//! From C's pointers to references, with all checks that are possible.

use super::status::{Failure, SKEP_ERR_CAPACITY, SKEP_ERR_NULL, SKEP_ERR_POISONED};
use super::text::copy_text;
use std::ffi::{CStr, OsStr, c_char};
use std::path::Path;
use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard};

fn null(name: &str) -> Failure {
    Failure::new(SKEP_ERR_NULL, format!("{name} is NULL; expected a pointer to one"))
}

fn require_aligned<T>(pointer: *const T, name: &str) -> Result<(), Failure> {
    if pointer.is_aligned() {
        return Ok(());
    }
    let expected = format!("an address that is a multiple of {}", align_of::<T>());
    Err(Failure::argument(name, format!("{pointer:p}"), expected))
}

/// # Safety
/// `pointer` is NULL or points to a `T` that stays as it is for `'a`.
pub unsafe fn get<'a, T>(pointer: *const T, name: &str) -> Result<&'a T, Failure> {
    require_aligned(pointer, name)?;
    // SAFETY: not NULL and aligned as checked; the rest is the caller's promise.
    unsafe { pointer.as_ref() }.ok_or_else(|| null(name))
}

/// A place for one value, which is written last of all.
pub struct Out<T>(*mut T);

/// # Safety
/// `pointer` is NULL or points to memory for a `T` until the `Out` is gone.
pub unsafe fn out<T>(pointer: *mut T, name: &str) -> Result<Out<T>, Failure> {
    if pointer.is_null() {
        return Err(null(name));
    }
    require_aligned(pointer, name)?;
    Ok(Out(pointer))
}

impl<T> Out<T> {
    pub fn set(self, value: T) {
        // SAFETY: `out` checked that it is not NULL and aligned, and was promised that there is memory.
        unsafe { self.0.write(value) }
    }
}

impl<T> Out<*mut T> {
    /// Hands an object over to the caller, who destroys it.
    pub fn give(self, object: T) {
        self.set(Box::into_raw(Box::new(object)));
    }
}

/// Destroys an object that was handed over; NULL is ignored.
///
/// # Safety
/// `object` is NULL or came from [`Out::give`], and nobody uses it any more.
pub unsafe fn destroy<T>(object: *mut T) {
    if !object.is_null() {
        // SAFETY: it came from Box::into_raw and is given back once.
        drop(unsafe { Box::from_raw(object) });
    }
}

/// `(NULL, 0)` is empty.
///
/// # Safety
/// `pointer` is NULL or points to `count` values that stay as they are for `'a`.
pub unsafe fn slice<'a, T>(pointer: *const T, count: usize, name: &str) -> Result<&'a [T], Failure> {
    check_count::<T>(pointer, count, name)?;
    if count == 0 {
        return Ok(&[]);
    }
    // SAFETY: not NULL, aligned and not too long as checked; the rest is the caller's promise.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

fn check_count<T>(pointer: *const T, count: usize, name: &str) -> Result<(), Failure> {
    if count == 0 {
        return Ok(());
    }
    if pointer.is_null() {
        return Err(Failure::new(SKEP_ERR_NULL, format!("{name} is NULL; expected {count} values")));
    }
    if count.checked_mul(size_of::<T>()).is_none_or(|bytes| bytes > isize::MAX as usize) {
        return Err(Failure::argument(&format!("number of {name}"), count, "what fits into memory"));
    }
    require_aligned(pointer, name)
}

/// [`out`] for a caller who may not want the value: `None` for NULL.
///
/// # Safety
/// Like [`out`].
pub unsafe fn wanted_one<T>(pointer: *mut T, name: &str) -> Result<Option<Out<T>>, Failure> {
    // SAFETY: as promised by the caller.
    (!pointer.is_null()).then(|| unsafe { out(pointer, name) }).transpose()
}

/// Memory for values that are written last of all.
pub struct OutSlice<T>(*mut T);

/// Room for `needed` values.
///
/// # Safety
/// `pointer` is NULL or points to memory for `capacity` values until the `OutSlice` is gone.
pub unsafe fn out_slice<T: Copy>(
    pointer: *mut T,
    capacity: usize,
    needed: usize,
    name: &str,
) -> Result<OutSlice<T>, Failure> {
    check_count::<T>(pointer, needed, name)?;
    if capacity < needed {
        let text = format!("{name} has room for {capacity} values; expected at least {needed}");
        return Err(Failure::new(SKEP_ERR_CAPACITY, text));
    }
    Ok(OutSlice(pointer))
}

impl<T: Copy> OutSlice<T> {
    /// Writes the values, of which there are as many as room was asked for.
    pub fn set(self, values: &[T]) {
        if !values.is_empty() {
            // SAFETY: `out_slice` checked pointer and capacity, and was promised that there is memory; the
            // values are the library's own and do not overlap it.
            unsafe { self.0.copy_from_nonoverlapping(values.as_ptr(), values.len()) }
        }
    }
}

/// [`out_slice`] for a caller who may not want the values: `None` for NULL.
///
/// # Safety
/// Like [`out_slice`].
pub unsafe fn wanted<T: Copy>(
    pointer: *mut T,
    capacity: usize,
    needed: usize,
    name: &str,
) -> Result<Option<OutSlice<T>>, Failure> {
    // SAFETY: as promised by the caller.
    (!pointer.is_null()).then(|| unsafe { out_slice(pointer, capacity, needed, name) }).transpose()
}

/// Copies a list of values, or only returns their number where `pointer` is NULL. The names are those of
/// `pointer` and `count`.
///
/// # Safety
/// `pointer` is NULL or points to memory for `capacity` values; `count` is NULL or points to memory for one.
pub unsafe fn give_list<T: Copy>(
    values: &[T],
    pointer: *mut T,
    capacity: usize,
    count: *mut usize,
    (name, count_name): (&str, &str),
) -> Result<(), Failure> {
    // SAFETY: as promised by the caller.
    let count = unsafe { out(count, count_name) }?;
    if !pointer.is_null() {
        // SAFETY: as promised by the caller.
        unsafe { out_slice(pointer, capacity, values.len(), name) }?.set(values);
    }
    count.set(values.len());
    Ok(())
}

/// # Safety
/// `text` is NULL or points to characters up to a NUL that stay as they are for `'a`.
pub unsafe fn text<'a>(text: *const c_char, name: &str) -> Result<&'a str, Failure> {
    // SAFETY: as promised by the caller.
    let bytes = unsafe { c_str(text, name) }?;
    bytes.to_str().map_err(|error| Failure::argument(name, format!("no UTF-8 ({error})"), "UTF-8"))
}

/// # Safety
/// Like [`text`].
unsafe fn c_str<'a>(text: *const c_char, name: &str) -> Result<&'a CStr, Failure> {
    if text.is_null() {
        return Err(null(name));
    }
    // SAFETY: not NULL; the rest is the caller's promise.
    Ok(unsafe { CStr::from_ptr(text) })
}

/// A path in the bytes of the file system; UTF-8 where that has no bytes.
///
/// # Safety
/// Like [`text`].
pub unsafe fn path<'a>(path: *const c_char, name: &str) -> Result<&'a Path, Failure> {
    #[cfg(unix)]
    {
        // SAFETY: as promised by the caller.
        let bytes = unsafe { c_str(path, name) }?.to_bytes();
        Ok(Path::new(<OsStr as std::os::unix::ffi::OsStrExt>::from_bytes(bytes)))
    }
    #[cfg(not(unix))]
    {
        // SAFETY: as promised by the caller.
        Ok(Path::new(OsStr::new(unsafe { self::text(path, name) }?)))
    }
}

/// [`copy_text`] with the number of bytes in `needed`, which may be NULL.
///
/// # Safety
/// `buffer` is NULL or points to `capacity` writable bytes, `needed` is NULL or points to memory for a size.
pub unsafe fn give_text(
    text: &str,
    buffer: *mut c_char,
    capacity: usize,
    needed: *mut usize,
) -> Result<(), Failure> {
    // SAFETY: as promised by the caller.
    unsafe {
        let place = wanted_one(needed, "needed_out")?;
        let length = copy_text(text, buffer, capacity);
        place.into_iter().for_each(|place| place.set(length));
    }
    Ok(())
}

/// The inside of an object that changes; refused once a call that changed it panicked.
pub fn read<T>(lock: &RwLock<T>) -> Result<RwLockReadGuard<'_, T>, Failure> {
    lock.read().map_err(|_| poisoned())
}

/// Like [`read`], to change it.
pub fn write<T>(lock: &RwLock<T>) -> Result<RwLockWriteGuard<'_, T>, Failure> {
    lock.write().map_err(|_| poisoned())
}

fn poisoned() -> Failure {
    Failure::new(SKEP_ERR_POISONED, "an earlier call that was changing this object panicked; destroy it")
}
