//! Maps in C's buffers: a row of values for each row of pixels, with strides.

use super::image::{check_rows, rows};
use super::status::Failure;
use crate::memory::require_memory;
use std::ffi::c_void;

/// Types of which every bit pattern is a value.
pub trait Plain: Copy + Default {}
impl Plain for f32 {}
impl Plain for u8 {}
impl Plain for u16 {}
impl Plain for u32 {}
impl Plain for [f32; 3] {}

/// Refuses a map that [`read`] would refuse: for callers who read several maps, before the first is copied.
pub fn check<T: Plain>(
    data: *const T,
    (width, height): (u32, u32),
    stride_bytes: usize,
    name: &str,
) -> Result<(), Failure> {
    check_rows(data.cast::<c_void>(), width as usize * size_of::<T>(), height, stride_bytes, name)
}

/// A copy of a map of `width` x `height` values.
///
/// # Safety
/// `data` is NULL or points to `height` rows of `width` values, `stride_bytes` apart.
pub unsafe fn read<T: Plain>(
    data: *const T,
    (width, height): (u32, u32),
    stride_bytes: usize,
    name: &str,
) -> Result<Vec<T>, Failure> {
    let row_bytes = width as usize * size_of::<T>();
    // SAFETY: as promised by the caller.
    let rows = unsafe { rows(data.cast::<c_void>(), row_bytes, height, stride_bytes, name) }?;
    let pixels = width as usize * height as usize;
    require_memory((pixels * size_of::<T>()) as u64, format!("a copy of {name}"))?;
    let mut values = vec![T::default(); pixels];
    for (row, into) in rows.zip(values.chunks_exact_mut((width as usize).max(1))) {
        // SAFETY: both hold `row_bytes` bytes, and any bits are a value of `T`.
        unsafe { into.as_mut_ptr().cast::<u8>().copy_from_nonoverlapping(row.as_ptr(), row_bytes) }
    }
    Ok(values)
}

/// A caller's buffer for a map, checked; written last of all.
pub struct OutMap<T> {
    data: *mut T,
    width: usize,
    height: usize,
    stride_bytes: usize,
}

/// # Safety
/// `data` is NULL or points to memory for `height` rows of `width` values, `stride_bytes` apart.
pub unsafe fn out<T: Plain>(
    data: *mut T,
    (width, height): (u32, u32),
    stride_bytes: usize,
    name: &str,
) -> Result<OutMap<T>, Failure> {
    check_rows(data.cast::<c_void>(), width as usize * size_of::<T>(), height, stride_bytes, name)?;
    Ok(OutMap { data, width: width as usize, height: height as usize, stride_bytes })
}

impl<T: Plain> OutMap<T> {
    /// Writes the value of each pixel, given its index.
    pub fn set(self, value: impl Fn(usize) -> T) {
        let mut row = vec![T::default(); self.width];
        for y in 0..self.height {
            row.iter_mut().enumerate().for_each(|(x, place)| *place = value(y * self.width + x));
            // SAFETY: the caller of `out` promised the memory, which needs no alignment byte by byte.
            unsafe {
                let into = self.data.cast::<u8>().add(y * self.stride_bytes);
                into.copy_from_nonoverlapping(row.as_ptr().cast::<u8>(), self.width * size_of::<T>());
            }
        }
    }
}
