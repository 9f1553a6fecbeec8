//! nerfstudio and instant-ngp: `transforms.json`, or another file of its kind.
//!
//! Poses are camera-to-world with OpenGL's axes. Principal points are COLMAP's, with the center of the
//! top-left pixel at (0.5, 0.5). nerfstudio applies its `applied_transform` to the poses and, since its
//! version 1.0, to the cloud before it writes both: they are in one frame, and the transform is history.
//! Clouds of earlier versions are in the frame before the transform; where they fit the poses only with it,
//! it is applied to them, with a warning.

use super::json::{self, Entry};
use super::poses::{from_open_gl, share_in_two};
use super::{photographs, points};
use crate::error::Result;
use crate::geometry::{Camera, Distortion, Lens};
use crate::import::{SourcePhotograph, SourceScene};
use crate::io::picture_size;
use crate::scene::SparsePoint;
use std::path::{Path, PathBuf};

const NAME: &str = "transforms.json";

/// Models whose parameters are those of [`Distortion::Brown`]; some writers call any of them `PINHOLE`.
const PERSPECTIVE: [&str; 6] =
    ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "SIMPLE_RADIAL", "RADIAL"];
const FISHEYE: &str = "OPENCV_FISHEYE";

/// Clouds that fit the poses less than the first share as they are, and more than the second one
/// transformed, are transformed.
const MISFIT: f64 = 0.5;
const FIT: f64 = 0.8;

pub(super) fn is_at(path: &Path) -> bool {
    let is_named = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("transforms"));
    let is_json = path.extension().is_some_and(|extension| extension == "json");
    (is_named && is_json && path.is_file()) || path.join(NAME).is_file()
}

/// Reads the file, whose paths are relative to its folder.
///
/// # Errors
/// Entries that are missing or invalid; another camera model; missing files.
pub(super) fn read(path: &Path) -> Result<SourceScene> {
    let file = if path.is_file() { path.to_owned() } else { path.join(NAME) };
    let folder = file.parent().unwrap_or(Path::new("")).to_owned();
    let value = json::read(&file)?;
    let root = Entry::root(&file, &value);
    let photographs = read_frames(&root, &folder)?;
    let points = match root.get("ply_file_path")? {
        Some(entry) => points::read(&folder.join(entry.text()?))?,
        None => Vec::new(),
    };
    let points = points.into_iter().map(|position| SparsePoint { position, views: Vec::new() }).collect();
    let origin = format!("the cameras in {}", file.display());
    let mut scene = SourceScene { origin, photographs, points, workspace: None, warnings: Vec::new() };
    if let Some(transform) = root.get("applied_transform")? {
        move_cloud(&mut scene, &transform)?;
    }
    Ok(scene)
}

fn read_frames(root: &Entry, folder: &Path) -> Result<Vec<SourcePhotograph>> {
    let mut paths: Vec<PathBuf> = Vec::new();
    let mut lenses = Vec::new();
    let mut masks = Vec::new();
    for frame in root.require("frames")?.items()? {
        let entry = frame.require("file_path")?;
        let path = photographs::find_with_ending(folder.join(entry.text()?), entry.name())?;
        let lens = Fields { frame: &frame, root }.lens(&path)?;
        let mask = match frame.get("mask_path")? {
            Some(entry) => Some(photographs::find(folder.join(entry.text()?), entry.name())?),
            None => None,
        };
        photographs::check_size(&path, &lens.camera, frame.name())?;
        paths.push(path);
        lenses.push(lens);
        masks.push(mask);
    }
    let names = photographs::names(&paths)?;
    let parts = names.into_iter().zip(paths).zip(lenses.into_iter().zip(masks));
    let photograph =
        |((name, path), (lens, mask))| SourcePhotograph { mask, ..SourcePhotograph::new(name, path, lens) };
    Ok(parts.map(photograph).collect())
}

/// Applies the file's transform to its cloud if that fits the poses only then.
fn move_cloud(scene: &mut SourceScene, entry: &Entry) -> Result<()> {
    let (matrix, translation) = entry.affine()?;
    let transform = |point| matrix * point + translation;
    let as_it_is = share_in_two(scene, |point| point);
    let moved = share_in_two(scene, transform);
    if as_it_is.is_some_and(|share| share < MISFIT) && moved.is_some_and(|share| share > FIT) {
        scene.points.iter_mut().for_each(|point| point.position = transform(point.position));
        scene.warnings.push(
            "the cloud lies in the photographs only with applied_transform, as in files of early versions of \
             nerfstudio; it is applied to the cloud"
                .to_owned(),
        );
    }
    Ok(())
}

/// The entries of a frame; those that it lacks are the file's.
struct Fields<'a> {
    frame: &'a Entry<'a>,
    root: &'a Entry<'a>,
}

impl<'a> Fields<'a> {
    fn get(&self, key: &str) -> Result<Option<Entry<'a>>> {
        Ok(match self.frame.get(key)? {
            Some(entry) => Some(entry),
            None => self.root.get(key)?,
        })
    }

    fn number(&self, key: &str) -> Result<Option<f64>> {
        self.get(key)?.map(|entry| entry.number()).transpose()
    }

    /// Calibration, lens and pose.
    fn lens(&self, path: &Path) -> Result<Lens> {
        let side = |key| self.get(key)?.map(|entry| entry.side()).transpose();
        let (width, height) = match (side("w")?, side("h")?) {
            (Some(width), Some(height)) => (width, height),
            _ => picture_size(path)?,
        };
        let (fx, fy) = self.focal_lengths(width, height)?;
        let (rotation, center) = self.frame.require("transform_matrix")?.rigid()?;
        let (rotation, translation) = from_open_gl(rotation, center);
        let cx = self.number("cx")?.unwrap_or(f64::from(width) / 2.0) - 0.5;
        let cy = self.number("cy")?.unwrap_or(f64::from(height) / 2.0) - 0.5;
        let camera = Camera { width, height, fx, fy, cx, cy, rotation, translation };
        let lens = Lens { camera, distortion: self.distortion()? };
        lens.check(self.frame.name()).map_err(|error| self.frame.file_error(error))?;
        Ok(lens)
    }

    /// From `fl_x` and `fl_y`, else from the angles of view.
    fn focal_lengths(&self, width: u32, height: u32) -> Result<(f64, f64)> {
        let focal = |key, angle, side: u32| -> Result<Option<f64>> {
            match (self.number(key)?, self.number(angle)?) {
                (Some(focal), _) => Ok(Some(focal)),
                (None, Some(angle)) => Ok(Some(f64::from(side) / 2.0 / (angle / 2.0).tan())),
                (None, None) => Ok(None),
            }
        };
        let fx = focal("fl_x", "camera_angle_x", width)?;
        let fy = focal("fl_y", "camera_angle_y", height)?;
        let fx = fx.ok_or_else(|| {
            let frame = self.frame.name();
            let expected = "expected one of them in it or for the whole file";
            self.frame.file_error(format!("{frame} has neither fl_x nor camera_angle_x; {expected}"))
        })?;
        Ok((fx, fy.unwrap_or(fx)))
    }

    fn distortion(&self) -> Result<Option<Distortion>> {
        let model = self.get("camera_model")?;
        let name = model.as_ref().map(|entry| entry.text()).transpose()?.unwrap_or("OPENCV");
        let is_fisheye = name == FISHEYE || self.get("is_fisheye")?.is_some_and(|entry| entry.is_true());
        let mut k = [0.0; 4];
        for (value, key) in k.iter_mut().zip(["k1", "k2", "k3", "k4"]) {
            *value = self.number(key)?.unwrap_or(0.0);
        }
        let tangential = [self.number("p1")?.unwrap_or(0.0), self.number("p2")?.unwrap_or(0.0)];
        let none = |keys: &[&str], expected: &str| {
            for key in keys {
                if let Some(entry) = self.get(key)?.filter(|entry| !matches!(entry.number(), Ok(0.0))) {
                    return Err(entry.error(expected));
                }
            }
            Ok(())
        };
        match model {
            _ if is_fisheye => {
                none(&["p1", "p2"], "0: a fisheye has no tangential distortion")?;
                Ok(Some(Distortion::fisheye(&k)))
            }
            Some(entry) if !PERSPECTIVE.contains(&name) => {
                let names = PERSPECTIVE.join(", ");
                Err(entry.error(format!("one of {names}, {FISHEYE}; panoramas must be cut into views first")))
            }
            _ => {
                none(
                    &["k4"],
                    "0: with a perspective model nerfstudio and OpenCV mean different terms by it",
                )?;
                let is_ideal = k.iter().chain(&tangential).all(|&value| value == 0.0);
                Ok((!is_ideal).then(|| Distortion::brown(&k[..3], tangential)))
            }
        }
    }
}
