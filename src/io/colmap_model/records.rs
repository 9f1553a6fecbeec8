//! The records of a model's files before ids are resolved, and the checks that text and binary share.

use super::camera_models::CameraModel;
use super::{ColmapModel, ModelImage};
use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion, Lens};
use crate::io::files::{NAME_INSIDE, stays_inside};
use crate::scene::SparsePoint;
use glam::{DMat3, DQuat, DVec2, DVec3};
use std::collections::{HashMap, HashSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Pixels: COLMAP has the center of the top-left pixel at (0.5, 0.5), the crate at (0, 0).
const HALF_PIXEL: f64 = 0.5;

/// The three files of a model.
pub(super) struct Files {
    pub binary: bool,
    pub cameras: PathBuf,
    pub images: PathBuf,
    pub points: PathBuf,
}

impl Files {
    pub(super) fn of(folder: &Path, binary: bool) -> Files {
        let extension = if binary { "bin" } else { "txt" };
        let path = |stem: &str| folder.join(format!("{stem}.{extension}"));
        Files { binary, cameras: path("cameras"), images: path("images"), points: path("points3D") }
    }

    /// Their size together.
    pub(super) fn bytes(&self) -> u64 {
        let size = |path: &PathBuf| std::fs::metadata(path).map_or(0, |metadata| metadata.len());
        [&self.cameras, &self.images, &self.points].map(size).iter().sum()
    }

    /// The model of a folder; binary files take precedence, as in COLMAP.
    pub(super) fn find(folder: &Path) -> Option<Files> {
        [true, false]
            .into_iter()
            .map(|binary| Files::of(folder, binary))
            .find(|files| files.cameras.is_file() && files.images.is_file())
    }
}

/// File and line of a record, for error texts.
pub(super) struct Place<'a> {
    pub path: &'a Path,
    /// Counted from 1; `None` in binary files.
    pub line: Option<usize>,
}

impl Place<'_> {
    pub(super) fn error(&self, problem: impl Display) -> Error {
        Error::File { path: self.path.to_owned(), line: self.line, problem: problem.to_string() }
    }
}

/// The calibration of one or more images.
pub(super) struct CameraRecord {
    pub line: Option<usize>,
    pub id: u32,
    pub width: u64,
    pub height: u64,
    pub model: CameraModel,
    /// As many as the model has, as in the file.
    pub parameters: Vec<f64>,
}

/// An image's pose.
pub(super) struct ImageRecord {
    pub line: Option<usize>,
    pub id: u32,
    /// w, x, y, z
    pub quaternion: [f64; 4],
    pub translation: [f64; 3],
    pub camera: u32,
    pub name: String,
}

/// A point and the ids of the images that saw it.
pub(super) struct PointRecord {
    pub line: Option<usize>,
    pub id: u64,
    pub position: [f64; 3],
    pub track: Vec<u32>,
}

/// All three files.
pub(super) struct Records {
    pub cameras: Vec<CameraRecord>,
    pub images: Vec<ImageRecord>,
    pub points: Vec<PointRecord>,
}

impl Records {
    /// Returns an error for a camera whose lens distorts.
    pub(super) fn require_pinhole(&self, files: &Files) -> Result<()> {
        for record in &self.cameras {
            if record.model.calibration(&record.parameters).1.is_some() {
                let place = Place { path: &files.cameras, line: record.line };
                return Err(place.error(format!(
                    "camera {} has the model {}; expected PINHOLE or SIMPLE_PINHOLE, or no distortion; \
                     `skep reconstruct` undistorts photographs, as does `colmap image_undistorter`",
                    record.id, record.model.name
                )));
            }
        }
        Ok(())
    }

    /// Replaces ids by cameras and indices; gives the distortion of each image beside the model.
    pub(super) fn resolve(self, files: &Files) -> Result<(ColmapModel, Vec<Option<Distortion>>)> {
        let mut cameras = HashMap::new();
        for record in &self.cameras {
            let place = Place { path: &files.cameras, line: record.line };
            if cameras.insert(record.id, record.camera(&place)?).is_some() {
                return Err(place.error(format!("camera {} occurs twice", record.id)));
            }
        }
        if self.images.is_empty() {
            return Err(Error::file(&files.images, "the model has no image; expected at least 2"));
        }
        let mut indices = HashMap::new();
        let mut names = HashSet::new();
        let (mut images, mut distortions) = (Vec::new(), Vec::new());
        for record in self.images {
            let place = Place { path: &files.images, line: record.line };
            let Some(camera) = cameras.get(&record.camera) else {
                let (id, camera) = (record.id, record.camera);
                return Err(
                    place.error(format!("image {id} has the camera {camera}, which is not in the model"))
                );
            };
            if indices.insert(record.id, images.len() as u32).is_some() {
                return Err(place.error(format!("image {} occurs twice", record.id)));
            }
            let image = record.image(&camera.camera, &place)?;
            distortions.push(camera.distortion);
            if !names.insert(image.name.clone()) {
                return Err(place.error(format!("the name {} occurs twice", image.name)));
            }
            images.push(image);
        }
        let mut points = Vec::with_capacity(self.points.len());
        for record in self.points {
            let place = Place { path: &files.points, line: record.line };
            let mut views = Vec::with_capacity(record.track.len());
            for id in record.track {
                let index = indices.get(&id).copied();
                views.push(index.ok_or_else(|| {
                    place.error(format!(
                        "the track of point {} has the image {id}, which is not in the model",
                        record.id
                    ))
                })?);
            }
            views.sort_unstable();
            views.dedup();
            points.push(SparsePoint { position: DVec3::from(record.position), views });
        }
        Ok((ColmapModel { images, points }, distortions))
    }
}

impl CameraRecord {
    /// The camera without its pose.
    fn camera(&self, place: &Place) -> Result<Lens> {
        let side = |side: u64| u32::try_from(side).unwrap_or(u32::MAX);
        let ([fx, fy, cx, cy], distortion) = self.model.calibration(&self.parameters);
        let camera = Camera {
            width: side(self.width),
            height: side(self.height),
            fx,
            fy,
            cx: cx - HALF_PIXEL,
            cy: cy - HALF_PIXEL,
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
        };
        let lens = Lens { camera, distortion };
        lens.check(&format!("camera {}", self.id)).map_err(|error| place.error(error))?;
        Ok(lens)
    }
}

impl ImageRecord {
    /// The image with its calibration and pose.
    fn image(self, camera: &Camera, place: &Place) -> Result<ModelImage> {
        let [w, x, y, z] = self.quaternion;
        let quaternion = DQuat::from_xyzw(x, y, z, w);
        let length = quaternion.length();
        if !(length.is_finite() && length > 1e-6) {
            let (id, values) = (self.id, self.quaternion);
            return Err(
                place.error(format!("image {id} has the quaternion {values:?}; expected one of length 1"))
            );
        }
        if !stays_inside(&self.name) {
            let problem = format!("the image name is {:?}; expected {NAME_INSIDE}", self.name);
            return Err(place.error(problem));
        }
        let camera = Camera {
            rotation: DMat3::from_quat(quaternion / length),
            translation: DVec3::from(self.translation),
            ..*camera
        };
        camera.check(&format!("image {}", self.id)).map_err(|error| place.error(error))?;
        Ok(ModelImage { camera, name: self.name })
    }
}

/// The content of the files, the same in text and binary. All ids count from 1.
pub(super) struct Layout {
    /// Distinct calibrations: fx, fy, cx, cy.
    pub cameras: Vec<[f64; 4]>,
    /// Width and height of each.
    pub sizes: Vec<[u32; 2]>,
    pub images: Vec<ImageRecord>,
    /// Position and point id of each image's features.
    pub features: Vec<Vec<([f64; 2], u64)>>,
    /// Image id and feature index of each entry of a point's track.
    pub tracks: Vec<Vec<[u32; 2]>>,
}

impl Layout {
    pub(super) fn of(model: &ColmapModel) -> Layout {
        let (mut cameras, mut sizes, mut images) = (Vec::new(), Vec::new(), Vec::new());
        for (index, ModelImage { name, camera }) in model.images.iter().enumerate() {
            let parameters = [camera.fx, camera.fy, camera.cx + HALF_PIXEL, camera.cy + HALF_PIXEL];
            let size = [camera.width, camera.height];
            let known = (0..cameras.len()).find(|&i| cameras[i] == parameters && sizes[i] == size);
            let camera_index = known.unwrap_or_else(|| {
                cameras.push(parameters);
                sizes.push(size);
                cameras.len() - 1
            });
            let quaternion = DQuat::from_mat3(&camera.rotation);
            images.push(ImageRecord {
                line: None,
                id: index as u32 + 1,
                quaternion: [quaternion.w, quaternion.x, quaternion.y, quaternion.z],
                translation: camera.translation.into(),
                camera: camera_index as u32 + 1,
                name: name.clone(),
            });
        }
        let mut features = vec![Vec::new(); images.len()];
        let track = |(index, point): (usize, &SparsePoint)| {
            let place = |&view: &u32| {
                let camera = &model.images[view as usize].camera;
                let pixel = camera.project(point.position).map_or(DVec2::ZERO, |(pixel, _)| pixel);
                let list: &mut Vec<_> = &mut features[view as usize];
                list.push(((pixel + HALF_PIXEL).into(), index as u64 + 1));
                [view + 1, list.len() as u32 - 1]
            };
            point.views.iter().map(place).collect()
        };
        let tracks = model.points.iter().enumerate().map(track).collect();
        Layout { cameras, sizes, images, features, tracks }
    }
}
