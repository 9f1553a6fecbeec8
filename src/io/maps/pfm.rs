//! Portable float maps: `Pf` or `PF`, width and height, -1.0 for little-endian, then the rows from the bottom
//! to the top.

use crate::error::Result;
use crate::io::files::write_file;
use std::io::Write;
use std::path::Path;

pub(super) fn write(path: &Path, (width, height): (u32, u32), channels: usize, values: &[f32]) -> Result<()> {
    write_file(path, |out| {
        let kind = if channels == 1 { "Pf" } else { "PF" };
        write!(out, "{kind}\n{width} {height}\n-1.0\n")?;
        let rows = values.chunks_exact(width as usize * channels);
        rows.rev().flatten().try_for_each(|value| out.write_all(&value.to_le_bytes()))
    })
}
