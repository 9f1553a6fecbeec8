//! COLMAP models, text and binary.

use crate::{assert_refused, camera, model, rewrite};
use glam::DMat3;
use skep::Result;
use skep::geometry::Distortion;
use skep::io::{ColmapModel, ModelImage};
use std::fs::{read_to_string, remove_file, write};
use std::path::Path;
use tempfile::tempdir;

const CAMERAS: &str = "# comment\n\n3 PINHOLE 6 4 8 8.25 3 2.25\n9 SIMPLE_PINHOLE 5 3 7 2.5 1.5\n";
const IMAGES: &str = "# comment\n\
    12 2 0 0 0 1 2 3 9 second in order.png\n\n\
    4 1 0 0 0 -1 0 0.5 3 cam1/first.png\n1.5 2.5 -1 0.5 0.5 7\n";
const POINTS: &str = "7 0.5 -0.25 4 1 2 3 0.1 4 1 12 0 4 0\n";

/// A text model of the three files' contents.
fn read_texts(cameras: &str, images: &str, points: &str) -> Result<ColmapModel> {
    let folder = tempdir().unwrap();
    write(folder.path().join("cameras.txt"), cameras).unwrap();
    write(folder.path().join("images.txt"), images).unwrap();
    write(folder.path().join("points3D.txt"), points).unwrap();
    ColmapModel::read(folder.path())
}

/// The binary model of `model()` after a change of one file.
fn read_changed(file: &str, change: impl FnOnce(&mut Vec<u8>)) -> Result<ColmapModel> {
    let folder = tempdir().unwrap();
    model().write_binary(folder.path()).unwrap();
    rewrite(&folder.path().join(file), change);
    ColmapModel::read(folder.path())
}

fn assert_close(a: &ColmapModel, b: &ColmapModel) {
    assert_eq!(a.points, b.points);
    assert_eq!(a.images.len(), b.images.len());
    for (a, b) in a.images.iter().zip(&b.images) {
        let difference = a.camera.rotation - b.camera.rotation;
        assert!(difference.to_cols_array().iter().all(|e| e.abs() < 1e-12));
        let unturned = |image: &ModelImage| ModelImage {
            camera: skep::geometry::Camera { rotation: DMat3::IDENTITY, ..image.camera },
            ..image.clone()
        };
        assert_eq!(unturned(a), unturned(b));
    }
}

#[test]
fn text_is_read_in_the_order_of_the_file() {
    let model = read_texts(CAMERAS, IMAGES, POINTS).unwrap();
    let names: Vec<_> = model.images.iter().map(|image| image.name.as_str()).collect();
    assert_eq!(names, ["second in order.png", "cam1/first.png"]);
    assert_eq!(model.points[0].views, [0, 1], "ids become indices, each once");
    assert_eq!(model.points[0].position.to_array(), [0.5, -0.25, 4.0]);
    assert_eq!(model.images[0].camera.rotation, DMat3::IDENTITY, "the quaternion is normalized");
    assert_eq!(model.images[0].camera.translation.to_array(), [1.0, 2.0, 3.0]);
}

#[test]
fn text_moves_the_principal_point_by_half_a_pixel() {
    let model = read_texts(CAMERAS, IMAGES, POINTS).unwrap();
    let simple = model.images[0].camera;
    assert_eq!((simple.width, simple.height), (5, 3));
    assert_eq!((simple.fx, simple.fy, simple.cx, simple.cy), (7.0, 7.0, 2.0, 1.0));
    let full = model.images[1].camera;
    assert_eq!((full.fx, full.fy, full.cx, full.cy), (8.0, 8.25, 2.5, 1.75));

    let folder = tempdir().unwrap();
    model.write_text(folder.path()).unwrap();
    let written = read_to_string(folder.path().join("cameras.txt")).unwrap();
    assert!(written.contains("1 PINHOLE 5 3 7 7 2.5 1.5\n"), "{written}");
}

#[test]
fn binary_moves_the_principal_point_by_half_a_pixel() {
    let folder = tempdir().unwrap();
    model().write_binary(folder.path()).unwrap();
    let bytes = std::fs::read(folder.path().join("cameras.bin")).unwrap();
    // Count, id, model, width, height, fx, fy, cx, cy.
    assert_eq!(bytes.len(), 8 + 4 + 4 + 8 + 8 + 4 * 8, "images of one calibration share a camera");
    assert_eq!(bytes[48..56], 3.0f64.to_le_bytes());
    assert_eq!(bytes[56..64], 2.25f64.to_le_bytes());
    assert_eq!(ColmapModel::read(folder.path()).unwrap().images[0].camera.cx, 2.5);
}

#[test]
fn a_feature_lies_half_a_pixel_further_in_the_file() {
    let folder = tempdir().unwrap();
    let mut model = model();
    model.points.truncate(1);
    // The ray of pixel (1, 2).
    let camera = model.images[0].camera;
    model.points[0].position = camera.unproject(glam::DVec2::new(1.0, 2.0), 8.0);
    model.write_text(folder.path()).unwrap();
    let text = read_to_string(folder.path().join("images.txt")).unwrap();
    let features = text.lines().nth(3).unwrap();
    let numbers: Vec<f64> = features.split(' ').map(|word| word.parse().unwrap()).collect();
    assert!((numbers[0] - 1.5).abs() < 1e-9 && (numbers[1] - 2.5).abs() < 1e-9, "{features}");
}

#[test]
fn text_and_binary_say_the_same() {
    let (text, binary) = (tempdir().unwrap(), tempdir().unwrap());
    model().write_text(text.path()).unwrap();
    model().write_binary(binary.path()).unwrap();
    let (text, binary) = (ColmapModel::read(text.path()).unwrap(), ColmapModel::read(binary.path()).unwrap());
    assert_eq!(text, binary);
    assert_close(&text, &model());
}

#[test]
fn binary_files_come_before_text_files() {
    let folder = tempdir().unwrap();
    model().write_binary(folder.path()).unwrap();
    write(folder.path().join("cameras.txt"), CAMERAS).unwrap();
    write(folder.path().join("images.txt"), IMAGES).unwrap();
    assert_close(&ColmapModel::read(folder.path()).unwrap(), &model());
}

#[test]
fn a_model_without_points_has_none() {
    for text in [true, false] {
        let folder = tempdir().unwrap();
        let model = model();
        if text { model.write_text(folder.path()) } else { model.write_binary(folder.path()) }.unwrap();
        remove_file(folder.path().join(if text { "points3D.txt" } else { "points3D.bin" })).unwrap();
        let read = ColmapModel::read(folder.path()).unwrap();
        assert_eq!((read.images.len(), read.points.len()), (2, 0));
    }
}

#[test]
fn an_empty_last_line_may_be_cut() {
    let images = IMAGES.rsplit_once("1.5 2.5").unwrap().0.trim_end();
    assert_eq!(read_texts(CAMERAS, images, POINTS).unwrap().images.len(), 2);
}

#[test]
fn windows_line_ends_are_no_part_of_names() {
    let images = IMAGES.replace('\n', "\r\n");
    assert_eq!(read_texts(CAMERAS, &images, POINTS).unwrap(), read_texts(CAMERAS, IMAGES, POINTS).unwrap());
}

#[test]
fn distortion_is_read_only_where_it_is_asked_for() {
    let command = "image_undistorter";
    let opencv = |k1: &str| {
        CAMERAS.replace("3 PINHOLE 6 4 8 8.25 3 2.25", &format!("3 OPENCV 6 4 8 8.25 3 2.25 {k1} 0 0 0"))
    };
    assert_eq!(
        read_texts(&opencv("0"), IMAGES, POINTS),
        read_texts(CAMERAS, IMAGES, POINTS),
        "no distortion"
    );
    let folder = tempdir().unwrap();
    write(folder.path().join("cameras.txt"), opencv("0.1")).unwrap();
    write(folder.path().join("images.txt"), IMAGES).unwrap();
    let (model, lenses) = ColmapModel::read_with_lenses(folder.path()).unwrap();
    assert_eq!(model.images, read_texts(CAMERAS, IMAGES, POINTS).unwrap().images);
    assert_eq!(lenses, [None, Some(Distortion::brown(&[0.1], [0.0; 2]))]);
    let cameras = opencv("0.1");
    let parts = ["cameras.txt, line 3", "camera 3", "OPENCV", "PINHOLE", command];
    assert_refused(read_texts(&cameras, IMAGES, POINTS), &parts);
    let number = |number: u32| {
        read_changed("cameras.bin", move |bytes| bytes[12..16].copy_from_slice(&number.to_le_bytes()))
    };
    assert_refused(number(2), &["cameras.bin", "camera 1", "SIMPLE_RADIAL", command]);
    assert_refused(number(4_000_000_000), &["number 4000000000", "THIN_PRISM_FISHEYE"]);
}

#[test]
fn broken_text_is_refused_with_its_line() {
    let cases = [
        ("3 PINHOLE 6 4", "3 PINHOLE 0 4", "cameras.txt, line 3", "width is 0"),
        ("3 PINHOLE 6 4", "3 PINHOLE 6 99999999999", "cameras.txt, line 3", "height"),
        ("3 PINHOLE 6 4", "3 PINHOLE 6 -4", "cameras.txt, line 3", "-4"),
        ("8 8.25", "NaN 8.25", "cameras.txt, line 3", "finite"),
        ("8 8.25", "8 0", "cameras.txt, line 3", "fy"),
        ("3 2.25", "3", "cameras.txt, line 3", "ends before the camera's parameters"),
        ("3 2.25", "3 2.25 0.1", "cameras.txt, line 3", "0.1"),
        ("9 SIMPLE", "3 SIMPLE", "cameras.txt, line 4", "camera 3 occurs twice"),
        ("12 2 0 0 0", "12 0 0 0 0", "images.txt, line 2", "quaternion"),
        ("12 2 0 0 0", "12 NaN 0 0 0", "images.txt, line 2", "quaternion"),
        ("1 2 3 9", "1 2 inf 9", "images.txt, line 2", "translation"),
        ("1 2 3 9", "1 2 3 8", "images.txt, line 2", "camera 8"),
        ("12 2 0", "4 2 0", "images.txt, line 4", "image 4 occurs twice"),
        ("cam1/first.png", "second in order.png", "images.txt, line 4", "second in order.png occurs twice"),
        ("cam1/first.png", "", "images.txt, line 4", "name is \"\""),
        ("cam1/first.png", "../first.png", "images.txt, line 4", ".."),
        ("cam1/first.png", "/first.png", "images.txt, line 4", "below the folder"),
        ("0.5 0.5 7", "0.5 0.5", "images.txt, line 5", "point id"),
        ("second in order.png\n", "second in order.png", "images.txt, line 3", "first.png"),
        ("7 0.5 -0.25", "7 nan -0.25", "points3D.txt, line 1", "position"),
        ("12 0 4 0", "13 0 4 0", "points3D.txt, line 1", "image 13"),
        ("12 0 4 0", "12 0 4", "points3D.txt, line 1", "ends before"),
    ];
    for (from, to, place, problem) in cases {
        let texts = [CAMERAS, IMAGES, POINTS].map(|text| text.replacen(from, to, 1));
        assert!(texts != [CAMERAS, IMAGES, POINTS], "{from:?} is not there");
        assert_refused(read_texts(&texts[0], &texts[1], &texts[2]), &[place, problem]);
    }
}

#[test]
fn every_cut_binary_file_is_refused() {
    for file in ["cameras.bin", "images.bin", "points3D.bin"] {
        let folder = tempdir().unwrap();
        model().write_binary(folder.path()).unwrap();
        let path = folder.path().join(file);
        let whole = std::fs::read(&path).unwrap();
        for end in 0..whole.len() {
            write(&path, &whole[..end]).unwrap();
            assert_refused(ColmapModel::read(folder.path()), &[file, "truncated"]);
        }
        assert_refused(read_changed(file, |bytes| bytes.push(0)), &[file, "1 bytes too many"]);
        let huge = |bytes: &mut Vec<u8>| bytes[..8].copy_from_slice(&u64::MAX.to_le_bytes());
        assert_refused(read_changed(file, huge), &[file, "truncated"]);
    }
}

#[test]
fn broken_binary_numbers_are_refused() {
    let nan = f64::NAN.to_le_bytes();
    assert_refused(
        read_changed("cameras.bin", |b| b[32..40].copy_from_slice(&nan)),
        &["cameras.bin", "finite"],
    );
    assert_refused(read_changed("cameras.bin", |b| b[16..24].fill(0)), &["cameras.bin", "width is 0"]);
    assert_refused(read_changed("cameras.bin", |b| b[16..24].fill(255)), &["cameras.bin", "width"]);
    assert_refused(
        read_changed("images.bin", |b| b[12..20].copy_from_slice(&nan)),
        &["images.bin", "quaternion"],
    );
    assert_refused(read_changed("images.bin", |b| b[68..72].fill(7)), &["images.bin", "camera"]);
    assert_refused(read_changed("images.bin", |b| b[72] = 0xff), &["images.bin", "UTF-8"]);
    assert_refused(
        read_changed("points3D.bin", |b| b[16..24].copy_from_slice(&nan)),
        &["points3D.bin", "finite"],
    );
    // Count, id, position, color, error, length of the track, then its first image.
    assert_refused(
        read_changed("points3D.bin", |b| b[59..63].fill(9)),
        &["points3D.bin", "point 1", "image"],
    );
}

#[test]
fn empty_models_and_empty_folders_are_refused() {
    assert_refused(read_texts(CAMERAS, "# nothing\n", ""), &["images.txt", "no image"]);
    assert_refused(read_texts("", IMAGES, ""), &["images.txt, line 2", "camera 9"]);
    let folder = tempdir().unwrap();
    let parts = ["cameras.bin", "images.bin", "cameras.txt", "images.txt"];
    assert_refused(ColmapModel::read(folder.path()), &parts);
    assert!(!ColmapModel::is_in(Path::new("no such folder")));
}

#[test]
fn half_turns_keep_their_pose() {
    let folder = tempdir().unwrap();
    let mut half_turns = model();
    half_turns.images[0].camera.rotation = DMat3::from_diagonal(glam::DVec3::new(-1.0, -1.0, 1.0));
    half_turns.images[1].camera.rotation = DMat3::from_diagonal(glam::DVec3::new(1.0, -1.0, -1.0));
    half_turns.images.push(ModelImage { name: "third.png".to_owned(), camera: camera(1.0) });
    half_turns.write_binary(folder.path()).unwrap();
    assert_close(&ColmapModel::read(folder.path()).unwrap(), &half_turns);
}

#[test]
fn text_of_other_encodings_is_read_or_refused_with_its_line() {
    let folder = tempdir().unwrap();
    model().write_text(folder.path()).unwrap();
    let (cameras, images) = (folder.path().join("cameras.txt"), folder.path().join("images.txt"));
    for file in [&cameras, &images, &folder.path().join("points3D.txt")] {
        rewrite(file, |bytes| drop(bytes.splice(0..0, [0xef, 0xbb, 0xbf])));
    }
    assert_eq!(ColmapModel::read(folder.path()).unwrap().images.len(), 2, "with byte order marks");

    let text = std::fs::read_to_string(&images).unwrap();
    let units = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
    std::fs::write(&images, units(&text)).unwrap();
    assert_refused(ColmapModel::read(folder.path()), &["images.txt, line 1", "UTF-16", "save it as UTF-8"]);
    std::fs::write(&images, units(text.trim_start_matches('\u{feff}'))).unwrap();
    assert_refused(ColmapModel::read(folder.path()), &["images.txt, line 1", "UTF-16", "save it as UTF-8"]);
    let latin = text.replace("left.png", "l?ft.png");
    let latin: Vec<u8> = latin.bytes().map(|byte| if byte == b'?' { 0xe9 } else { byte }).collect();
    std::fs::write(&images, latin).unwrap();
    assert_refused(ColmapModel::read(folder.path()), &["images.txt, line 3", "0xe9 is not UTF-8", "Latin-1"]);
}

#[test]
fn cameras_beyond_sensible_bounds_are_refused_with_the_bounds() {
    let refused = |change: &dyn Fn(&mut skep::geometry::Camera), parts: &[&str]| {
        let folder = tempdir().unwrap();
        let mut model = model();
        model.images.iter_mut().for_each(|image| change(&mut image.camera));
        model.points.clear();
        model.write_text(folder.path()).unwrap();
        assert_refused(ColmapModel::read(folder.path()), parts);
    };
    refused(&|camera| camera.fx = 1e-30, &["cameras.txt, line", "fx", "0.001 to 1e9"]);
    refused(&|camera| camera.fy = 1e30, &["cameras.txt, line", "fy", "0.001 to 1e9"]);
    refused(&|camera| camera.cx = -1e30, &["cameras.txt, line", "cx", "-1e9 to 1e9"]);
    refused(&|camera| camera.translation.y = 1e134, &["images.txt, line", "translation", "1e18"]);
}
