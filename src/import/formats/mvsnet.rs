//! MVSNet and its successors: `cams/00000000_cam.txt` and so on, `pair.txt`, and the photographs.
//!
//! | what | where |
//! |---|---|
//! | cameras | `cams/`, `cams_1/` |
//! | photographs | `images/`, `blended_images/`: `00000000.jpg` or `.png` |
//! | sources | `pair.txt`, beside the cameras' folder or in it |
//!
//! The folder of a scan in the training set of DTU (`Rectified/scan1_train`) is known too: its photographs
//! are `rect_001_3_r5000.png` and so on, of which lighting 3 is read, and its cameras are in
//! `Cameras/train/` beside `Rectified/`.

use super::calibration::{CALIBRATION, pinhole};
use super::photographs;
use super::poses::{ROTATION, from_rows, rotation};
use super::text::{self, Words};
use crate::error::{Error, Result};
use crate::geometry::{Camera, DepthRange, Lens};
use crate::import::{SourcePhotograph, SourceScene};
use crate::io::picture_size;
use glam::DVec3;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

const CAMERA_ENDING: &str = "_cam.txt";
const CAMERA_FOLDERS: [&str; 2] = ["cams", "cams_1"];
const IMAGE_FOLDERS: [&str; 2] = ["images", "blended_images"];
/// Planes of MVSNet between the depths of a file that gives neither their number nor the largest depth: 192,
/// 1.06 intervals apart.
const DEFAULT_INTERVALS: f64 = 192.0 * 1.06;
/// MVSNet's features have a quarter of the image's sides, and some files hold the calibration for these.
const REDUCTION: f64 = 4.0;
/// Where principal points lie, as shares of a side.
const CENTRAL: std::ops::Range<f64> = 0.25..0.75;

/// The files of a scene.
struct Layout {
    /// The folder of the cameras.
    cameras: PathBuf,
    /// The folder of the photographs.
    images: PathBuf,
    is_dtu_training: bool,
}

pub(super) fn is_at(path: &Path) -> bool {
    layout(path).is_some()
}

fn layout(path: &Path) -> Option<Layout> {
    let has_cameras = |folder: &PathBuf| has_file(folder, |name| id_of(name, CAMERA_ENDING).is_some());
    let named = CAMERA_FOLDERS.map(|name| path.join(name)).into_iter().find(has_cameras);
    if let Some(cameras) = named {
        let images = IMAGE_FOLDERS.map(|name| path.join(name));
        let images = images.iter().find(|folder| folder.is_dir()).unwrap_or(&images[0]).clone();
        return Some(Layout { cameras, images, is_dtu_training: false });
    }
    if !has_file(path, |name| name.starts_with("rect_")) {
        return None;
    }
    let absolute = std::path::absolute(path).ok()?;
    let cameras = absolute.parent()?.parent()?.join("Cameras").join("train");
    let images = path.to_owned();
    Some(cameras).filter(has_cameras).map(|cameras| Layout { cameras, images, is_dtu_training: true })
}

fn has_file(folder: &Path, is_wanted: impl Fn(&str) -> bool) -> bool {
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.any(|entry| is_wanted(&entry.file_name().to_string_lossy()))
}

/// The number of a name of digits and an ending.
fn id_of(name: &str, ending: &str) -> Option<u64> {
    let digits = name.strip_suffix(ending)?;
    let is_number = digits.bytes().all(|byte| byte.is_ascii_digit());
    if is_number { digits.parse().ok() } else { None }
}

/// The content of a file of a camera.
struct CameraFile {
    path: PathBuf,
    photograph: PathBuf,
    camera: Camera,
    range: DepthRange,
    has_largest_depth: bool,
}

/// Reads the scene.
///
/// # Errors
/// Files that are not of this form; a camera without its photograph; pairs of cameras that there are not.
pub(super) fn read(path: &Path) -> Result<SourceScene> {
    let layout = layout(path).ok_or_else(|| Error::file(path, "has no cameras; expected cams/*_cam.txt"))?;
    let mut warnings = Vec::new();
    let (ids, mut files) = read_cameras(&layout, &mut warnings)?;
    enlarge(&mut files, &mut warnings);
    let guessed = files.iter().filter(|file| !file.has_largest_depth).count();
    if guessed > 0 {
        warnings.push(format!(
            "{guessed} camera files give no largest depth: it is taken to be {DEFAULT_INTERVALS} intervals \
             beyond the smallest"
        ));
    }
    let indices: HashMap<u64, u32> = ids.iter().enumerate().map(|(i, &id)| (id, i as u32)).collect();
    let mut sources = read_pairs(&layout, &indices)?;
    let paths: Vec<PathBuf> = files.iter().map(|file| file.photograph.clone()).collect();
    let names = photographs::names(&paths)?;
    let photograph = |((name, file), index): ((String, CameraFile), u32)| {
        file.camera.check("its camera").map_err(|error| Error::file(&file.path, error))?;
        let lens = Lens { camera: file.camera, distortion: None };
        Ok(SourcePhotograph {
            depth_range: Some(file.range),
            sources: sources.remove(&index),
            ..SourcePhotograph::new(name, file.photograph, lens)
        })
    };
    Ok(SourceScene {
        origin: format!("the cameras in {}", layout.cameras.display()),
        photographs: names.into_iter().zip(files).zip(0..).map(photograph).collect::<Result<_>>()?,
        points: Vec::new(),
        workspace: None,
        warnings,
    })
}

/// The cameras in the order of their numbers, which come first.
fn read_cameras(layout: &Layout, warnings: &mut Vec<String>) -> Result<(Vec<u64>, Vec<CameraFile>)> {
    let entries = std::fs::read_dir(&layout.cameras).into_iter().flatten().flatten();
    let mut found: Vec<(u64, PathBuf)> = entries
        .filter_map(|entry| Some((id_of(&entry.file_name().to_string_lossy(), CAMERA_ENDING)?, entry.path())))
        .collect();
    found.sort();
    let (mut ids, mut files): (Vec<u64>, Vec<CameraFile>) = (Vec::new(), Vec::new());
    let mut without = 0;
    for (id, path) in found {
        if ids.last() == Some(&id) {
            return Err(Error::file(&path, format!("is another camera of number {id}; expected one each")));
        }
        let photograph = if layout.is_dtu_training {
            let photograph = layout.images.join(format!("rect_{:03}_3_r5000.png", id + 1));
            // The rig has more places than a scan has photographs.
            if !photograph.is_file() {
                without += 1;
                continue;
            }
            photograph
        } else {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let stem = name.strip_suffix(CAMERA_ENDING).unwrap_or(&name);
            photographs::find_with_ending(layout.images.join(stem), &path.display().to_string())?
        };
        files.push(read_camera(path, photograph)?);
        ids.push(id);
    }
    if layout.is_dtu_training {
        warnings.push("of the photographs those of lighting 3 are read".to_owned());
    }
    if without > 0 {
        warnings.push(format!("{without} cameras have no photograph in this scan and are left out"));
    }
    Ok((ids, files))
}

fn read_camera(path: PathBuf, photograph: PathBuf) -> Result<CameraFile> {
    let content = text::read(&path)?;
    let mut words = Words::new(&path, &content);
    words.keyword("extrinsic")?;
    let e: [f64; 16] = words.numbers("the extrinsic matrix")?;
    let matrix = from_rows([[e[0], e[1], e[2]], [e[4], e[5], e[6]], [e[8], e[9], e[10]]]);
    let rotation = rotation(matrix).filter(|_| e[12..] == [0.0, 0.0, 0.0, 1.0]).ok_or_else(|| {
        let expected = format!("{ROTATION} and a translation over a row 0 0 0 1");
        words.error(format!("the extrinsic matrix is {e:?}; expected {expected}"))
    })?;
    let translation = DVec3::new(e[3], e[7], e[11]);
    words.keyword("intrinsic")?;
    let k: [f64; 9] = words.numbers("the intrinsic matrix")?;
    let [fx, fy, cx, cy] = pinhole(k, 1.0)
        .ok_or_else(|| words.error(format!("the intrinsic matrix is {k:?}; expected {CALIBRATION}")))?;
    let [near, interval] = words.numbers("the smallest depth and the interval")?;
    let (far, has_largest_depth) = match words.remaining() {
        0 => (near + DEFAULT_INTERVALS * interval, false),
        1 => (near + (words.number("the number of depths")? - 1.0) * interval, true),
        2 => {
            words.number("the number of depths")?;
            (words.number("the largest depth")?, true)
        }
        more => {
            let problem = format!("{} numbers of depths; expected 2 to 4: MIN INTERVAL NUMBER MAX", more + 2);
            return Err(words.error(problem));
        }
    };
    let range = DepthRange { near, far };
    range.check("the depths").map_err(|error| words.error(error))?;
    let (width, height) = picture_size(&photograph)?;
    let camera = Camera { width, height, fx, fy, cx, cy, rotation, translation };
    Ok(CameraFile { path, photograph, camera, range, has_largest_depth })
}

/// Multiplies the calibrations by 4 where all principal points say that they are those of images of a quarter
/// of the sides.
fn enlarge(files: &mut [CameraFile], warnings: &mut Vec<String>) {
    let is_central = |camera: &Camera, factor: f64| {
        let x = factor * camera.cx / f64::from(camera.width);
        let y = factor * camera.cy / f64::from(camera.height);
        CENTRAL.contains(&x) && CENTRAL.contains(&y)
    };
    if files.iter().all(|file| is_central(&file.camera, REDUCTION)) {
        for CameraFile { camera, .. } in files {
            for value in [&mut camera.fx, &mut camera.fy, &mut camera.cx, &mut camera.cy] {
                *value *= REDUCTION;
            }
        }
        warnings.push(format!(
            "the principal points are those of images of a quarter of the sides: the calibrations are \
             multiplied by {REDUCTION}"
        ));
    } else if let Some(file) = files.iter().find(|file| !is_central(&file.camera, 1.0)) {
        let Camera { cx, cy, width, height, .. } = file.camera;
        warnings.push(format!(
            "{}: the principal point {cx}, {cy} is far from the middle of the photograph, {width}x{height}; \
             is the calibration that of another size?",
            file.path.display()
        ));
    }
}

/// The sources of each camera that has any, the best first. No file of pairs gives none.
fn read_pairs(layout: &Layout, indices: &HashMap<u64, u32>) -> Result<HashMap<u32, Vec<u32>>> {
    let beside = layout.cameras.parent().unwrap_or(Path::new("")).join("pair.txt");
    let places = [beside, layout.cameras.join("pair.txt")];
    let mut sources = HashMap::new();
    let Some(path) = places.iter().find(|place| place.is_file()) else { return Ok(sources) };
    let content = text::read(path)?;
    let mut words = Words::new(path, &content);
    let count = words.count("the number of photographs")?;
    for _ in 0..count {
        let id = words.count("the number of a photograph")?;
        let view = indices.get(&(id as u64)).copied();
        let mut own = Vec::new();
        for _ in 0..words.count("the number of sources")? {
            let source = words.count("the number of a source")?;
            words.number("the score of a source")?;
            let source = (source as u64, indices.get(&(source as u64)).copied());
            match source {
                // The pairs of DTU's training set are those of all scans.
                (_, None) if layout.is_dtu_training => {}
                (id, None) => {
                    return Err(words.error(format!("the source is {id}; expected the number of a camera")));
                }
                (_, Some(source)) if Some(source) == view => {
                    return Err(words.error(format!("photograph {id} is a source of itself")));
                }
                (_, Some(source)) => own.push(source),
            }
        }
        match view {
            None if layout.is_dtu_training => {}
            None => {
                return Err(words.error(format!("the photograph is {id}; expected the number of a camera")));
            }
            Some(_) if own.is_empty() => {}
            Some(view) => {
                if sources.insert(view, own).is_some() {
                    return Err(words.error(format!("photograph {id} occurs twice; expected once")));
                }
            }
        }
    }
    Ok(sources)
}
