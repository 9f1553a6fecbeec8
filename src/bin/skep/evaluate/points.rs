//! Clouds of any program: PLY, LAS and LAZ.

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{PropertyAccess, PropertyAccessResult};
use skep::{CloudFormat, Error, Result};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Points of a LAS file that are read at a time.
const LAS_PART: u64 = 1 << 16;

/// Points and, where the file has them, their colors.
#[derive(Debug, Default)]
pub struct Points {
    pub positions: Vec<[f64; 3]>,
    pub colors: Option<Vec<[u8; 3]>>,
    /// Points that were left out, as their coordinates are not finite.
    pub dropped: usize,
}

/// Reads a cloud; the ending tells the format.
///
/// # Errors
/// An unknown ending; a damaged file; one without points, or none whose coordinates are finite.
pub fn read(path: &Path) -> Result<Points> {
    let mut points = match CloudFormat::of_file(path)? {
        CloudFormat::Ply => read_ply(path)?,
        CloudFormat::Las | CloudFormat::Laz => read_las(path)?,
    };
    let is_finite: Vec<bool> = points
        .positions
        .iter()
        .map(|position| position.iter().all(|coordinate| coordinate.is_finite()))
        .collect();
    let count = points.positions.len();
    keep(&mut points.positions, &is_finite);
    points.colors.iter_mut().for_each(|colors| keep(colors, &is_finite));
    points.dropped = count - points.positions.len();
    match (count, points.positions.is_empty()) {
        (0, _) => Err(Error::file(path, "the cloud is empty; expected points")),
        (_, true) => Err(Error::file(path, format!("none of {count} points has finite coordinates"))),
        (_, false) => Ok(points),
    }
}

fn keep<T>(values: &mut Vec<T>, is_kept: &[bool]) {
    let mut place = is_kept.iter();
    values.retain(|_| place.next().is_some_and(|is_kept| *is_kept));
}

/// A vertex of any layout; what it lacks is NaN or `None`.
struct Vertex {
    position: [f64; 3],
    color: [Option<u8>; 3],
}

impl Vertex {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        let Some(axis) = ["x", "y", "z"].iter().position(|axis| *axis == name) else {
            return PropertyAccessResult::Ignored;
        };
        self.position[axis] = value;
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex { position: [f64::NAN; 3], color: [None; 3] }
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into())
    }

    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }

    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        let names =
            [["red", "r", "diffuse_red"], ["green", "g", "diffuse_green"], ["blue", "b", "diffuse_blue"]];
        let Some(channel) = names.iter().position(|names| names.contains(&name)) else {
            return PropertyAccessResult::Ignored;
        };
        self.color[channel] = Some(value);
        PropertyAccessResult::Set
    }
}

/// Reads the vertices of an ascii or binary file; what follows them is not read.
fn read_ply(path: &Path) -> Result<Points> {
    let unreadable = |error: std::io::Error| Error::file(path, format!("cannot be read: {error}"));
    let file = File::open(path).map_err(unreadable)?;
    let bytes = file.metadata().map_err(unreadable)?.len();
    let mut reader = Reader::new(BufReader::new(file));
    let parser = Parser::<Vertex>::new();
    let header = parser.read_header(&mut reader).map_err(|error| Error::file(path, error))?;
    let Some((_, vertices)) = header.elements.first().filter(|(name, _)| *name == "vertex") else {
        return Err(Error::file(path, "the first element is not vertex; expected a cloud of points"));
    };
    let lacking = ["x", "y", "z"].iter().find(|name| !vertices.properties.contains_key(**name));
    if let Some(name) = lacking {
        return Err(Error::file(path, format!("a vertex has no {name}; expected float or double x, y, z")));
    }
    // Every vertex has a byte at least: a count beyond the file's size is found before anything is allocated.
    if vertices.count as u64 > bytes {
        let problem =
            format!("truncated: the header has {} vertices, the file {bytes} bytes", vertices.count);
        return Err(Error::file(path, problem));
    }
    let found = parser
        .read_payload_for_element(&mut reader, vertices, &header)
        .map_err(|error| Error::file(path, format!("fewer than {} vertices: {error}", vertices.count)))?;
    let color = |vertex: &Vertex| -> Option<[u8; 3]> {
        let [red, green, blue] = vertex.color;
        Some([red?, green?, blue?])
    };
    Ok(Points {
        positions: found.iter().map(|vertex| vertex.position).collect(),
        colors: found.iter().map(color).collect(),
        dropped: 0,
    })
}

fn read_las(path: &Path) -> Result<Points> {
    let failed = |error: las::Error| Error::file(path, format!("cannot be read: {error}"));
    let mut reader = las::Reader::from_path(path).map_err(failed)?;
    let (mut positions, mut colors) = (Vec::new(), Some(Vec::new()));
    // In parts: the number of points in a damaged header may be any.
    loop {
        let points = reader.read_points(LAS_PART).map_err(failed)?;
        if points.is_empty() {
            return Ok(Points { positions, colors, dropped: 0 });
        }
        positions.extend(points.x().zip(points.y()).zip(points.z()).map(|((x, y), z)| [x, y, z]));
        // 16 bits become 8.
        let of_color = |(red, green, blue): (u16, u16, u16)| [red, green, blue].map(|own| (own >> 8) as u8);
        match (&mut colors, points.rgb()) {
            (Some(colors), Some(more)) => colors.extend(more.map(of_color)),
            _ => colors = None,
        }
    }
}
