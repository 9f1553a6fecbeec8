//! COLMAP's models in the places where its programs put them.

use crate::*;
use glam::{DMat3, DQuat};
use tempfile::{TempDir, tempdir};

/// The first images of the board and the points that only they saw.
fn part(count: usize) -> ColmapModel {
    let ColmapModel { mut images, mut points } = model();
    images.truncate(count);
    points.retain(|point| point.views.iter().all(|&view| (view as usize) < count));
    ColmapModel { images, points }
}

fn scene_with(parts: &[(&str, usize)]) -> TempDir {
    let folder = tempdir().unwrap();
    copy_photographs(&folder.path().join("images"));
    for (place, count) in parts {
        part(*count).write_binary(&folder.path().join(place)).unwrap();
    }
    folder
}

#[test]
fn the_scene_is_read_in_every_place() {
    for place in ["sparse", "sparse/0"] {
        let folder = scene_with(&[(place, 7)]);
        for path in ["", "sparse", place] {
            let scene = read(&folder.path().join(path)).unwrap();
            assert_cameras(&scene);
            assert_points(&scene.points, true, 0.0);
            assert!(scene.warnings.is_empty());
        }
    }
}

#[test]
fn of_several_models_the_one_of_the_most_images_is_read() {
    let folder = scene_with(&[("sparse/0", 2), ("sparse/1", 7), ("sparse/2", 3)]);
    // A text model is counted too.
    part(4).write_text(&folder.path().join("sparse/10")).unwrap();
    for path in ["", "sparse"] {
        let scene = read(&folder.path().join(path)).unwrap();
        assert_cameras(&scene);
        let [warning] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
        for word in ["4 models", "sparse/1 is read", "most images, 7", "0 (2), 10 (4), 2 (3)"] {
            assert!(warning.contains(word), "{warning}");
        }
    }
    assert_eq!(read(&folder.path().join("sparse/2")).unwrap().photographs.len(), 3);
}

#[test]
fn missing_photographs_and_folders_are_named() {
    let folder = scene_with(&[("sparse/0", 7)]);
    std::fs::remove_file(folder.path().join("images/source3.jpg")).unwrap();
    assert_refused(folder.path(), &["source3.jpg", "no such file", "the model in"]);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    assert_refused(&folder.path().join("sparse/0"), &["images", "no such folder", " or "]);
}

#[test]
fn inverted_poses_are_named() {
    let folder = tempdir().unwrap();
    copy_photographs(&folder.path().join("images"));
    let mut model = model();
    for ModelImage { camera, .. } in &mut model.images {
        (camera.rotation, camera.translation) = (camera.rotation.transpose(), camera.center());
    }
    // The first camera is the world's: inverted it is itself. Turned and moved, it is not.
    let (turn, shift) = (DMat3::from_rotation_y(0.8), DVec3::new(2.0, 0.5, 0.0));
    for ModelImage { camera, .. } in &mut model.images {
        camera.rotation = turn * camera.rotation;
        camera.translation = turn * camera.translation + shift;
    }
    for point in &mut model.points {
        point.position = turn * point.position + shift;
    }
    model.write_binary(&folder.path().join("sparse")).unwrap();
    assert_refused(folder.path(), &["the poses look like camera-to-world; expected world-to-camera"]);
}

/// `data/colmap-4.2` was written by pycolmap 4.2.1: two frames of a rig of two cameras.
#[test]
fn models_with_rigs_and_frames_are_read() {
    let folder = tempdir().unwrap();
    let names = ["left/0.png", "left/1.png", "right/0.png", "right/1.png"];
    write_photographs(&folder.path().join("images"), &names, (64, 48));
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/data/colmap-4.2/sparse/0");
    for file in ["cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "frames.bin"] {
        write(&folder.path().join("sparse/0").join(file), std::fs::read(data.join(file)).unwrap());
    }
    let scene = read(folder.path()).unwrap();
    let find = |name: &str| scene.photographs.iter().find(|photograph| photograph.name == name).unwrap();
    // The poses of the frames, and of the right camera on the rig.
    let frame = (DQuat::from_rotation_y(0.2), DVec3::new(-0.5, 0.125, 0.0625));
    let right = (DQuat::from_rotation_y(0.04), DVec3::new(-0.25, 0.01, 0.005));
    let expected = [
        ("left/0.png", DQuat::IDENTITY, DVec3::ZERO),
        ("left/1.png", frame.0, frame.1),
        ("right/0.png", right.0, right.1),
        ("right/1.png", right.0 * frame.0, right.0 * frame.1 + right.1),
    ];
    for (name, rotation, translation) in expected {
        let Lens { camera, distortion } = find(name).lens;
        assert!(camera.rotation.abs_diff_eq(DMat3::from_quat(rotation), 1e-12), "{name}");
        assert!(camera.translation.abs_diff_eq(translation, 1e-12), "{name}");
        assert_eq!(distortion.is_some(), name.starts_with("right"));
        assert_eq!(camera.cx, if name.starts_with("right") { 30.5 } else { 32.0 });
    }
    assert_eq!(scene.points.len(), 3);
    assert_eq!(scene.warnings, Vec::<String>::new());
}
