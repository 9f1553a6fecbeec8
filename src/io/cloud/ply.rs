//! Fused clouds as COLMAP and viewers read them: `fused.ply`.

use super::extent::Extent;
use super::write_parts;
use crate::error::{Error, Result};
use crate::fusion::{CloudSource, PointCloud};
use crate::io::files::cannot_be_read;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;

/// Names of the properties in COLMAP's order: position, normal, color.
const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const COLOR: [&str; 3] = ["red", "green", "blue"];

/// One point.
#[derive(Debug, Clone, Copy, Default)]
struct Vertex {
    position: [f64; 3],
    normal: [f32; 3],
    color: [u8; 3],
}

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex::default()
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        place(&POSITION, name).map(|index| self.position[index])
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        let position = place(&POSITION, name).map(|index| self.position[index] as f32);
        position.or_else(|| place(&NORMAL, name).map(|index| self.normal[index]))
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        place(&COLOR, name).map(|index| self.color[index])
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        set(place(&POSITION, name).map(|index| &mut self.position[index]), value)
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        match place(&NORMAL, name) {
            Some(index) => set(Some(&mut self.normal[index]), value),
            None => self.set_double(name, value.into()),
        }
    }

    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        set(place(&COLOR, name).map(|index| &mut self.color[index]), value)
    }
}

fn set<T>(property: Option<&mut T>, value: T) -> PropertyAccessResult {
    match property {
        Some(property) => *property = value,
        None => return PropertyAccessResult::Ignored,
    }
    PropertyAccessResult::Set
}

fn place(names: &[&str], name: &str) -> Option<usize> {
    names.iter().position(|candidate| *candidate == name)
}

/// The header of a cloud whose positions are of this type.
fn header(points: usize, positions: ScalarType) -> Header {
    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = points;
    let named = |names: [&'static str; 3], kind: ScalarType| names.map(|name| (name, kind.clone()));
    let properties =
        [named(POSITION, positions), named(NORMAL, ScalarType::Float), named(COLOR, ScalarType::UChar)];
    for (name, kind) in properties.into_iter().flatten() {
        let property = PropertyDef::new(name.to_string(), PropertyType::Scalar(kind));
        vertex.properties.insert(name.to_string(), property);
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.elements.insert("vertex".to_owned(), vertex);
    header
}

/// Writes positions, normals and colors, binary little-endian. Positions are `float`, the type of COLMAP's
/// clouds; they are `double` where floats would move many points by more than an eighth of the distance to
/// their neighbors, as with geographic coordinates.
pub fn write_ply(path: &Path, cloud: &PointCloud) -> Result<()> {
    let points = cloud.positions.len();
    for (name, length) in [("cloud.normals", cloud.normals.len()), ("cloud.colors", cloud.colors.len())] {
        if length != points {
            return Err(Error::argument(
                name,
                format!("{length} values"),
                format!("one for each of {points} points"),
            ));
        }
    }
    write(path, cloud)
}

/// The same for a cloud in parts.
pub(super) fn write(path: &Path, cloud: &dyn CloudSource) -> Result<()> {
    let positions = match Extent::of(cloud)?.exceeds_floats() {
        true => ScalarType::Double,
        false => ScalarType::Float,
    };
    write_as(path, cloud, positions)
}

/// The same with `float` positions in any case, the layout that other programs demand.
pub(super) fn write_floats(path: &Path, cloud: &dyn CloudSource) -> Result<()> {
    write_as(path, cloud, ScalarType::Float)
}

fn write_as(path: &Path, cloud: &dyn CloudSource, positions: ScalarType) -> Result<()> {
    let header = header(cloud.len(), positions);
    let writer = Writer::<Vertex>::new();
    let start = |mut out: &mut dyn Write| writer.write_header(&mut out, &header).map(drop);
    write_parts(path, cloud, start, |mut out, points| {
        let vertices = points.positions.iter().zip(&points.normals).zip(&points.colors);
        for ((&position, &normal), &color) in vertices {
            let vertex = Vertex { position, normal, color };
            writer.write_little_endian_element(&mut out, &vertex, &header.elements["vertex"])?;
        }
        io::Result::Ok(())
    })
}

/// Reads the clouds that [`write_ply`] and COLMAP write. The lists of views are empty: they are in another
/// file, which [`read_visibility`](super::read_visibility) reads.
///
/// # Errors
/// Not a PLY file of these properties; fewer or more points than in the header.
pub fn read_ply(path: &Path) -> Result<PointCloud> {
    let file = File::open(path).map_err(|error| cannot_be_read(path, error))?;
    let mut reader = Reader::new(BufReader::new(file));
    let parser = Parser::<Vertex>::new();
    let found = parser.read_header(&mut reader).map_err(|error| Error::file(path, error))?;
    let count = found.elements.get("vertex").map_or(0, |vertex| vertex.count);
    let is_known = [ScalarType::Float, ScalarType::Double].into_iter().any(|positions| {
        let expected = header(count, positions);
        found.encoding == expected.encoding && found.elements == expected.elements
    });
    if !is_known {
        let properties = "vertex of float x y z nx ny nz (x y z may be double) and uchar red green blue";
        return Err(Error::file(
            path,
            format!("expected a binary_little_endian PLY file with one element, {properties}"),
        ));
    }
    let vertices = parser
        .read_payload_for_element(&mut reader, &found.elements["vertex"], &found)
        .map_err(|error| Error::file(path, format!("fewer than {count} points: {error}")))?;
    let rest = reader.get_mut().fill_buf().map_err(|error| cannot_be_read(path, error))?;
    if !rest.is_empty() {
        return Err(Error::file(path, format!("bytes follow the {count} points")));
    }
    let mut cloud = PointCloud::default();
    for Vertex { position, normal, color } in vertices {
        cloud.positions.push(position);
        cloud.normals.push(normal);
        cloud.colors.push(color);
    }
    Ok(cloud)
}
