//! Fused clouds as LAS 1.4 and LAZ: point format 2 (position and color) with the normals as extra dimensions.

use super::extent::Extent;
use crate::error::{Error, Result};
use crate::fusion::{CloudSource, PointCloud};
use crate::io::files::{cannot_be_written, write_file};
use glam::DVec3;
use las::point::Format;
use las::{Builder, Color, Point, Transform, Vector, Vlr, Writer};
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// The point format: position, color, and no time.
const POINT_FORMAT: u8 = 2;
/// The record that describes the extra dimensions, of the user `LASF_Spec`.
const EXTRA_BYTES_RECORD: u16 = 4;
/// Bytes of the description of one dimension.
const DESCRIPTOR_BYTES: usize = 192;
/// The number of the type of 32-bit floats.
const FLOAT_TYPE: u8 = 9;
/// Names of the extra dimensions.
const NORMAL: [&str; 3] = ["NormalX", "NormalY", "NormalZ"];
/// Steps of the stored integers in the distance of neighboring points, at least.
const STEPS: f64 = 8.0;
/// The largest integer that coordinates take; a little less than what fits.
const LARGEST: f64 = 2_147_000_000.0;
/// Step of the coordinates of a cloud of one point.
const DEFAULT_SCALE: f64 = 1e-3;

/// Writes a cloud.
///
/// # Errors
/// Positions that are not finite; a full disk, for example.
pub(super) fn write(path: &Path, cloud: &dyn CloudSource, is_compressed: bool) -> Result<()> {
    let header = header(path, &Extent::of(cloud)?, is_compressed)?;
    let failed = |error: las::Error| cannot_be_written(path, error);
    let mut failure = None;
    let written = write_file(path, |out| {
        let (sink, first_error) = Sink::new(out.get_ref().try_clone()?);
        let write = || -> Result<()> {
            let mut writer = Writer::new(sink, header).map_err(failed)?;
            cloud.each_part(&mut |points| write_part(&mut writer, points).map_err(failed))?;
            writer.close().map_err(failed)?;
            writer.into_inner().map_err(failed)?.flush().map_err(|error| cannot_be_written(path, error))
        };
        let result = write();
        let first_error = first_error.lock().unwrap_or_else(PoisonError::into_inner).take();
        first_error.map_or(Ok(()), Err)?;
        result.map_err(|error| io::Error::other(failure.insert(error).to_string()))
    });
    failure.map_or(written, Err)
}

fn write_part(writer: &mut Writer<Sink>, points: &PointCloud) -> las::Result<()> {
    for ((&[x, y, z], normal), color) in points.positions.iter().zip(&points.normals).zip(&points.colors) {
        // 255 becomes 65535.
        let [red, green, blue] = color.map(|channel| u16::from(channel) * 257);
        writer.write_point(Point {
            x,
            y,
            z,
            return_number: 1,
            number_of_returns: 1,
            color: Some(Color::new(red, green, blue)),
            extra_bytes: normal.iter().flat_map(|component| component.to_le_bytes()).collect(),
            ..Point::default()
        })?;
    }
    Ok(())
}

fn header(path: &Path, extent: &Extent, is_compressed: bool) -> Result<las::Header> {
    let failed = |error: las::Error| cannot_be_written(path, error);
    let mut format = Format::new(POINT_FORMAT).map_err(failed)?;
    format.is_compressed = is_compressed;
    format.extra_bytes = 4 * NORMAL.len() as u16;
    let mut builder = Builder::from((1, 4));
    // The same cloud gives the same bytes on any day.
    builder.date = None;
    builder.system_identifier = "skep".to_owned();
    builder.generating_software = concat!("skep ", env!("CARGO_PKG_VERSION")).to_owned();
    builder.point_format = format;
    let axis = |min, max| transform(min, max, extent.spacing());
    let (min, max) = if extent.min.cmple(extent.max).all() {
        (extent.min, extent.max)
    } else {
        (DVec3::ZERO, DVec3::ZERO)
    };
    if !(min.is_finite() && max.is_finite()) {
        return Err(Error::argument("cloud.positions", "not finite", "finite coordinates"));
    }
    builder.transforms = Vector { x: axis(min.x, max.x), y: axis(min.y, max.y), z: axis(min.z, max.z) };
    builder.vlrs.push(Vlr {
        user_id: "LASF_Spec".to_owned(),
        record_id: EXTRA_BYTES_RECORD,
        description: "normals".to_owned(),
        data: NORMAL.iter().flat_map(|name| descriptor(name)).collect(),
    });
    builder.into_header().map_err(failed)
}

/// The description of a dimension of floats.
fn descriptor(name: &str) -> [u8; DESCRIPTOR_BYTES] {
    let mut bytes = [0; DESCRIPTOR_BYTES];
    bytes[2] = FLOAT_TYPE;
    bytes[4..4 + name.len()].copy_from_slice(name.as_bytes());
    bytes
}

/// Offset and scale of an axis: round numbers, of a resolution that the spacing asks for and the range
/// allows.
fn transform(min: f64, max: f64, spacing: f64) -> Transform {
    let round_to = |value: f64, step: f64| (value / step).round() * step;
    let size = max - min;
    let offset = match size > 0.0 {
        true => round_to((min + max) / 2.0, power_of_ten(size.log10().floor() - 1.0)),
        false => round_to(min, 1.0),
    };
    let wanted = if spacing > 0.0 { power_of_ten((spacing / STEPS).log10().floor()) } else { DEFAULT_SCALE };
    let reach = (max - offset).max(offset - min);
    let least = if reach > 0.0 { power_of_ten((reach / LARGEST).log10().ceil()) } else { 0.0 };
    Transform { scale: wanted.max(least), offset }
}

fn power_of_ten(exponent: f64) -> f64 {
    // The decimal literal is rounded correctly; a power would not be on every machine.
    format!("1e{}", exponent as i32).parse().unwrap_or(1.0)
}

/// A file that keeps its first error to itself: the writer of the crate panics when it is dropped after one.
struct Sink {
    file: BufWriter<File>,
    /// Where the file is, and would be without the error: the crate computes with places in the file.
    place: u64,
    length: u64,
    first_error: Arc<Mutex<Option<io::Error>>>,
}

impl Sink {
    fn new(file: File) -> (Sink, Arc<Mutex<Option<io::Error>>>) {
        let first_error = Arc::new(Mutex::new(None));
        let sink = Sink { file: BufWriter::new(file), place: 0, length: 0, first_error: first_error.clone() };
        (sink, first_error)
    }

    /// Does something to the file, unless something failed before.
    fn attempt(&mut self, operation: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) {
        let mut first_error = self.first_error.lock().unwrap_or_else(PoisonError::into_inner);
        if first_error.is_none() {
            *first_error = operation(&mut self.file).err();
        }
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.attempt(|file| file.write_all(bytes));
        self.place += bytes.len() as u64;
        self.length = self.length.max(self.place);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt(|file| file.flush());
        Ok(())
    }
}

impl Seek for Sink {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = match to {
            SeekFrom::Start(place) => Some(place),
            SeekFrom::Current(offset) => self.place.checked_add_signed(offset),
            SeekFrom::End(offset) => self.length.checked_add_signed(offset),
        };
        self.place = place.ok_or(io::ErrorKind::InvalidInput)?;
        // Asking for the place must not flush the buffer.
        if to != SeekFrom::Current(0) {
            let place = self.place;
            self.attempt(|file| file.seek(SeekFrom::Start(place)).map(drop));
        }
        Ok(self.place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_and_offset_fit_the_points_and_are_round_numbers() {
        let utm = transform(5_412_300.25, 5_412_900.75, 0.004);
        assert_eq!((utm.scale, utm.offset), (1e-4, 5_412_600.0));
        // A point far away takes resolution from the others: the integers have 32 bits.
        let far = transform(0.0, 1e7, 0.004);
        assert_eq!((far.scale, far.offset), (1e-2, 5e6));
        assert_eq!(transform(2.0, 2.0, 0.0), Transform { scale: 1e-3, offset: 2.0 });
        let tiny = transform(3.000_000_1, 3.000_000_2, 1e-10);
        assert!(tiny.scale <= 1e-10 && (tiny.offset - 3.000_000_15).abs() < 1e-7, "{tiny:?}");
    }

    #[test]
    fn a_full_disk_is_an_error_and_no_panic() {
        if !Path::new("/dev/full").exists() {
            return;
        }
        let cloud = PointCloud {
            positions: (0..100_000).map(|x| [f64::from(x), 0.0, 0.0]).collect(),
            normals: vec![[0.0, 0.0, 1.0]; 100_000],
            colors: vec![[1, 2, 3]; 100_000],
            ..PointCloud::default()
        };
        for is_compressed in [false, true] {
            let full = File::options().write(true).open("/dev/full").unwrap();
            let (sink, first_error) = Sink::new(full);
            let header = header(Path::new("c.las"), &Extent::of(&cloud).unwrap(), is_compressed).unwrap();
            let mut writer = Writer::new(sink, header).unwrap();
            write_part(&mut writer, &cloud).unwrap();
            drop(writer);
            assert!(first_error.lock().unwrap().is_some());
        }
    }
}
