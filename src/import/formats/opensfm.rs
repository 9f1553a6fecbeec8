//! OpenSfM and OpenDroneMap: `reconstruction.json`, with `tracks.csv` beside it if it is there.
//!
//! Lengths of cameras are divided by the larger side of the image; the origin is the middle of the image.
//! Poses are world-to-camera. Shots are sorted by their names.

use super::json::{self, Entry};
use super::photographs;
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Lens};
use crate::import::{SourcePhotograph, SourceScene};
use crate::io::cannot_be_read;
use crate::scene::SparsePoint;
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

const NAME: &str = "reconstruction.json";

pub(super) fn is_at(path: &Path) -> bool {
    file(path).is_some()
}

/// A path that is a file of this name, has one, or is a project of OpenDroneMap.
fn file(path: &Path) -> Option<PathBuf> {
    let is_named = path.file_name().is_some_and(|name| {
        let name = name.to_string_lossy();
        name.starts_with("reconstruction") && name.ends_with(".json")
    });
    let named = is_named.then(|| path.to_owned());
    let places = [path.join(NAME), path.join("opensfm").join(NAME)];
    named.into_iter().chain(places).find(|place| place.is_file())
}

/// Reads the reconstruction, of several the one of the most shots. Photographs must be in `images/` beside
/// the file, or beside its folder.
///
/// # Errors
/// Entries that are missing or invalid; another projection; missing photographs.
pub(super) fn read(path: &Path) -> Result<SourceScene> {
    let file = file(path).unwrap_or_else(|| path.join(NAME));
    let folder = file.parent().unwrap_or(Path::new("")).to_owned();
    let value = json::read(&file)?;
    let mut warnings = Vec::new();
    let reconstruction = largest(&Entry::root(&file, &value), &mut warnings)?;

    let images = find_images(&folder)?;
    let cameras: HashMap<&str, Entry> = reconstruction.require("cameras")?.fields()?.collect();
    let mut lenses = HashMap::new();
    let mut indices = HashMap::new();
    let mut found = Vec::new();
    let mut paths = Vec::new();
    for (name, shot) in reconstruction.require("shots")?.fields()? {
        let entry = shot.require("camera")?;
        let id = entry.text()?;
        let camera = cameras.get(id).ok_or_else(|| entry.error("the name of one of the cameras"))?;
        if !lenses.contains_key(id) {
            lenses.insert(id, lens_without_pose(camera)?);
        }
        let Lens { camera, distortion } = lenses[id];
        let path = find_photograph(&images, name, shot.name())?;
        photographs::check_size(&path, &camera, &format!("{} of {}", shot.name(), file.display()))?;
        let axis = DVec3::from(shot.require("rotation")?.numbers::<3>()?);
        let rotation = match axis.length() {
            0.0 => DMat3::IDENTITY,
            angle => DMat3::from_axis_angle(axis / angle, angle),
        };
        let translation = DVec3::from(shot.require("translation")?.numbers::<3>()?);
        indices.insert(name, found.len() as u32);
        found.push(Lens { camera: Camera { rotation, translation, ..camera }, distortion });
        paths.push(path);
    }
    let points = read_points(&reconstruction, &folder, &indices)?;
    let photograph = |((name, path), lens)| SourcePhotograph::new(name, path, lens);
    let names = photographs::names(&paths)?;
    Ok(SourceScene {
        origin: format!("the reconstruction in {}", file.display()),
        photographs: names.into_iter().zip(paths).zip(found).map(photograph).collect(),
        points,
        workspace: None,
        warnings,
    })
}

fn largest<'a>(root: &Entry<'a>, warnings: &mut Vec<String>) -> Result<Entry<'a>> {
    let mut counts = Vec::new();
    let mut best: Option<(usize, Entry)> = None;
    for reconstruction in root.items()? {
        let count = reconstruction.require("shots")?.fields()?.count();
        counts.push(count);
        if best.as_ref().is_none_or(|(most, _)| count > *most) {
            best = Some((count, reconstruction));
        }
    }
    let (_, chosen) = best.ok_or_else(|| root.error("a list of one reconstruction or more"))?;
    if counts.len() > 1 {
        warnings.push(format!(
            "there are {} reconstructions, of {} shots: number {} is read, the largest",
            counts.len(),
            counts.iter().map(usize::to_string).collect::<Vec<_>>().join(", "),
            chosen.name()
        ));
    }
    Ok(chosen)
}

fn find_images(folder: &Path) -> Result<PathBuf> {
    let absolute = std::path::absolute(folder).map_err(|error| cannot_be_read(folder, error))?;
    let places: Vec<PathBuf> = absolute.ancestors().take(2).map(|place| place.join("images")).collect();
    places.iter().find(|place| place.is_dir()).cloned().ok_or_else(|| {
        let other = places.last().map(|place| place.display().to_string()).unwrap_or_default();
        Error::file(&places[0], format!("no such folder; expected the photographs in it or in {other}"))
    })
}

/// Undistorted photographs may have another ending after the whole name.
fn find_photograph(images: &Path, name: &str, entry: &str) -> Result<PathBuf> {
    photographs::find_with_ending(images.join(name), entry)
}

/// Calibration and lens of a camera, its pose left at the origin.
fn lens_without_pose(camera: &Entry) -> Result<Lens> {
    let number = |key: &str| camera.get(key)?.map_or(Ok(0.0), |entry| entry.number());
    let numbers = |keys: &[&str]| keys.iter().map(|key| number(key)).collect::<Result<Vec<f64>>>();
    let (width, height) = (camera.require("width")?.side()?, camera.require("height")?.side()?);
    let projection = camera.get("projection_type")?;
    let name = projection.as_ref().map(|entry| entry.text()).transpose()?.unwrap_or("perspective");
    let has_one_focal_length = ["perspective", "fisheye"].contains(&name);
    let (fx, fy) = match has_one_focal_length {
        true => {
            let focal = camera.require("focal")?.number()?;
            (focal, focal)
        }
        false => (number("focal_x")?, number("focal_y")?),
    };
    let brown = |radial: &[&str], tangential: [f64; 2]| -> Result<Option<Distortion>> {
        let radial = numbers(radial)?;
        let is_ideal = radial.iter().chain(&tangential).all(|&value| value == 0.0);
        Ok((!is_ideal).then(|| Distortion::brown(&radial, tangential)))
    };
    let distortion = match (name, projection) {
        ("perspective" | "radial", _) => brown(&["k1", "k2"], [0.0; 2])?,
        ("simple_radial", _) => brown(&["k1"], [0.0; 2])?,
        ("brown", _) => brown(&["k1", "k2", "k3"], [number("p1")?, number("p2")?])?,
        ("fisheye", _) => Some(Distortion::fisheye(&numbers(&["k1", "k2"])?)),
        ("fisheye_opencv", _) => Some(Distortion::fisheye(&numbers(&["k1", "k2", "k3", "k4"])?)),
        (_, Some(entry)) => {
            let names = "perspective, simple_radial, radial, brown, fisheye, fisheye_opencv";
            return Err(entry.error(format!("one of {names}; panoramas must be cut into views first")));
        }
        (_, None) => None,
    };
    let side = f64::from(width.max(height));
    let camera_without_pose = Camera {
        width,
        height,
        fx: fx * side,
        fy: fy * side,
        cx: number("c_x")? * side + f64::from(width) / 2.0 - 0.5,
        cy: number("c_y")? * side + f64::from(height) / 2.0 - 0.5,
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    };
    let lens = Lens { camera: camera_without_pose, distortion };
    lens.check(camera.name()).map_err(|error| camera.file_error(error))?;
    Ok(lens)
}

fn read_points(
    reconstruction: &Entry,
    folder: &Path,
    shots: &HashMap<&str, u32>,
) -> Result<Vec<SparsePoint>> {
    let (mut points, mut indices) = (Vec::new(), HashMap::new());
    if let Some(entries) = reconstruction.get("points")? {
        for (id, point) in entries.fields()? {
            indices.insert(id, points.len());
            let position = DVec3::from(point.require("coordinates")?.numbers::<3>()?);
            points.push(SparsePoint { position, views: Vec::new() });
        }
    }
    let tracks = folder.join("tracks.csv");
    if tracks.is_file() && !points.is_empty() {
        read_tracks(&tracks, shots, &indices, &mut points)?;
    }
    Ok(points)
}

/// Adds the shots that saw each point. A line is of a feature: its shot and its track, then what is not used,
/// between tabs; tracks that are no points and shots of other reconstructions are passed over.
fn read_tracks(
    path: &Path,
    shots: &HashMap<&str, u32>,
    indices: &HashMap<&str, usize>,
    points: &mut [SparsePoint],
) -> Result<()> {
    let file = File::open(path).map_err(|error| cannot_be_read(path, error))?;
    for (number, line) in BufReader::new(file).lines().enumerate() {
        let line = line.map_err(|error| cannot_be_read(path, error))?;
        if line.trim().is_empty() || (number == 0 && line.starts_with("OPENSFM_TRACKS_VERSION")) {
            continue;
        }
        let mut columns = line.split('\t');
        let (Some(shot), Some(track), Some(_)) = (columns.next(), columns.next(), columns.next()) else {
            let problem = "has fewer than 3 columns between tabs; expected a shot, a track and a feature";
            return Err(Error::line(path, number + 1, problem));
        };
        if let (Some(&shot), Some(&point)) = (shots.get(shot), indices.get(track)) {
            points[point].views.push(shot);
        }
    }
    for point in points {
        point.views.sort_unstable();
        point.views.dedup();
    }
    Ok(())
}
