//! Readers of the scenes of other programs: the scene of `examples/data/board` is written in each format and
//! read back, and files that the programs wrote are read.
#![cfg(feature = "io")]

mod colmap;
mod middlebury;
mod mvsnet;
mod nerfstudio;
mod openmvs;
mod opensfm;

use glam::DVec3;
use skep::SparsePoint;
use skep::geometry::{Camera, Lens};
use skep::import::{SourceScene, read};
use skep::io::{ColmapModel, ModelImage};
use std::path::{Path, PathBuf};

fn board() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data/board")
}

/// The cameras and points of the board.
fn model() -> ColmapModel {
    ColmapModel::read(&board().join("sparse")).unwrap()
}

fn copy_photographs(folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    for ModelImage { name, .. } in model().images {
        std::fs::copy(board().join("images").join(&name), folder.join(&name)).unwrap();
    }
}

/// Gray photographs of a size under these names.
fn write_photographs(folder: &Path, names: &[&str], (width, height): (u32, u32)) {
    for name in names {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        image::GrayImage::from_pixel(width, height, image::Luma([90])).save(path).unwrap();
    }
}

fn write(path: &Path, content: impl AsRef<[u8]>) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, content).unwrap();
}

/// Asserts that a scene has the cameras and the names of the board.
fn assert_cameras(scene: &SourceScene) {
    let expected = model().images;
    assert_eq!(scene.photographs.len(), expected.len());
    for (found, expected) in scene.photographs.iter().zip(&expected) {
        assert_eq!(found.name, expected.name);
        assert!(found.path.is_file());
        assert_eq!(found.lens.distortion, None);
        assert_same_camera(&found.lens.camera, &expected.camera);
    }
}

fn assert_same_camera(found: &Camera, expected: &Camera) {
    let numbers = |camera: &Camera| {
        let Camera { fx, fy, cx, cy, .. } = *camera;
        let mut all = vec![fx, fy, cx, cy];
        all.extend(camera.rotation.to_cols_array());
        all.extend(camera.translation.to_array());
        all
    };
    assert_eq!((found.width, found.height), (expected.width, expected.height));
    for (found_number, expected_number) in numbers(found).into_iter().zip(numbers(expected)) {
        assert!((found_number - expected_number).abs() < 1e-9, "{found:?} instead of {expected:?}");
    }
}

/// Asserts that points are those of the board, up to a distance.
fn assert_points(found: &[SparsePoint], has_tracks: bool, tolerance: f64) {
    let expected = model().points;
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.position.distance(expected.position) <= tolerance);
        assert_eq!(found.views, if has_tracks { expected.views } else { Vec::new() });
    }
}

/// Asserts that a path is refused with an error that says all of this.
fn assert_refused(path: &Path, words: &[&str]) {
    let error = match read(path) {
        Ok(scene) => panic!("{} was read: {}", path.display(), scene.origin),
        Err(error) => error.to_string(),
    };
    for word in words {
        assert!(error.contains(word), "{word:?} is missing in: {error}");
    }
}

/// The rows of a camera's rotation.
fn rows(camera: &Camera) -> [[f64; 3]; 3] {
    camera.rotation.transpose().to_cols_array_2d()
}

/// Numbers that read back exactly, with spaces between them.
fn words(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn a_folder_without_a_scene_is_told_what_was_looked_for() {
    let folder = tempfile::tempdir().unwrap();
    assert_refused(&folder.path().join("none"), &["none", "no such file or folder"]);
    let wanted = ["COLMAP", "transforms.json", ".mvs", "reconstruction.json", "cams/", "_par.txt"];
    assert_refused(folder.path(), &wanted);
}
