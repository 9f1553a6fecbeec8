//! Arrays of numbers in MATLAB files of version 5.
//!
//! ```text
//! 116 bytes of text  u64  u16 version  "IM" (little-endian)
//! elements: u32 type  u32 bytes  data, filled up to 8 bytes
//!           or, of 4 bytes at most: u16 type  u16 bytes  data, filled up to 4 bytes
//! an array is an element of elements: flags (class), sizes (i32), name, values; or that, compressed by zlib
//! ```

use flate2::read::ZlibDecoder;
use skep::{Error, Result};
use std::io::Read;
use std::path::Path;

/// Bytes before the first element.
const HEADER: usize = 128;
/// Types of elements.
const SIZES: u32 = 5;
const ARRAY: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of arrays that hold numbers: double to the unsigned integers of 64 bits.
const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15;
/// Bytes of an array at most, of which each becomes a number of eight in memory.
const MOST_BYTES: u64 = 1 << 28;

/// An array of numbers.
#[derive(Debug, PartialEq)]
pub struct Array {
    pub name: String,
    pub size: Vec<usize>,
    /// Column after column.
    pub values: Vec<f64>,
}

/// The arrays of numbers in a file; others are passed over.
///
/// # Errors
/// A file that is missing, damaged, big-endian or of version 7.3.
pub fn read(path: &Path) -> Result<Vec<Array>> {
    let bytes = std::fs::read(path).map_err(|error| Error::file(path, format!("cannot be read: {error}")))?;
    if bytes.starts_with(b"MATLAB 7.3") {
        let problem = "a MATLAB file of version 7.3; expected version 5 (in MATLAB: save -v7)";
        return Err(Error::file(path, problem));
    }
    let damaged =
        |problem: &str| Error::file(path, format!("expected a MATLAB file of version 5: {problem}"));
    if bytes.get(HEADER - 2..HEADER) != Some(b"IM") {
        return Err(damaged("no header of one with little-endian numbers"));
    }
    let mut rest = &bytes[HEADER..];
    let mut arrays = Vec::new();
    while !rest.is_empty() {
        let (kind, data) = element(&mut rest).ok_or_else(|| damaged("it is truncated"))?;
        let found = match kind {
            COMPRESSED => {
                let mut inflated = Vec::new();
                let read = ZlibDecoder::new(data).take(MOST_BYTES).read_to_end(&mut inflated);
                read.map_err(|error| damaged(&format!("an array cannot be decompressed: {error}")))?;
                if inflated.len() as u64 == MOST_BYTES {
                    return Err(damaged(&format!("an array has {MOST_BYTES} bytes or more")));
                }
                match element(&mut inflated.as_slice()) {
                    Some((ARRAY, data)) => array(data),
                    _ => Err("a compressed array is truncated".to_owned()),
                }
            }
            ARRAY => array(data),
            _ => Ok(None),
        };
        arrays.extend(found.map_err(|problem| damaged(&problem))?);
    }
    Ok(arrays)
}

/// Takes an element; `None` if it is truncated.
fn element<'a>(rest: &mut &'a [u8]) -> Option<(u32, &'a [u8])> {
    let first = u32_at(rest, 0)?;
    // The upper half of a small element is its number of bytes.
    let (kind, start, length) = match first >> 16 {
        0 => (first, 8, u32_at(rest, 4)? as usize),
        length => (first & 0xffff, 4, length as usize),
    };
    let end = start + length;
    let data = rest.get(start..end)?;
    // Compressed elements are not filled up, nor need the last one be.
    let next = if kind == COMPRESSED { end } else { end.next_multiple_of(8) };
    *rest = rest.get(next..).unwrap_or_default();
    Some((kind, data))
}

fn u32_at(bytes: &[u8], place: usize) -> Option<u32> {
    bytes.get(place..place + 4).map(|at| u32::from_le_bytes([at[0], at[1], at[2], at[3]]))
}

/// The array of an element; `None` if it does not hold numbers.
fn array(mut rest: &[u8]) -> std::result::Result<Option<Array>, String> {
    let mut next = || element(&mut rest).ok_or("an array is truncated");
    let class = next()?.1.first().copied().unwrap_or_default();
    if !NUMBERS.contains(&class) {
        return Ok(None);
    }
    let (kind, sizes) = next()?;
    let name = String::from_utf8_lossy(next()?.1).into_owned();
    if kind != SIZES {
        return Err(format!("the size of {name} is missing"));
    }
    let size: Vec<usize> =
        sizes.as_chunks::<4>().0.iter().map(|side| i32::from_le_bytes(*side).max(0) as usize).collect();
    let (kind, data) = next()?;
    let values = values(kind, data).ok_or(format!("the values of {name} have the unknown type {kind}"))?;
    let count = size.iter().try_fold(1usize, |product, side| product.checked_mul(*side));
    match count == Some(values.len()) {
        true => Ok(Some(Array { name, size, values })),
        false => Err(format!("{name} has {} values and the size {size:?}", values.len())),
    }
}

/// Values of any type of numbers.
fn values(kind: u32, data: &[u8]) -> Option<Vec<f64>> {
    fn all<const SIZE: usize>(data: &[u8], number: impl Fn([u8; SIZE]) -> f64) -> Vec<f64> {
        data.as_chunks::<SIZE>().0.iter().map(|bytes| number(*bytes)).collect()
    }
    Some(match kind {
        1 => all(data, |bytes| i8::from_le_bytes(bytes).into()),
        2 => all(data, |bytes| u8::from_le_bytes(bytes).into()),
        3 => all(data, |bytes| i16::from_le_bytes(bytes).into()),
        4 => all(data, |bytes| u16::from_le_bytes(bytes).into()),
        5 => all(data, |bytes| i32::from_le_bytes(bytes).into()),
        6 => all(data, |bytes| u32::from_le_bytes(bytes).into()),
        7 => all(data, |bytes| f32::from_le_bytes(bytes).into()),
        9 => all(data, f64::from_le_bytes),
        12 => all(data, |bytes| i64::from_le_bytes(bytes) as f64),
        13 => all(data, |bytes| u64::from_le_bytes(bytes) as f64),
        _ => return None,
    })
}
