//! `cameras.bin`, `images.bin` and `points3D.bin`; all numbers are little-endian.

use super::ColmapModel;
use super::camera_models::{CameraModel, PINHOLE_NUMBER};
use super::records::{CameraRecord, Files, ImageRecord, Layout, Place, PointRecord, Records};
use crate::error::Result;
use crate::io::files::{FileReader, write_file};
use std::io::{self, Write};
use std::path::Path;

/// Bytes of one feature: x, y, point id.
const FEATURE_BYTES: u64 = 24;
/// Bytes of one entry of a track: image id, feature index.
const TRACK_BYTES: u64 = 8;

pub(super) fn read(files: &Files) -> Result<Records> {
    Ok(Records {
        cameras: read_records(&files.cameras, camera)?,
        images: read_records(&files.images, image)?,
        points: if files.points.is_file() { read_records(&files.points, point)? } else { Vec::new() },
    })
}

/// Reads a count and that many records.
fn read_records<T>(path: &Path, record: fn(&mut FileReader, &Path) -> Result<T>) -> Result<Vec<T>> {
    let mut file = FileReader::open(path)?;
    let count = file.u64("the number of entries")?;
    // Every record has at least one byte: a count beyond the file's size is detected before any record is
    // read.
    file.require(count, 1, "entries")?;
    let mut records = Vec::new();
    for _ in 0..count {
        records.push(record(&mut file, path)?);
    }
    file.finish()?;
    Ok(records)
}

fn camera(file: &mut FileReader, path: &Path) -> Result<CameraRecord> {
    let id = file.u32("a camera's id")?;
    let model = file.u32("a camera's model")?;
    let model = CameraModel::by_number(model, id, &Place { path, line: None })?;
    let (width, height) = (file.u64("a camera's width")?, file.u64("a camera's height")?);
    let mut parameters = Vec::new();
    for _ in 0..model.parameters {
        parameters.extend(file.f64s::<1>("a camera's parameters")?);
    }
    Ok(CameraRecord { line: None, id, width, height, model, parameters })
}

fn image(file: &mut FileReader, _: &Path) -> Result<ImageRecord> {
    let record = ImageRecord {
        line: None,
        id: file.u32("an image's id")?,
        quaternion: file.f64s("an image's quaternion")?,
        translation: file.f64s("an image's translation")?,
        camera: file.u32("an image's camera")?,
        name: name(file)?,
    };
    let features = file.u64("an image's number of features")?;
    file.skip(features, FEATURE_BYTES, "an image's features")?;
    Ok(record)
}

/// Reads a NUL-terminated name.
fn name(file: &mut FileReader) -> Result<String> {
    let mut bytes = Vec::new();
    loop {
        match file.bytes("an image's name")? {
            [0] => break,
            [byte] => bytes.push(byte),
        }
    }
    String::from_utf8(bytes).map_err(|error| file.error(format!("an image's name is not UTF-8: {error}")))
}

fn point(file: &mut FileReader, _: &Path) -> Result<PointRecord> {
    let id = file.u64("a point's id")?;
    let position = file.f64s("a point's position")?;
    file.bytes::<3>("a point's color")?;
    file.bytes::<8>("a point's error")?;
    let length = file.u64("a track's length")?;
    file.require(length, TRACK_BYTES, "a point's track")?;
    let mut track = Vec::with_capacity(length as usize);
    for _ in 0..length {
        track.push(file.u32("an image's id in a track")?);
        file.u32("a feature's index in a track")?;
    }
    Ok(PointRecord { line: None, id, position, track })
}

pub(super) fn write(model: &ColmapModel, folder: &Path) -> Result<()> {
    let files = Files::of(folder, true);
    let layout = Layout::of(model);
    write_file(&files.cameras, |out| {
        out.write_all(&(layout.cameras.len() as u64).to_le_bytes())?;
        for (index, (parameters, size)) in layout.cameras.iter().zip(&layout.sizes).enumerate() {
            out.write_all(&(index as u32 + 1).to_le_bytes())?;
            out.write_all(&PINHOLE_NUMBER.to_le_bytes())?;
            for side in size {
                out.write_all(&u64::from(*side).to_le_bytes())?;
            }
            write_numbers(out, parameters)?;
        }
        Ok(())
    })?;
    write_file(&files.images, |out| {
        out.write_all(&(layout.images.len() as u64).to_le_bytes())?;
        for (image, features) in layout.images.iter().zip(&layout.features) {
            out.write_all(&image.id.to_le_bytes())?;
            write_numbers(out, &image.quaternion)?;
            write_numbers(out, &image.translation)?;
            out.write_all(&image.camera.to_le_bytes())?;
            out.write_all(image.name.as_bytes())?;
            out.write_all(&[0])?;
            out.write_all(&(features.len() as u64).to_le_bytes())?;
            for (pixel, point) in features {
                write_numbers(out, pixel)?;
                out.write_all(&point.to_le_bytes())?;
            }
        }
        Ok(())
    })?;
    write_file(&files.points, |out| {
        out.write_all(&(model.points.len() as u64).to_le_bytes())?;
        for (index, (point, track)) in model.points.iter().zip(&layout.tracks).enumerate() {
            out.write_all(&(index as u64 + 1).to_le_bytes())?;
            write_numbers(out, &point.position.to_array())?;
            out.write_all(&[128; 3])?;
            write_numbers(out, &[0.0])?;
            out.write_all(&(track.len() as u64).to_le_bytes())?;
            for entry in track.as_flattened() {
                out.write_all(&entry.to_le_bytes())?;
            }
        }
        Ok(())
    })
}

fn write_numbers(out: &mut impl Write, numbers: &[f64]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}
