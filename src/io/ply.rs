//! Fused clouds as COLMAP and viewers read them: `fused.ply` and `fused.ply.vis`.

use super::files::{FileReader, NewFolders, cannot_be_read, cannot_be_written, temporary_file, write_file};
use crate::error::{Error, Result};
use crate::fusion::{PointCloud, PointViews};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Names of the properties in COLMAP's order: floats, then bytes.
const FLOATS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
const BYTES: [&str; 3] = ["red", "green", "blue"];

/// One point in the types of the file.
#[derive(Debug, Clone, Copy, Default)]
struct Vertex {
    /// Position, then normal.
    floats: [f32; 6],
    color: [u8; 3],
}

impl PropertyAccess for Vertex {
    fn new() -> Vertex {
        Vertex::default()
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        place(&FLOATS, name).map(|index| self.floats[index])
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        place(&BYTES, name).map(|index| self.color[index])
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        set(place(&FLOATS, name).map(|index| &mut self.floats[index]), value)
    }

    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        set(place(&BYTES, name).map(|index| &mut self.color[index]), value)
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

/// The header of a cloud.
fn header(points: usize) -> Header {
    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = points;
    let floats = FLOATS.iter().map(|name| (name, ScalarType::Float));
    let bytes = BYTES.iter().map(|name| (name, ScalarType::UChar));
    for (name, kind) in floats.chain(bytes) {
        let property = PropertyDef::new(name.to_string(), PropertyType::Scalar(kind));
        vertex.properties.insert(name.to_string(), property);
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.elements.insert("vertex".to_owned(), vertex);
    header
}

/// Writes positions (rounded to f32, the type of the layout), normals and colors, binary little-endian.
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
    write_file(path, |out| {
        Writer::<Vertex>::new().write_header(out, &header(points))?;
        write_points(out, cloud)
    })
}

/// Writes the points without a header.
fn write_points(out: &mut impl Write, cloud: &PointCloud) -> io::Result<()> {
    let header = header(0);
    let definition = &header.elements["vertex"];
    let writer = Writer::<Vertex>::new();
    for ((position, normal), color) in cloud.positions.iter().zip(&cloud.normals).zip(&cloud.colors) {
        let [x, y, z] = position.map(|coordinate| coordinate as f32);
        let [nx, ny, nz] = *normal;
        let vertex = Vertex { floats: [x, y, z, nx, ny, nz], color: *color };
        writer.write_little_endian_element(out, &vertex, definition)?;
    }
    Ok(())
}

/// Writes a cloud and the views of its points, like [`write_ply`] and [`write_visibility`], while the points
/// are made: their number precedes them in the files, so they wait in temporary files beside these.
pub(crate) struct CloudWriter {
    path: PathBuf,
    points: BufWriter<NamedTempFile>,
    views: BufWriter<NamedTempFile>,
    count: usize,
    /// After the files in them: what is dropped first is removed first.
    _folders: NewFolders,
}

impl CloudWriter {
    /// A cloud without points yet, for this PLY file; `PATH.vis` gets the views.
    ///
    /// # Errors
    /// A folder in which no file can be made.
    pub(crate) fn new(path: &Path) -> Result<CloudWriter> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let folders = NewFolders::create(folder).map_err(|error| cannot_be_written(path, error))?;
        let temporary = || -> Result<BufWriter<NamedTempFile>> {
            let file = temporary_file(folder);
            Ok(BufWriter::new(file.map_err(|error| cannot_be_written(path, error))?))
        };
        let (points, views) = (temporary()?, temporary()?);
        Ok(CloudWriter { path: path.to_owned(), points, views, count: 0, _folders: folders })
    }

    /// Adds points.
    ///
    /// # Errors
    /// A full disk, for example.
    pub(crate) fn add(&mut self, cloud: &PointCloud) -> Result<()> {
        self.add_with(cloud, |view| view)
    }

    /// Adds points whose views are places in `numbers`, and writes what is there.
    ///
    /// # Errors
    /// A full disk, for example.
    pub(crate) fn add_renumbered(&mut self, cloud: &PointCloud, numbers: &[u32]) -> Result<()> {
        self.add_with(cloud, |view| numbers[view as usize])
    }

    fn add_with(&mut self, cloud: &PointCloud, number: impl Fn(u32) -> u32) -> Result<()> {
        self.count += cloud.positions.len();
        let written = write_points(&mut self.points, cloud);
        let written = written.and_then(|()| write_lists(&mut self.views, &cloud.views, number));
        written.map_err(|error| cannot_be_written(&self.path, error))
    }

    /// Writes both files and returns the number of points.
    ///
    /// # Errors
    /// A full disk, for example.
    pub(crate) fn finish(self) -> Result<usize> {
        let CloudWriter { path, points, views, count, _folders } = self;
        let rewound = |file: BufWriter<NamedTempFile>| -> io::Result<NamedTempFile> {
            let mut file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.rewind()?;
            Ok(file)
        };
        let both = rewound(points).and_then(|points| Ok((points, rewound(views)?)));
        let (mut points, mut views) = both.map_err(|error| cannot_be_written(&path, error))?;
        write_file(&path, |out| {
            Writer::<Vertex>::new().write_header(out, &header(count))?;
            io::copy(&mut points, out).map(drop)
        })?;
        write_file(&visibility_path(&path), |out| {
            out.write_all(&(count as u64).to_le_bytes())?;
            io::copy(&mut views, out).map(drop)
        })?;
        Ok(count)
    }
}

/// The file with the views of the points of a cloud.
pub(crate) fn visibility_path(cloud: &Path) -> PathBuf {
    let mut path = cloud.as_os_str().to_owned();
    path.push(".vis");
    path.into()
}

/// Reads the clouds that [`write_ply`] and COLMAP write. The lists of views are empty: they are in another
/// file, which [`read_visibility`] reads.
///
/// # Errors
/// Not a PLY file of these properties; fewer or more points than in the header.
pub fn read_ply(path: &Path) -> Result<PointCloud> {
    let file = File::open(path).map_err(|error| cannot_be_read(path, error))?;
    let mut reader = Reader::new(BufReader::new(file));
    let parser = Parser::<Vertex>::new();
    let found = parser.read_header(&mut reader).map_err(|error| Error::file(path, error))?;
    let count = found.elements.get("vertex").map_or(0, |vertex| vertex.count);
    let expected = header(count);
    if found.encoding != expected.encoding || found.elements != expected.elements {
        let properties = format!("vertex of float {} and uchar {}", FLOATS.join(" "), BYTES.join(" "));
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
    for Vertex { floats: [x, y, z, nx, ny, nz], color } in vertices {
        cloud.positions.push([x.into(), y.into(), z.into()]);
        cloud.normals.push([nx, ny, nz]);
        cloud.colors.push(color);
    }
    Ok(cloud)
}

/// Writes the views of each point (`fused.ply.vis`): a u64 count, then for each point a u32 count and the
/// views as u32 indices into the images in the order of the model's file.
pub fn write_visibility(path: &Path, views: &PointViews) -> Result<()> {
    write_file(path, |out| {
        out.write_all(&(views.len() as u64).to_le_bytes())?;
        write_lists(out, views, |view| view)
    })
}

/// Writes the lists of views without their number; `number` gives the number of a view in the file.
fn write_lists(out: &mut impl Write, views: &PointViews, number: impl Fn(u32) -> u32) -> io::Result<()> {
    for point in 0..views.len() {
        let views = views.get(point);
        out.write_all(&(views.len() as u32).to_le_bytes())?;
        for view in views {
            out.write_all(&number(*view).to_le_bytes())?;
        }
    }
    Ok(())
}

/// Reads the views of each point from a file in the layout of [`write_visibility`].
pub fn read_visibility(path: &Path) -> Result<PointViews> {
    let mut file = FileReader::open(path)?;
    let points = file.u64("the number of points")?;
    file.require(points, 4, "points")?;
    let mut all = PointViews::default();
    let mut views = Vec::new();
    for _ in 0..points {
        let count = file.u32("a point's number of views")?;
        file.require(count.into(), 4, "a point's views")?;
        views.clear();
        for _ in 0..count {
            views.push(file.u32("a point's views")?);
        }
        all.push(&views);
    }
    file.finish()?;
    Ok(all)
}
