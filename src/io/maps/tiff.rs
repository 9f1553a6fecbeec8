//! TIFF files of 32-bit floats, without compression.

use crate::error::Result;
use crate::io::files::write_file;
use std::io;
use std::path::Path;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::{Gray32Float, RGB32Float};

pub(super) fn write(path: &Path, (width, height): (u32, u32), channels: usize, values: &[f32]) -> Result<()> {
    write_file(path, |out| {
        let written = TiffEncoder::new(out).and_then(|mut encoder| match channels {
            1 => encoder.write_image::<Gray32Float>(width, height, values),
            _ => encoder.write_image::<RGB32Float>(width, height, values),
        });
        written.map_err(io::Error::other)
    })
}
