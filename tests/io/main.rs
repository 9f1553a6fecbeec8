//! Readers and writers of scene and map files.
#![cfg(feature = "io")]

mod clouds;
mod float_maps;
mod maps;
mod model;
mod pictures;
mod ply;
mod scene_folder;
mod workspace;

use glam::{DMat3, DQuat, DVec3};
use skep::geometry::Camera;
use skep::io::{ColmapModel, ModelImage};
use skep::{Result, SparsePoint};
use std::path::Path;

/// A camera of 6 x 4 pixels at `x` along the baseline, turned a little.
fn camera(x: f64) -> Camera {
    Camera {
        width: 6,
        height: 4,
        fx: 8.0,
        fy: 8.25,
        cx: 2.5,
        cy: 1.75,
        rotation: DMat3::from_quat(DQuat::from_xyzw(0.01, 0.1 * x, -0.02, 1.0).normalize()),
        translation: DVec3::new(-x, 0.125, 0.0),
    }
}

/// Two images and two points in front of them.
fn model() -> ColmapModel {
    let image = |name: &str, x| ModelImage { name: name.to_owned(), camera: camera(x) };
    let point = |x, views: &[u32]| SparsePoint { position: DVec3::new(x, 0.25, 4.0), views: views.to_vec() };
    ColmapModel {
        images: vec![image("left.png", 0.0), image("cam 1/right side.png", 0.5)],
        points: vec![point(0.1, &[0, 1]), point(-0.3, &[1]), point(0.2, &[0])],
    }
}

/// The text of an error, which must contain all of `parts`.
#[track_caller]
fn assert_refused<T>(result: Result<T>, parts: &[&str]) {
    let text = result.err().expect("an error").to_string();
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in {text:?}");
    }
}

/// Replaces a file's bytes by what `change` makes of them.
fn rewrite(path: &Path, change: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = std::fs::read(path).unwrap();
    change(&mut bytes);
    std::fs::write(path, bytes).unwrap();
}
