//! NumPy's array files, version 1.0: a header that is a Python literal, then the values.

use crate::error::Result;
use crate::io::files::write_file;
use std::io::Write;
use std::path::Path;

/// Magic and version.
const START: &[u8] = b"\x93NUMPY\x01\x00";
/// The values begin at a multiple of these bytes.
const ALIGNMENT: usize = 64;

pub(super) fn write(path: &Path, (width, height): (u32, u32), channels: usize, values: &[f32]) -> Result<()> {
    let shape = if channels == 1 {
        format!("({height}, {width})")
    } else {
        format!("({height}, {width}, {channels})")
    };
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    // The header ends in a line break, and two bytes before it hold its length.
    let before = START.len() + 2;
    let length = (before + header.len() + 1).next_multiple_of(ALIGNMENT) - before;
    write_file(path, |out| {
        out.write_all(START)?;
        out.write_all(&(length as u16).to_le_bytes())?;
        writeln!(out, "{header:<width$}", width = length - 1)?;
        values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
    })
}
