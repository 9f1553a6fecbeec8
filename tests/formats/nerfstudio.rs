//! transforms.json of nerfstudio and instant-ngp.

use crate::*;
use glam::DMat4;
use serde_json::{Value, json};
use skep::geometry::Distortion;
use tempfile::{TempDir, tempdir};

/// The camera-to-world matrix with OpenGL's axes, as rows.
fn matrix(camera: &Camera) -> Value {
    let flip = DMat4::from_diagonal(glam::DVec4::new(1.0, -1.0, -1.0, 1.0));
    let pose = DMat4::from_mat3_translation(camera.rotation, camera.translation);
    json!((pose.inverse() * flip).transpose().to_cols_array_2d())
}

fn content() -> Value {
    let ColmapModel { images, .. } = model();
    let camera = images[0].camera;
    let frame = |ModelImage { name, camera }: &ModelImage| {
        let path = format!("./images/{name}");
        json!({"file_path": path, "transform_matrix": matrix(camera)})
    };
    json!({
        "camera_model": "OPENCV", "fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx + 0.5,
        "cy": camera.cy + 0.5, "w": 640, "h": 360, "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0,
        "frames": images.iter().map(frame).collect::<Vec<_>>(),
    })
}

fn ply(points: &[SparsePoint]) -> String {
    let vertex = |point: &SparsePoint| format!("{} 1 2 3\n", words(&point.position.to_array()));
    let properties = "property double x\nproperty double y\nproperty double z\nproperty uchar red\n\
                      property uchar green\nproperty uchar blue\n";
    let count = points.len();
    let vertices: String = points.iter().map(vertex).collect();
    format!("ply\nformat ascii 1.0\nelement vertex {count}\n{properties}end_header\n{vertices}")
}

fn scene(content: &Value) -> TempDir {
    let folder = tempdir().unwrap();
    copy_photographs(&folder.path().join("images"));
    write(&folder.path().join("transforms.json"), content.to_string());
    folder
}

/// The content with a change.
fn changed(change: impl FnOnce(&mut Value)) -> Value {
    let mut content = content();
    change(&mut content);
    content
}

#[test]
fn the_scene_is_read_from_the_folder_and_the_file() {
    let folder = scene(&changed(|content| content["ply_file_path"] = json!("sparse_pc.ply")));
    write(&folder.path().join("sparse_pc.ply"), ply(&model().points));
    for path in ["", "transforms.json"] {
        let scene = read(&folder.path().join(path)).unwrap();
        assert_cameras(&scene);
        assert_points(&scene.points, false, 0.0);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }
}

#[test]
fn endings_sizes_and_centers_may_be_missing_and_an_angle_is_a_focal_length() {
    let folder = scene(&changed(|content| {
        for key in ["w", "h", "cx", "cy", "fl_x", "fl_y"] {
            content.as_object_mut().unwrap().remove(key);
        }
        content["camera_angle_x"] = json!(2.0 * (320.0_f64 / 500.0).atan());
        content["frames"][0]["file_path"] = json!("images/key");
        // An entry of a frame comes before that of the file.
        content["frames"][1]["fl_x"] = json!(450.0);
    }));
    let scene = read(folder.path()).unwrap();
    assert_eq!(scene.photographs[0].name, "key.jpg");
    let cameras: Vec<Camera> = scene.photographs.iter().map(|photograph| photograph.lens.camera).collect();
    assert!((cameras[0].fx - 500.0).abs() < 1e-9 && cameras[0].fx == cameras[0].fy);
    assert_eq!((cameras[0].width, cameras[0].cx, cameras[0].cy), (640, 319.5, 179.5));
    assert_eq!(cameras[1].fx, 450.0);
}

#[test]
fn lenses_are_opencvs() {
    let lens = |change: fn(&mut Value)| {
        let folder = scene(&changed(change));
        read(folder.path()).unwrap().photographs[0].lens.distortion
    };
    let brown = |content: &mut Value| {
        (content["k1"], content["k2"], content["k3"]) = (json!(0.1), json!(0.02), json!(0.003));
        (content["p1"], content["p2"]) = (json!(1e-3), json!(-2e-3));
    };
    assert_eq!(lens(brown), Some(Distortion::brown(&[0.1, 0.02, 0.003], [1e-3, -2e-3])));
    let fisheye = |content: &mut Value| {
        content["camera_model"] = json!("OPENCV_FISHEYE");
        (content["k1"], content["k4"]) = (json!(0.1), json!(0.02));
    };
    assert_eq!(lens(fisheye), Some(Distortion::fisheye(&[0.1, 0.0, 0.0, 0.02])));
    assert_eq!(lens(|content| content["camera_model"] = json!("PINHOLE")), None);
}

#[test]
fn masks_are_read() {
    let folder = scene(&changed(|content| content["frames"][2]["mask_path"] = json!("masks/2.png")));
    assert_refused(folder.path(), &["masks/2.png", "no such file", "frames[2].mask_path"]);
    write_photographs(folder.path(), &["masks/2.png"], (640, 360));
    let scene = read(folder.path()).unwrap();
    assert_eq!(scene.photographs[2].mask, Some(folder.path().join("masks/2.png")));
    assert_eq!(scene.photographs[1].mask, None);
}

#[test]
fn photographs_outside_the_folder_get_names_below_the_folder_that_holds_all() {
    let folder = tempdir().unwrap();
    copy_photographs(&folder.path().join("photographs"));
    let mut content = content();
    for frame in content["frames"].as_array_mut().unwrap() {
        let path = frame["file_path"].as_str().unwrap().replace("./images/", "../../photographs/");
        frame["file_path"] = json!(path);
    }
    write(&folder.path().join("a/b/transforms.json"), content.to_string());
    assert_cameras(&read(&folder.path().join("a/b")).unwrap());
}

#[test]
fn a_cloud_in_the_frame_before_the_transform_is_moved() {
    // World rotated by nerfstudio's transform: (x, y, z) -> (x, z, -y).
    let to = |point: DVec3| DVec3::new(point.x, point.z, -point.y);
    let turn = glam::DMat3::from_cols(to(DVec3::X), to(DVec3::Y), to(DVec3::Z));
    let rows = json!([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0]]);
    let content = changed(|content| {
        content["ply_file_path"] = json!("points.ply");
        content["applied_transform"] = rows;
        for (frame, image) in content["frames"].as_array_mut().unwrap().iter_mut().zip(model().images) {
            let camera = Camera { rotation: image.camera.rotation * turn.transpose(), ..image.camera };
            frame["transform_matrix"] = matrix(&camera);
        }
    });
    let folder = scene(&content);
    let mut moved = model().points;
    moved.iter_mut().for_each(|point| point.position = to(point.position));
    for (points, warnings) in [(&moved, 0), (&model().points, 1)] {
        write(&folder.path().join("points.ply"), ply(points));
        let scene = read(folder.path()).unwrap();
        assert_eq!(scene.warnings.len(), warnings, "{:?}", scene.warnings);
        assert!(scene.points.iter().zip(&moved).all(|(a, b)| a.position.distance(b.position) < 1e-12));
    }
}

/// `data/nerfstudio-1.1` was written by nerfstudio 1.1.5 from `data/colmap-4.2`.
#[test]
fn a_file_of_nerfstudio_says_what_its_model_says() {
    let folder = tempdir().unwrap();
    let names = ["left/0.png", "left/1.png", "right/0.png", "right/1.png"];
    write_photographs(&folder.path().join("images"), &names, (64, 48));
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/data");
    for file in ["transforms.json", "sparse_pc.ply"] {
        write(&folder.path().join(file), std::fs::read(data.join("nerfstudio-1.1").join(file)).unwrap());
    }
    let scene = read(folder.path()).unwrap();
    let sparse = data.join("colmap-4.2/sparse/0");
    let (model, distortions) = ColmapModel::read_with_lenses(&sparse).unwrap();
    assert_eq!((scene.photographs.len(), scene.warnings.len()), (4, 0), "{:?}", scene.warnings);
    for (image, distortion) in model.images.iter().zip(distortions) {
        let found = scene.photographs.iter().find(|photograph| photograph.name == image.name).unwrap();
        assert_eq!(found.lens.distortion, distortion);
        for (point, expected) in scene.points.iter().zip(&model.points) {
            let (pixel, depth) = found.lens.camera.project(point.position).unwrap();
            let (expected_pixel, expected_depth) = image.camera.project(expected.position).unwrap();
            // The cloud is written with six decimals.
            assert!(pixel.distance(expected_pixel) < 1e-4 && (depth - expected_depth).abs() < 2e-6);
        }
    }
}

#[test]
fn what_is_wrong_is_named() {
    let frame = |change: fn(&mut Value)| changed(|content| change(&mut content["frames"][3]));
    let cases = [
        (changed(|content| content["camera_model"] = json!("EQUIRECTANGULAR")), &["EQUIRECTANGULAR"][..]),
        (changed(|content| content["k4"] = json!(0.1)), &["k4 is 0.1", "expected 0"]),
        (changed(|content| content["fl_x"] = json!("wide")), &["fl_x is \"wide\"", "expected a number"]),
        (changed(|content| content["fl_x"] = json!(-3)), &["frames[0].fx is -3"]),
        (changed(|content| content["w"] = json!(320)), &["key.jpg", "640x360", "320x360", "frames[0]"]),
        (changed(|content| content["w"] = json!(320.5)), &["w is 320.5", "whole number"]),
        (changed(|content| content["frames"] = json!([])), &["expected 2 or more"]),
        (changed(|content| content["frames"] = json!(4)), &["frames is 4", "expected a list"]),
        (
            frame(|frame| frame["file_path"] = json!("images/9")),
            &["images/9", ".jpeg", "frames[3].file_path"],
        ),
        (frame(|frame| frame["file_path"] = json!("images/key.jpg")), &["photograph of two entries"]),
        (
            frame(|frame| frame["transform_matrix"][1][1] = json!(2)),
            &["frames[3].transform_matrix", "rotation"],
        ),
        (
            frame(|frame| frame["transform_matrix"][1] = json!([1])),
            &["transform_matrix[1] is [1]", "4 numbers"],
        ),
        (
            frame(|frame| frame["transform_matrix"] = json!(null)),
            &["frames[3] has no entry \"transform_matrix\""],
        ),
    ];
    for (content, words) in cases {
        assert_refused(scene(&content).path(), words);
    }
    let folder = scene(&content());
    let path = folder.path().join("transforms.json");
    let text = std::fs::read_to_string(&path).unwrap();
    write(&path, text.replacen("\"k1\":0.0", "\"k1\":NaN", 1));
    assert_refused(folder.path(), &["transforms.json", "no JSON", "line 1"]);
    write(&path, changed(|content| content["ply_file_path"] = json!("p.ply")).to_string());
    write(&folder.path().join("p.ply"), ply(&model().points).replace("vertex 297", "vertex 298"));
    assert_refused(folder.path(), &["p.ply", "fewer than 298"]);
    write(&folder.path().join("p.ply"), ply(&model().points).replace("double z", "double w"));
    assert_refused(folder.path(), &["p.ply", "vertex 0", "expected finite"]);
}

#[test]
fn poses_with_opencvs_axes_are_named() {
    let content = changed(|content| {
        content["ply_file_path"] = json!("points.ply");
        for (frame, image) in content["frames"].as_array_mut().unwrap().iter_mut().zip(model().images) {
            let pose = DMat4::from_mat3_translation(image.camera.rotation, image.camera.translation);
            frame["transform_matrix"] = json!(pose.inverse().transpose().to_cols_array_2d());
        }
    });
    let folder = scene(&content);
    write(&folder.path().join("points.ply"), ply(&model().points));
    assert_refused(
        folder.path(),
        &["look like camera-to-world with OpenCV's axes", "expected camera-to-world"],
    );
}
