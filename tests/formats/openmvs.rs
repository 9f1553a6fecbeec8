//! OpenMVS's interface archives, written by the published layout.

use crate::*;
use tempfile::{TempDir, tempdir};

/// How a camera's calibration is written.
#[derive(Clone, Copy, PartialEq)]
enum Calibration {
    Normalized,
    Pixels,
    /// In pixels of half the size.
    HalfSize,
}

/// The bytes of an archive.
#[derive(Default)]
struct Archive(Vec<u8>);

impl Archive {
    fn count(&mut self, count: usize) {
        self.0.extend((count as u64).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.0.extend(text.as_bytes());
    }

    fn indices(&mut self, values: &[u32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn numbers(&mut self, values: &[f64]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn floats(&mut self, values: &[f32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
}

/// A camera's place on its platform: turned and moved, so that it counts.
fn mounting() -> (glam::DMat3, DVec3) {
    (glam::DMat3::from_rotation_z(0.3), DVec3::new(0.1, -0.2, 0.05))
}

/// The board, and an image without pose in front of the others.
fn board_archive(version: u32, calibration: Calibration) -> Vec<u8> {
    let ColmapModel { images, points } = model();
    let camera = images[0].camera;
    let mut archive = Archive::default();
    if version > 0 {
        archive.0.extend(b"MVSI");
        archive.indices(&[version, 0]);
    }
    archive.count(1);
    archive.text("platform");
    archive.count(1);
    archive.text("camera");
    if version > 3 {
        archive.text("RGB");
    }
    if version > 0 {
        archive.indices(&match calibration {
            Calibration::Normalized => [0, 0],
            Calibration::Pixels => [640, 360],
            Calibration::HalfSize => [320, 180],
        });
    }
    let (scale, half) = match calibration {
        Calibration::Normalized => (1.0 / 640.0, 0.0),
        Calibration::Pixels => (1.0, 0.0),
        Calibration::HalfSize => (0.5, 0.5),
    };
    let [cx, cy] = [camera.cx, camera.cy].map(|place| (place + half) * scale - half);
    archive.numbers(&[camera.fx * scale, 0.0, cx, 0.0, camera.fy * scale, cy, 0.0, 0.0, 1.0]);
    let (turn, shift) = mounting();
    archive.numbers(turn.transpose().to_cols_array_2d().as_flattened());
    archive.numbers(&shift.to_array());
    archive.count(images.len());
    for ModelImage { camera, .. } in &images {
        // R = turn * platform, C = platform^T shift + center.
        let platform = turn.transpose() * camera.rotation;
        let center = camera.center() - platform.transpose() * shift;
        archive.numbers(platform.transpose().to_cols_array_2d().as_flattened());
        archive.numbers(&center.to_array());
    }
    archive.count(images.len() + 1);
    let posed = images.iter().enumerate().map(|(pose, image)| (image.name.as_str(), pose as u32));
    for (name, pose) in std::iter::once(("lost.jpg", u32::MAX)).chain(posed) {
        archive.text(&format!("images/{name}"));
        if version > 4 {
            archive.text("");
        }
        archive.indices(&[0, 0, pose]);
        if version > 2 {
            archive.indices(&[pose]);
        }
        if version > 6 {
            archive.floats(&[0.5, 1.0, 2.0]);
            archive.count(1);
            archive.indices(&[1, 20]);
            archive.floats(&[1.0, 0.1, 0.9, 5.0]);
        }
    }
    archive.count(points.len());
    for point in &points {
        archive.floats(&point.position.as_vec3().to_array());
        archive.count(point.views.len());
        for view in &point.views {
            archive.indices(&[view + 1]);
            archive.floats(&[0.5]);
        }
    }
    archive.count(1);
    archive.floats(&[0.0, 0.0, 1.0]);
    archive.count(2);
    archive.0.extend([1, 2, 3, 4, 5, 6]);
    if version > 0 {
        archive.count(1);
        archive.floats(&[0.0; 6]);
        archive.count(1);
        archive.indices(&[0, 0]);
        archive.count(0);
        archive.count(0);
    }
    if version > 1 {
        archive.numbers(&[0.0; 16]);
    }
    if version > 5 {
        archive.numbers(&[0.0; 15]);
    }
    archive.0
}

fn scene(archive: &[u8]) -> TempDir {
    let folder = tempdir().unwrap();
    copy_photographs(&folder.path().join("images"));
    write(&folder.path().join("scene.mvs"), archive);
    folder
}

#[test]
fn all_versions_are_read() {
    for version in 0..=7 {
        let mut calibrations = vec![Calibration::Normalized];
        if version > 0 {
            calibrations.extend([Calibration::Pixels, Calibration::HalfSize]);
        }
        for calibration in calibrations {
            let folder = scene(&board_archive(version, calibration));
            for path in ["", "scene.mvs"] {
                let scene = read(&folder.path().join(path)).unwrap();
                assert_cameras(&scene);
                // Points are written in single precision.
                assert_points(&scene.points, true, 1e-6);
                assert_eq!(scene.warnings, ["1 of 8 images have no pose and are left out"]);
            }
        }
    }
}

#[test]
fn what_is_wrong_is_named() {
    let archive = board_archive(7, Calibration::Pixels);
    assert_refused(scene(b"MVS\0\x02\0\0\0more").path(), &["scene.mvs", "MVSI", "--archive-type -1"]);
    assert_refused(scene(b"MVSI\x08\0\0\0\0\0\0\0").path(), &["version of the archive is 8", "1 to 7"]);
    assert_refused(scene(b"neither nor, but long enough for a header").path(), &["scene.mvs"]);
    for length in [3, 11, 40, 200, archive.len() / 2, archive.len() - 1] {
        assert_refused(scene(&archive[..length]).path(), &["scene.mvs", "truncated"]);
    }
    assert_refused(scene(&[&archive[..], &[0]].concat()).path(), &["1 bytes too many"]);
    let folder = scene(&archive);
    std::fs::remove_file(folder.path().join("images/source1.jpg")).unwrap();
    assert_refused(folder.path(), &["source1.jpg", "no such file", "image 3 of"]);
}

#[test]
fn numbers_and_indices_that_cannot_be_are_named() {
    let with = |version: u32, from: &[u8], to: &[u8]| {
        let mut archive = board_archive(version, Calibration::Pixels);
        let at = archive.windows(from.len()).position(|window| window == from).unwrap();
        archive[at..at + to.len()].copy_from_slice(to);
        scene(&archive)
    };
    let camera = model().images[0].camera;
    let focal = camera.fx.to_le_bytes();
    assert_refused(with(6, &focal, &f64::NAN.to_le_bytes()).path(), &["calibration is [NaN", "finite"]);
    assert_refused(with(6, &focal, &(-1.0_f64).to_le_bytes()).path(), &["image 1", "key.jpg", "fx is -1"]);
    // The third image's pose follows its name, the empty mask, the platform and the camera.
    let name = b"images/source1.jpg\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0";
    let bad = [&name[..], &[9, 0, 0, 0]].concat();
    assert_refused(with(6, name, &bad).path(), &["image 3", "source1.jpg", "its pose is 9", "below 7"]);
    let resolution = [640_u32.to_le_bytes(), 360_u32.to_le_bytes()].concat();
    assert_refused(with(6, &resolution, &[0; 8]).path(), &["principal point is 318.5", "no resolution"]);
    let turn = mounting().0.x_axis.x.to_le_bytes();
    assert_refused(with(6, &turn, &2.0_f64.to_le_bytes()).path(), &["a rotation is [2.0", "orthonormal"]);
}
