//! OpenSfM's reconstructions.

use crate::*;
use serde_json::{Map, Value, json};
use skep::geometry::Distortion;
use tempfile::{TempDir, tempdir};

/// A reconstruction of the first shots of the board.
fn reconstruction(count: usize) -> Value {
    let ColmapModel { images, points } = model();
    let camera = images[0].camera;
    let mut shots = Map::new();
    for ModelImage { name, camera } in &images[..count] {
        let rotation = glam::DQuat::from_mat3(&camera.rotation).to_scaled_axis().to_array();
        let translation = camera.translation.to_array();
        let shot =
            json!({"camera": "phone", "rotation": rotation, "translation": translation, "gps_dop": 5.0});
        shots.insert(name.clone(), shot);
    }
    let point = |(index, point): (usize, &SparsePoint)| {
        let entry = json!({"color": [1.0, 2.0, 3.0], "coordinates": point.position.to_array()});
        (format!("{index:04}"), entry)
    };
    json!({
        "cameras": {"phone": {
            "projection_type": "brown", "width": 640, "height": 360,
            "focal_x": camera.fx / 640.0, "focal_y": camera.fy / 640.0,
            "c_x": (camera.cx - 319.5) / 640.0, "c_y": (camera.cy - 179.5) / 640.0,
            "k1": 0.0, "k2": 0.0, "k3": 0.0, "p1": 0.0, "p2": 0.0,
        }},
        "shots": shots,
        "points": points.iter().enumerate().map(point).collect::<Map<_, _>>(),
        "reference_lla": {"latitude": 47.0, "longitude": 8.0, "altitude": 400.0},
    })
}

fn tracks() -> String {
    let ColmapModel { images, points } = model();
    let mut lines = String::from("OPENSFM_TRACKS_VERSION_v2\n");
    for (index, point) in points.iter().enumerate() {
        for &view in &point.views {
            let name = &images[view as usize].name;
            lines += &format!("{name}\t{index:04}\t{index}\t0.1\t-0.2\t0.005\t1\t2\t3\t-1\t-1\n");
        }
    }
    // A track that became no point, and a shot that was not reconstructed.
    lines + "key.jpg\t9999\t7\t0\t0\t0.1\t1\t2\t3\t-1\t-1\nlost.jpg\t0001\t7\t0\t0\t0.1\t1\t2\t3\t-1\t-1\n"
}

fn scene(content: &Value) -> TempDir {
    let folder = tempdir().unwrap();
    copy_photographs(&folder.path().join("images"));
    write(&folder.path().join("reconstruction.json"), content.to_string());
    folder
}

#[test]
fn the_scene_is_read_with_and_without_tracks() {
    let folder = scene(&json!([reconstruction(7)]));
    let scene = read(folder.path()).unwrap();
    assert_cameras(&scene);
    assert_points(&scene.points, false, 1e-12);
    write(&folder.path().join("tracks.csv"), tracks());
    let scene = read(&folder.path().join("reconstruction.json")).unwrap();
    assert_cameras(&scene);
    assert_points(&scene.points, true, 1e-12);
    assert!(scene.warnings.is_empty());
}

#[test]
fn a_project_of_opendronemap_is_read() {
    let folder = tempdir().unwrap();
    copy_photographs(&folder.path().join("images"));
    write(&folder.path().join("opensfm/reconstruction.json"), json!([reconstruction(7)]).to_string());
    for path in ["", "opensfm"] {
        assert_cameras(&read(&folder.path().join(path)).unwrap());
    }
}

#[test]
fn of_several_reconstructions_the_largest_is_read() {
    let folder = scene(&json!([reconstruction(2), reconstruction(7), reconstruction(3)]));
    let scene = read(folder.path()).unwrap();
    assert_cameras(&scene);
    let warning = scene.warnings.join("");
    assert!(warning.contains("3 reconstructions, of 2, 7, 3 shots") && warning.contains("[1]"), "{warning}");
}

#[test]
fn lenses_are_opensfms() {
    let lens = |camera: Value| {
        let mut content = reconstruction(7);
        content["cameras"]["phone"] = camera;
        read(scene(&json!([content])).path()).unwrap().photographs[0].lens
    };
    let perspective = json!({"projection_type": "perspective", "width": 640, "height": 360, "focal": 0.75,
        "k1": 0.01, "k2": 0.02});
    let Lens { camera, distortion } = lens(perspective);
    assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (480.0, 480.0, 319.5, 179.5));
    assert_eq!(distortion, Some(Distortion::brown(&[0.01, 0.02], [0.0; 2])));
    let fisheye =
        json!({"projection_type": "fisheye", "width": 640, "height": 360, "focal": 0.75, "k1": 0.1});
    assert_eq!(lens(fisheye).distortion, Some(Distortion::fisheye(&[0.1])));
    let opencv = json!({"projection_type": "fisheye_opencv", "width": 640, "height": 360, "focal_x": 0.75,
        "focal_y": 0.5, "c_x": 0.25, "k1": 0.1, "k4": 0.4});
    let Lens { camera, distortion } = lens(opencv);
    assert_eq!((camera.fy, camera.cx), (320.0, 479.5));
    assert_eq!(distortion, Some(Distortion::fisheye(&[0.1, 0.0, 0.0, 0.4])));
    let brown = json!({"projection_type": "brown", "width": 640, "height": 360, "focal_x": 0.75,
        "focal_y": 0.75, "k1": 0.1, "k2": 0.2, "k3": 0.3, "p1": 0.4, "p2": 0.5});
    assert_eq!(lens(brown).distortion, Some(Distortion::brown(&[0.1, 0.2, 0.3], [0.4, 0.5])));
}

#[test]
fn what_is_wrong_is_named() {
    let changed = |change: fn(&mut Value)| {
        let mut content = reconstruction(7);
        change(&mut content);
        scene(&json!([content]))
    };
    let projection =
        |content: &mut Value| content["cameras"]["phone"]["projection_type"] = json!("spherical");
    let shot = |content: &mut Value| content["shots"]["source2.jpg"]["rotation"] = json!([1.0, 2.0]);
    let focal = |content: &mut Value| content["cameras"]["phone"]["focal_y"] = json!(0);
    let point = |content: &mut Value| content["points"]["0003"]["coordinates"] = json!([1, 2, "3"]);
    let camera = |content: &mut Value| content["shots"]["key.jpg"]["camera"] = json!("other");
    let missing = |content: &mut Value| {
        let shot = content["shots"]["key.jpg"].clone();
        content["shots"]["lost.jpg"] = shot;
    };
    let cases: [(TempDir, &[&str]); 6] = [
        (
            changed(projection),
            &["cameras.phone.projection_type is \"spherical\"", "fisheye_opencv", "panoramas"],
        ),
        (changed(shot), &["shots.source2.jpg.rotation is [1.0,2.0]", "3 numbers"]),
        (changed(focal), &["cameras.phone.fy is 0"]),
        (changed(point), &["points.0003.coordinates[2] is \"3\"", "a number"]),
        (changed(camera), &["shots.key.jpg.camera is \"other\"", "one of the cameras"]),
        (changed(missing), &["lost.jpg", "no such file", "shots.lost.jpg"]),
    ];
    for (folder, words) in cases {
        assert_refused(folder.path(), words);
    }
    assert_refused(scene(&json!([])).path(), &["the file is []", "one reconstruction or more"]);
    assert_refused(scene(&reconstruction(2)).path(), &["expected a list"]);
    let folder = scene(&json!([reconstruction(7)]));
    write(&folder.path().join("tracks.csv"), "key.jpg 1 2\n");
    assert_refused(folder.path(), &["tracks.csv, line 1", "3 columns"]);
}
