//! `cameras.txt`, `images.txt` and `points3D.txt`.

use super::ColmapModel;
use super::camera_models::CameraModel;
use super::records::{CameraRecord, Files, ImageRecord, Layout, Place, PointRecord, Records};
use crate::error::{Error, Result};
use crate::io::files::{cannot_be_read, write_file};
use std::io::Write;
use std::path::Path;
use std::str::FromStr;

pub(super) fn read(files: &Files) -> Result<Records> {
    Ok(Records {
        cameras: read_cameras(&files.cameras)?,
        images: read_images(&files.images)?,
        points: if files.points.is_file() { read_points(&files.points)? } else { Vec::new() },
    })
}

fn read_cameras(path: &Path) -> Result<Vec<CameraRecord>> {
    let text = read_text(path)?;
    data_lines(path, &text).map(camera).collect()
}

fn camera(mut fields: Fields) -> Result<CameraRecord> {
    let id = fields.whole("the camera's id")?;
    let model = fields.word("the camera's model")?;
    let model = CameraModel::by_name(model, id, &fields.place)?;
    let (width, height) = (fields.whole("the width")?, fields.whole("the height")?);
    let mut parameters = Vec::new();
    for _ in 0..model.parameters {
        parameters.extend(fields.numbers::<1>("the camera's parameters")?);
    }
    fields.finish()?;
    Ok(CameraRecord { line: fields.place.line, id, width, height, model, parameters })
}

fn read_images(path: &Path) -> Result<Vec<ImageRecord>> {
    let text = read_text(path)?;
    let mut lines = text.lines().enumerate();
    let mut images = Vec::new();
    while let Some((index, line)) = lines.next() {
        if is_data(line) {
            images.push(image(Fields::new(path, index, line))?);
            // The features follow on a line of their own, which is empty when there are none.
            if let Some((index, line)) = lines.next() {
                check_features(Fields::new(path, index, line))?;
            }
        }
    }
    Ok(images)
}

fn image(mut fields: Fields) -> Result<ImageRecord> {
    Ok(ImageRecord {
        line: fields.place.line,
        id: fields.whole("the image's id")?,
        quaternion: fields.numbers("the quaternion w x y z")?,
        translation: fields.numbers("the translation x y z")?,
        camera: fields.whole("the camera's id")?,
        // Names may contain spaces.
        name: fields.rest.trim().to_owned(),
    })
}

/// Features are not kept, but checked: a line with other contents means that lines are missing.
fn check_features(mut fields: Fields) -> Result<()> {
    while !fields.is_empty() {
        for what in ["a feature's x", "a feature's y", "a feature's point id"] {
            fields.parse::<f64>(what, "features as x y point-id on the line after the image")?;
        }
    }
    Ok(())
}

fn read_points(path: &Path) -> Result<Vec<PointRecord>> {
    let text = read_text(path)?;
    data_lines(path, &text).map(point).collect()
}

fn point(mut fields: Fields) -> Result<PointRecord> {
    let id = fields.parse("the point's id", "a whole number")?;
    let position = fields.numbers("the position x y z")?;
    for what in ["red", "green", "blue", "the error"] {
        fields.parse::<f64>(what, "a number")?;
    }
    let mut track = Vec::new();
    while !fields.is_empty() {
        track.push(fields.whole("an image's id in the track")?);
        fields.whole::<u32>("a feature's index in the track")?;
    }
    Ok(PointRecord { line: fields.place.line, id, position, track })
}

/// Reads a file in UTF-8, with or without the mark that editors on Windows put at its beginning.
fn read_text(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).map_err(|error| cannot_be_read(path, error))?;
    let line_of = |place: usize| bytes[..place].iter().filter(|&&byte| byte == b'\n').count() + 1;
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(Error::line(path, 1, "the text is UTF-16; save it as UTF-8"));
    }
    if let Some(place) = bytes.iter().position(|&byte| byte == 0) {
        let problem = "a byte 0: the text is UTF-16 or damaged; save it as UTF-8";
        return Err(Error::line(path, line_of(place), problem));
    }
    let text = bytes.strip_prefix(&BYTE_ORDER_MARK).unwrap_or(&bytes);
    match std::str::from_utf8(text) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => {
            let place = bytes.len() - text.len() + error.valid_up_to();
            let problem = format!(
                "the byte {:#04x} is not UTF-8: the text may be Latin-1 or another encoding; save it as UTF-8",
                bytes[place]
            );
            Err(Error::line(path, line_of(place), problem))
        }
    }
}

const BYTE_ORDER_MARK: [u8; 3] = [0xef, 0xbb, 0xbf];

/// Whether a line is neither empty nor a comment.
fn is_data(line: &str) -> bool {
    let line = line.trim();
    !line.is_empty() && !line.starts_with('#')
}

fn data_lines<'a>(path: &'a Path, text: &'a str) -> impl Iterator<Item = Fields<'a>> {
    let lines = text.lines().enumerate().filter(|(_, line)| is_data(line));
    lines.map(|(index, line)| Fields::new(path, index, line))
}

/// The fields of a line that are not read yet.
struct Fields<'a> {
    place: Place<'a>,
    rest: &'a str,
}

impl<'a> Fields<'a> {
    fn new(path: &'a Path, index: usize, line: &'a str) -> Fields<'a> {
        Fields { place: Place { path, line: Some(index + 1) }, rest: line }
    }

    fn is_empty(&self) -> bool {
        self.rest.trim().is_empty()
    }

    fn word(&mut self, what: &str) -> Result<&'a str> {
        let rest = self.rest.trim_start();
        if rest.is_empty() {
            return Err(self.place.error(format!("the line ends before {what}")));
        }
        let (word, rest) = rest.split_at(rest.find(char::is_whitespace).unwrap_or(rest.len()));
        self.rest = rest;
        Ok(word)
    }

    fn parse<T: FromStr>(&mut self, what: &str, expected: &str) -> Result<T> {
        let word = self.word(what)?;
        word.parse().map_err(|_| self.place.error(format!("{what} is {word}; expected {expected}")))
    }

    fn whole<T: FromStr>(&mut self, what: &str) -> Result<T> {
        self.parse(what, "a whole number, not negative")
    }

    fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N]> {
        let mut values = [0.0f64; N];
        for value in &mut values {
            *value = self.parse(what, "finite numbers")?;
        }
        if values.iter().all(|value| value.is_finite()) {
            return Ok(values);
        }
        Err(self.place.error(format!("{what} is {values:?}; expected finite numbers")))
    }

    fn finish(&self) -> Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        Err(self.place.error(format!("{:?} follows the last field", self.rest.trim())))
    }
}

pub(super) fn write(model: &ColmapModel, folder: &Path) -> Result<()> {
    let files = Files::of(folder, false);
    let layout = Layout::of(model);
    write_file(&files.cameras, |out| {
        writeln!(out, "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]")?;
        for (index, ([fx, fy, cx, cy], [width, height])) in
            layout.cameras.iter().zip(&layout.sizes).enumerate()
        {
            writeln!(out, "{} PINHOLE {width} {height} {fx} {fy} {cx} {cy}", index + 1)?;
        }
        Ok(())
    })?;
    write_file(&files.images, |out| {
        writeln!(out, "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME")?;
        writeln!(out, "# POINTS2D[] as (X, Y, POINT3D_ID)")?;
        for (image, features) in layout.images.iter().zip(&layout.features) {
            let ([w, x, y, z], [tx, ty, tz]) = (image.quaternion, image.translation);
            writeln!(out, "{} {w} {x} {y} {z} {tx} {ty} {tz} {} {}", image.id, image.camera, image.name)?;
            for (index, ([x, y], point)) in features.iter().enumerate() {
                let separator = if index == 0 { "" } else { " " };
                write!(out, "{separator}{x} {y} {point}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    })?;
    write_file(&files.points, |out| {
        writeln!(out, "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)")?;
        for (index, (point, track)) in model.points.iter().zip(&layout.tracks).enumerate() {
            let [x, y, z] = point.position.to_array();
            write!(out, "{} {x} {y} {z} 128 128 128 0", index + 1)?;
            for [image, feature] in track {
                write!(out, " {image} {feature}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    })
}
