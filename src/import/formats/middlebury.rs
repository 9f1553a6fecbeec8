//! Middlebury multi-view: a file `*_par.txt` of a line for each photograph, with the photographs beside it.
//!
//! A line is the name, the calibration matrix, the rotation and the translation from the world to the camera,
//! matrices row by row. Pixel centers are taken to be integers. There are no points.

use super::calibration::{CALIBRATION, pinhole};
use super::photographs;
use super::poses::{ROTATION, from_rows, rotation};
use super::text::{self, Words};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Lens};
use crate::import::{SourcePhotograph, SourceScene};
use crate::io::picture_size;
use glam::DVec3;
use std::path::{Path, PathBuf};

const ENDING: &str = "_par.txt";

pub(super) fn is_at(path: &Path) -> bool {
    is_parameters(path) || !parameters(path).is_empty()
}

fn is_parameters(path: &Path) -> bool {
    path.is_file() && path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING))
}

/// The files of parameters in a folder.
fn parameters(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| is_parameters(path)).collect();
    files.sort();
    files
}

/// Reads the file.
///
/// # Errors
/// Several such files; lines that are not of this form; missing photographs.
pub(super) fn read(path: &Path) -> Result<SourceScene> {
    let files = if path.is_file() { vec![path.to_owned()] } else { parameters(path) };
    let [file] = &files[..] else {
        let names = files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ");
        return Err(Error::file(
            path,
            format!("has several files of cameras, {names}; expected one of them"),
        ));
    };
    let folder = file.parent().unwrap_or(Path::new(""));
    let content = text::read(file)?;
    let mut words = Words::new(file, &content);
    let count = words.count("the number of photographs")?;
    let (mut paths, mut lenses) = (Vec::new(), Vec::new());
    for index in 0..count {
        let name = words.word(&format!("the name of photograph {index} of {count}"))?;
        let photograph = photographs::find(folder.join(name), &file.display().to_string())?;
        lenses.push(lens(&mut words, name, picture_size(&photograph)?)?);
        paths.push(photograph);
    }
    if words.remaining() > 0 {
        let word = words.word("nothing")?;
        return Err(
            words.error(format!("{word:?} follows {count} photographs; expected the end of the file"))
        );
    }
    let photograph = |((name, path), lens)| SourcePhotograph::new(name, path, lens);
    let names = photographs::names(&paths)?;
    Ok(SourceScene {
        origin: format!("the cameras in {}", file.display()),
        photographs: names.into_iter().zip(paths).zip(lenses).map(photograph).collect(),
        points: Vec::new(),
        workspace: None,
        warnings: Vec::new(),
    })
}

fn lens(words: &mut Words, name: &str, (width, height): (u32, u32)) -> Result<Lens> {
    let k: [f64; 9] = words.numbers(&format!("the calibration of {name}"))?;
    let [fx, fy, cx, cy] = pinhole(k, 1.0)
        .ok_or_else(|| words.error(format!("the calibration of {name} is {k:?}; expected {CALIBRATION}")))?;
    let r: [f64; 9] = words.numbers(&format!("the rotation of {name}"))?;
    let matrix = from_rows([[r[0], r[1], r[2]], [r[3], r[4], r[5]], [r[6], r[7], r[8]]]);
    let rotation = rotation(matrix)
        .ok_or_else(|| words.error(format!("the rotation of {name} is {r:?}; expected {ROTATION}")))?;
    let translation = DVec3::from(words.numbers::<3>(&format!("the translation of {name}"))?);
    let camera = Camera { width, height, fx, fy, cx, cy, rotation, translation };
    let lens = Lens { camera, distortion: None };
    lens.check(name).map_err(|error| words.error(error))?;
    Ok(lens)
}
