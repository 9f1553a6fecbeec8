//! The positions of a cloud in a PLY file.

use crate::error::{Error, Result};
use crate::io::cannot_be_read;
use crate::memory::require_memory;
use glam::DVec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{PropertyAccess, PropertyAccessResult};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Memory for a byte of a file of positions alone: the parser's list and the result.
const MEMORY_PER_BYTE: u64 = 5;

/// Only the coordinates of a vertex; other properties are passed over.
#[derive(Debug, Clone, Copy)]
struct Position([f64; 3]);

impl Position {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let index = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.0[index] = value;
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Position {
    fn new() -> Position {
        Position([f64::NAN; 3])
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into())
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }
}

/// Reads the vertices' `x y z`, float or double, of an ascii or binary file; what follows them is not read.
///
/// # Errors
/// Not a PLY file whose first element is `vertex`; fewer vertices than in the header; coordinates that are
/// missing or not finite.
pub(super) fn read(path: &Path) -> Result<Vec<DVec3>> {
    let file = File::open(path).map_err(|error| cannot_be_read(path, error))?;
    let bytes = file.metadata().map_err(|error| cannot_be_read(path, error))?.len();
    require_memory(bytes.saturating_mul(MEMORY_PER_BYTE), format!("the points in {}", path.display()))?;
    let mut reader = Reader::new(BufReader::new(file));
    let parser = Parser::<Position>::new();
    let header = parser.read_header(&mut reader).map_err(|error| Error::file(path, error))?;
    let Some((_, vertices)) = header.elements.first().filter(|(name, _)| *name == "vertex") else {
        return Err(Error::file(path, "the first element is not vertex; expected a cloud of points"));
    };
    // Every vertex has a byte at least: a count beyond the file's size is found before anything is allocated.
    if vertices.count as u64 > bytes {
        let problem =
            format!("truncated: the header has {} vertices, the file {bytes} bytes", vertices.count);
        return Err(Error::file(path, problem));
    }
    let found = parser
        .read_payload_for_element(&mut reader, vertices, &header)
        .map_err(|error| Error::file(path, format!("fewer than {} vertices: {error}", vertices.count)))?;
    let position = |(index, Position(position)): (usize, Position)| {
        let position = DVec3::from(position);
        match position.is_finite() {
            true => Ok(position),
            false => Err(Error::file(
                path,
                format!("vertex {index} is {position}; expected finite float or double x, y, z"),
            )),
        }
    };
    found.into_iter().enumerate().map(position).collect()
}
