//! MVSNet's folders of cameras.

use crate::*;
use skep::DepthRange;
use tempfile::{TempDir, tempdir};

/// A file of a camera whose calibration is divided by a factor.
fn camera_file(camera: &Camera, reduction: f64, depths: &str) -> String {
    let rotation = rows(camera);
    let t = camera.translation.to_array();
    let row = |i: usize| words(&[rotation[i].as_slice(), &[t[i]]].concat());
    let [fx, fy, cx, cy] = [camera.fx, camera.fy, camera.cx, camera.cy].map(|value| value / reduction);
    let k = [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]].map(|row| words(&row)).join("\n");
    let extrinsic = [row(0), row(1), row(2), "0.0 0.0 0.0 1.0".to_owned()].join("\n");
    format!("extrinsic\n{extrinsic}\n\nintrinsic\n{k}\n\n{depths}\n")
}

/// The board's photographs as `00000000.jpg` and so on, with their cameras.
fn scene(images: &str, cameras: &str, reduction: f64, depths: &str) -> TempDir {
    let folder = tempdir().unwrap();
    for (index, ModelImage { name, camera }) in model().images.iter().enumerate() {
        let photograph = std::fs::read(board().join("images").join(name)).unwrap();
        write(&folder.path().join(format!("{images}/{index:08}.jpg")), photograph);
        let path = folder.path().join(format!("{cameras}/{index:08}_cam.txt"));
        write(&path, camera_file(camera, reduction, depths));
    }
    folder
}

fn assert_board(scene: &SourceScene) {
    let expected = model().images;
    assert_eq!(scene.photographs.len(), expected.len());
    for (index, (found, expected)) in scene.photographs.iter().zip(&expected).enumerate() {
        assert_eq!(found.name, format!("{index:08}.jpg"));
        assert_same_camera(&found.lens.camera, &expected.camera);
    }
}

#[test]
fn cameras_depths_and_sources_are_read() {
    for (images, cameras) in [("images", "cams"), ("blended_images", "cams"), ("images", "cams_1")] {
        let folder = scene(images, cameras, 1.0, "0.5 0.01 192 2.25");
        // BlendedMVS has masked copies beside the photographs.
        let copy = folder.path().join(images).join("00000000_masked.jpg");
        std::fs::copy(board().join("images/key.jpg"), copy).unwrap();
        write(&folder.path().join("pair.txt"), "2\n0\n2 3 99.5 1 50\n4\n0\n");
        let scene = read(folder.path()).unwrap();
        assert_board(&scene);
        assert_eq!(scene.photographs[6].depth_range, Some(DepthRange { near: 0.5, far: 2.25 }));
        assert_eq!(scene.photographs[0].sources, Some(vec![3, 1]));
        assert_eq!((&scene.photographs[1].sources, &scene.photographs[4].sources), (&None, &None));
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}

#[test]
fn the_largest_depth_follows_from_the_number_of_depths_or_is_guessed() {
    let far = |depths: &str| {
        let folder = scene("images", "cams", 1.0, depths);
        let scene = read(folder.path()).unwrap();
        (scene.photographs[0].depth_range.unwrap().far, scene.warnings.len())
    };
    assert_eq!(far("0.5 0.25 5"), (1.5, 0));
    assert_eq!(far("0.5 0.25"), (0.5 + 0.25 * 192.0 * 1.06, 1));
}

#[test]
fn calibrations_of_a_quarter_of_the_size_are_enlarged() {
    let folder = scene("images", "cams", 4.0, "0.5 0.01 192 2.25");
    let scene = read(folder.path()).unwrap();
    assert_board(&scene);
    assert!(scene.warnings[0].contains("multiplied by 4"), "{:?}", scene.warnings);
}

#[test]
fn a_scan_of_the_training_set_of_dtu_is_read() {
    let folder = tempdir().unwrap();
    let scan = folder.path().join("Rectified/scan1_train");
    for (index, ModelImage { name, camera }) in model().images.iter().enumerate() {
        let path = folder.path().join(format!("Cameras/train/{index:08}_cam.txt"));
        write(&path, camera_file(camera, 4.0, "0.5 0.01"));
        for light in [0, 3] {
            let photograph = scan.join(format!("rect_{:03}_{light}_r5000.png", index + 1));
            if index < 6 {
                // The content is a JPEG, which the reader tells by its first bytes.
                write(&photograph, std::fs::read(board().join("images").join(name)).unwrap());
            }
        }
    }
    write(&folder.path().join("Cameras/pair.txt"), "2\n0\n3 6 9.0 2 8.0 1 7.0\n6\n1 0 1.0\n");
    let scene = read(&scan).unwrap();
    assert_eq!(scene.photographs.len(), 6);
    assert_eq!(scene.photographs[1].name, "rect_002_3_r5000.png");
    assert_same_camera(&scene.photographs[1].lens.camera, &model().images[1].camera);
    assert_eq!(scene.photographs[0].sources, Some(vec![2, 1]));
    for word in ["multiplied by 4", "lighting 3", "1 cameras have no photograph"] {
        assert!(scene.warnings.iter().any(|warning| warning.contains(word)), "{word}");
    }
}

#[test]
fn what_is_wrong_is_named() {
    let change = |from: &str, to: &str| {
        let folder = scene("images", "cams", 1.0, "0.5 0.01 192 2.25");
        let path = folder.path().join("cams/00000000_cam.txt");
        let content = std::fs::read_to_string(&path).unwrap();
        assert!(content.contains(from));
        write(&path, content.replacen(from, to, 1));
        folder
    };
    let cases = [
        (change("extrinsic", "intrinsic"), &["00000000_cam.txt, line 1", "word extrinsic"][..]),
        (change("1.0", "1.1"), &["00000000_cam.txt", "extrinsic matrix is [1.1", "a rotation"]),
        (change("0.0 0.0 0.0 1.0", "0.0 0.0 0.5 1.0"), &["a row 0 0 0 1"]),
        (change("462.43", "inf 462.43"), &["line 8", "intrinsic matrix is inf", "finite"]),
        (change("2.25", "0.25"), &["line 12", "0.5 to 0.25"]),
        (change("2.25", "2.25 3 4"), &["6 numbers of depths", "MIN INTERVAL NUMBER MAX"]),
        (change("0.5 0.01 192 2.25", "0.5"), &["the file ends here", "interval"]),
    ];
    for (folder, words) in cases {
        assert_refused(folder.path(), words);
    }
    let folder = scene("images", "cams", 1.0, "0.5 0.01 192 2.25");
    write(&folder.path().join("pair.txt"), "1\n0\n1 7 1.0\n");
    assert_refused(folder.path(), &["pair.txt, line 3", "the source is 7"]);
    write(&folder.path().join("pair.txt"), "1\n0\n1 0 1.0\n");
    assert_refused(folder.path(), &["pair.txt, line 3", "source of itself"]);
    std::fs::remove_file(folder.path().join("images/00000005.jpg")).unwrap();
    assert_refused(folder.path(), &["images/00000005", "no such file", "00000005_cam.txt"]);
}
