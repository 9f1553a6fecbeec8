//! The formats of scenes, one file each, and what they share.
//!
//! Names of photographs in the results are those of COLMAP's model, and else the paths below the innermost
//! folder that holds all photographs.

mod calibration;
mod colmap;
mod json;
mod middlebury;
mod mvsnet;
mod nerfstudio;
mod openmvs;
mod opensfm;
mod photographs;
mod points;
mod poses;
mod text;

use super::SourceScene;
use crate::error::{Error, Result};
use poses::Convention;
use std::path::Path;

/// A format: whether a path is of it, and how it is read.
struct Format {
    /// Whether there is a scene of this format at a path, by the names of files only.
    is_at: fn(&Path) -> bool,
    read: fn(&Path) -> Result<SourceScene>,
    /// What its poses are.
    poses: Convention,
    /// What is looked for, for the error where nothing is found.
    looked_for: &'static str,
}

/// In the order in which they are looked for.
const FORMATS: [Format; 6] = [
    Format {
        is_at: colmap::is_at,
        read: colmap::read,
        poses: Convention::WorldToCamera,
        looked_for: "a COLMAP model (cameras and images, .bin or .txt, in sparse/ or a folder in it) beside \
                     images/",
    },
    Format {
        is_at: nerfstudio::is_at,
        read: nerfstudio::read,
        poses: Convention::CameraToWorldOpenGl,
        looked_for: "transforms.json of nerfstudio or instant-ngp",
    },
    Format {
        is_at: openmvs::is_at,
        read: openmvs::read,
        poses: Convention::WorldToCamera,
        looked_for: "a file .mvs of OpenMVS, or scene.mvs",
    },
    Format {
        is_at: opensfm::is_at,
        read: opensfm::read,
        poses: Convention::WorldToCamera,
        looked_for: "reconstruction.json of OpenSfM, or opensfm/reconstruction.json",
    },
    Format {
        is_at: mvsnet::is_at,
        read: mvsnet::read,
        poses: Convention::WorldToCamera,
        looked_for: "cams/*_cam.txt of MVSNet beside images/ or blended_images/",
    },
    Format {
        is_at: middlebury::is_at,
        read: middlebury::read,
        poses: Convention::WorldToCamera,
        looked_for: "a file *_par.txt of Middlebury's multi-view sets",
    },
];

/// Whether a path is a photograph or a folder with some, in itself or in `images/`, by their names.
fn holds_photographs(path: &Path) -> bool {
    let is_photograph = |path: &Path| image::ImageFormat::from_path(path).is_ok();
    let folders = [path.to_owned(), path.join("images")];
    let mut entries = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    is_photograph(path) || entries.any(|entry| is_photograph(&entry.path()))
}

/// Reads the scene at a path, a folder or a file, whichever format it has.
///
/// # Errors
/// Nothing that is known; the errors of the format's reader; poses that are meant in another convention, as
/// the points tell; no photograph.
pub fn read(path: &Path) -> Result<SourceScene> {
    if !path.exists() {
        return Err(Error::file(path, "no such file or folder; expected a scene"));
    }
    let Some(format) = FORMATS.iter().find(|format| (format.is_at)(path)) else {
        let looked_for = FORMATS.iter().map(|format| format.looked_for).collect::<Vec<_>>().join("; ");
        let problem = match holds_photographs(path) {
            true => {
                "photographs without cameras: COLMAP finds these, as the README shows under \"From your \
                     own photographs\""
            }
            false => "no scene",
        };
        return Err(Error::file(path, format!("{problem}; expected one of: {looked_for}")));
    };
    let mut scene = (format.read)(path)?;
    if scene.photographs.is_empty() {
        return Err(Error::file(path, format!("{} are none; expected 2 or more", scene.origin)));
    }
    poses::check(path, &mut scene, format.poses)?;
    Ok(scene)
}
