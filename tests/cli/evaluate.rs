//! `skep evaluate`, on made data whose scores are known.

use super::{NAMES, failure, path, skep, small_board, text};
use image::{ImageBuffer, Luma};
use serde_json::Value;
use skep::geometry::Camera;
use skep::io::{ColmapModel, ModelImage, write_depth_map, write_normal_map, write_ply};
use skep::{PointCloud, SparsePoint};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const WIDTH: u32 = 20;
const HEIGHT: u32 = 10;
const PIXELS: usize = (WIDTH * HEIGHT) as usize;

fn camera(x: f64) -> Camera {
    Camera {
        width: WIDTH,
        height: HEIGHT,
        fx: 20.0,
        fy: 20.0,
        cx: 9.5,
        cy: 4.5,
        rotation: glam::DMat3::IDENTITY,
        translation: glam::DVec3::new(-x, 0.0, 0.0),
    }
}

/// Two views of the plane z = 2 with a model, the true depths of the first, and photographs of one gray.
fn made_scene() -> TempDir {
    let folder = TempDir::new().unwrap();
    let image = |name: &str, x: f64| ModelImage { name: name.to_owned(), camera: camera(x) };
    let images = vec![image("a.png", 0.0), image("b.png", 0.1)];
    let points = vec![SparsePoint { position: glam::DVec3::new(0.0, 0.0, 2.0), views: vec![0, 1] }];
    ColmapModel { images, points }.write_text(&folder.path().join("sparse")).unwrap();
    fs::create_dir_all(folder.path().join("images")).unwrap();
    for name in ["a.png", "b.png"] {
        let photograph = ImageBuffer::from_pixel(WIDTH, HEIGHT, Luma([100u8]));
        photograph.save(folder.path().join("images").join(name)).unwrap();
    }
    let truth = folder.path().join("gt/depth");
    fs::create_dir_all(&truth).unwrap();
    // The last row has no surface.
    let depth = ImageBuffer::from_fn(WIDTH, HEIGHT, |_, row| Luma([if row < 9 { 2000u16 } else { 0 }]));
    depth.save(truth.join("a.png")).unwrap();
    fs::write(folder.path().join("gt/scene.json"), r#"{"depth_scale": 0.001}"#).unwrap();
    folder
}

fn file(folder: &TempDir, name: &str) -> PathBuf {
    folder.path().join(name)
}

fn words(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

/// The scores of a call that succeeds.
fn scores(arguments: &[&str]) -> Value {
    let folder = TempDir::new().unwrap();
    let json = words(&file(&folder, "scores.json"));
    let output = skep(&[&["evaluate", "--json", &json], arguments].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(!output.stdout.is_empty(), "a table is printed");
    serde_json::from_slice(&fs::read(json).unwrap()).unwrap()
}

fn refused(arguments: &[&str]) -> (Option<i32>, String) {
    failure(&[&["evaluate"], arguments].concat())
}

fn close(value: &Value, expected: f64) {
    let found = value.as_f64().unwrap_or_else(|| panic!("{value} is no number"));
    assert!((found - expected).abs() < 1e-6, "{found}; expected {expected}");
}

fn cloud_of(positions: Vec<[f64; 3]>, color: impl Fn(usize) -> [u8; 3]) -> PointCloud {
    let colors = (0..positions.len()).map(color).collect();
    let normals = vec![[0.0, 0.0, -1.0]; positions.len()];
    PointCloud { positions, normals, colors, ..PointCloud::default() }
}

/// A square grid of 20 x 20 points a unit apart at a height.
fn plane(z: f64) -> Vec<[f64; 3]> {
    (0..400).map(|index| [f64::from(index % 20), f64::from(index / 20), z]).collect()
}

fn write_plane(folder: &TempDir, name: &str, z: f64) -> String {
    let path = file(folder, name);
    write_ply(&path, &cloud_of(plane(z), |_| [100; 3])).unwrap();
    words(&path)
}

#[test]
fn depth_maps_have_the_recall_and_precision_of_their_pixels() {
    let scene = made_scene();
    let maps = scene.path().join("dense/stereo");
    // Of 180 true pixels: 60 exact, 60 wrong by 0.4 %, 60 without estimate; 20 estimates without truth.
    let depth: Vec<f32> = (0..PIXELS)
        .map(|pixel| match pixel {
            0..60 => 2.0,
            60..120 => 2.008,
            120..180 => 0.0,
            _ => 3.0,
        })
        .collect();
    write_depth_map(&maps.join("depth_maps/a.png.geometric.bin"), WIDTH, HEIGHT, &depth).unwrap();
    // Normals are wrong by 60 degrees at the exact depths, and exact elsewhere.
    let tilted = [0.0, 0.75f32.sqrt(), -0.5];
    let normals: Vec<[f32; 3]> =
        (0..PIXELS).map(|pixel| if pixel < 61 { tilted } else { [0.0, 0.0, -1.0] }).collect();
    write_normal_map(&maps.join("normal_maps/a.png.geometric.bin"), WIDTH, HEIGHT, &normals).unwrap();
    fs::create_dir_all(file(&scene, "gt/normal")).unwrap();
    let facing = ImageBuffer::from_pixel(WIDTH, HEIGHT, image::Rgb([128u8, 128, 0]));
    facing.save(file(&scene, "gt/normal/a.png")).unwrap();

    let (dense, truth) = (words(&file(&scene, "dense")), words(&file(&scene, "gt")));
    let plots = words(&file(&scene, "plots"));
    let found = scores(&[&dense, "--truth", &truth, "--thresholds", "0.003,0.005", "--plots", &plots]);
    let found = &found["depth"];
    assert_eq!(found["maps"], 1);
    assert_eq!(found["views"].as_array().unwrap().len(), 1, "views without truth do not count");
    close(&found["fill"], 120.0 / 180.0);
    let [fine, coarse] = [&found["thresholds"][0], &found["thresholds"][1]];
    close(&fine["recall"], 60.0 / 180.0);
    close(&fine["precision"], 60.0 / 140.0);
    close(&fine["f"], 120.0 / 320.0);
    close(&coarse["recall"], 120.0 / 180.0);
    close(&coarse["precision"], 120.0 / 140.0);
    let angle = found["median_normal_angle"].as_f64().unwrap();
    assert!((angle - 60.0).abs() < 0.5, "{angle}");
    for name in ["depth-thresholds.svg", "depth-errors.svg", "depth-views.svg"] {
        let plot = fs::read_to_string(file(&scene, "plots").join(name)).unwrap();
        assert!(plot.starts_with("<svg") && plot.trim_end().ends_with("</svg>"), "{name}");
    }
}

#[test]
fn truth_of_other_programs_gives_the_same_scores() {
    let scene = made_scene();
    let dense = file(&scene, "dense");
    let map = vec![2.0f32; PIXELS];
    write_depth_map(&dense.join("stereo/depth_maps/a.png.photometric.bin"), WIDTH, HEIGHT, &map).unwrap();
    let truth = file(&scene, "truth");
    for (format, name) in [(skep::io::MapFormat::Npy, "a.npy"), (skep::io::MapFormat::Pfm, "a.png.pfm")] {
        fs::remove_dir_all(&truth).ok();
        let mut values = map.clone();
        values[..20].fill(f32::NAN);
        values[20..40].fill(-1.0);
        skep::io::write_float_map(&truth.join(name), format, (WIDTH, HEIGHT), 1, &values).unwrap();
        let found = scores(&[&words(&dense), "--truth", &words(&truth), "--kind", "raw"]);
        close(&found["depth"]["thresholds"][0]["recall"], 1.0);
        close(&found["depth"]["thresholds"][0]["precision"], 160.0 / 200.0);
    }
}

#[test]
fn wrong_truth_is_refused_with_its_name() {
    let scene = made_scene();
    let (dense, truth) = (words(&file(&scene, "dense")), words(&file(&scene, "gt")));
    let (status, printed) = refused(&[&dense, "--truth", &truth]);
    assert!(status == Some(2) && printed.contains("dense"), "no workspace: {printed}");
    let map = file(&scene, "dense/stereo/depth_maps/a.png.geometric.bin");
    write_depth_map(&map, 5, 4, &[1.0; 20]).unwrap();
    let (status, printed) = refused(&[&dense, "--truth", &truth]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("the map is 5x4; expected 20x10"), "{printed}");
    write_depth_map(&map, WIDTH, HEIGHT, &[1.0; PIXELS]).unwrap();
    fs::write(&map, [&b"20&10&1&"[..], &[0xff; 800]].concat()).unwrap();
    let (_, printed) = refused(&[&dense, "--truth", &truth]);
    assert!(printed.contains("column 0, row 0 is NaN"), "{printed}");
    fs::remove_file(file(&scene, "gt/scene.json")).unwrap();
    let (_, printed) = refused(&[&dense, "--truth", &truth]);
    assert!(printed.contains("a.png") && printed.contains("--depth-scale"), "{printed}");
    for (arguments, expected) in [
        (["--truth", &words(&file(&scene, "nowhere"))], "nowhere: no such file or folder"),
        (["--thresholds", "0"], "--thresholds is 0"),
        (["--depth-scale", "NaN"], "--depth-scale is NaN"),
        (["--voxel", "0"], "--voxel is 0"),
    ] {
        let given = if arguments[0] == "--truth" { vec![] } else { vec!["--truth", truth.as_str()] };
        let (status, printed) = refused(&[&[dense.as_str()], &given[..], &arguments[..]].concat());
        assert!(status == Some(2) && printed.contains(expected), "{arguments:?}: {printed}");
    }
    let (status, printed) = refused(&[&dense]);
    assert!(status == Some(2) && printed.contains("--truth DIR"), "{printed}");
}

#[test]
fn a_shifted_cloud_is_as_far_from_the_truth_as_it_was_shifted() {
    let folder = TempDir::new().unwrap();
    let (cloud, truth) = (write_plane(&folder, "a.ply", 0.25), write_plane(&folder, "b.ply", 0.0));
    let plots = words(&file(&folder, "plots"));
    let found =
        scores(&["--cloud", &cloud, "--truth-cloud", &truth, "--distances", "0.3,0.2", "--plots", &plots]);
    let found = &found["cloud"];
    for name in ["accuracy", "completeness", "overall"] {
        close(&found[name], 0.25);
    }
    close(&found["thresholds"][0]["f"], 0.0);
    close(&found["thresholds"][1]["f"], 1.0);
    assert!(file(&folder, "plots/cloud-thresholds.svg").is_file());

    // Moved back by a matrix, and only half of it.
    let matrix = file(&folder, "matrix.txt");
    fs::write(&matrix, "1 0 0 0\n0 1 0 0\n0 0 1 -0.25\n0 0 0 1\n").unwrap();
    let found = scores(&[
        "--cloud",
        &cloud,
        "--truth-cloud",
        &truth,
        "--transform",
        &words(&matrix),
        "--crop-box",
        "-1",
        "-1",
        "-1",
        "9.5",
        "20",
        "1",
    ]);
    close(&found["cloud"]["overall"], 0.0);
    assert_eq!(
        (&found["cloud"]["judged_points"], &found["cloud"]["truth_points"]),
        (&200.into(), &200.into())
    );
}

#[test]
fn distances_beyond_the_largest_are_clamped_or_dropped() {
    let folder = TempDir::new().unwrap();
    let truth = write_plane(&folder, "truth.ply", 0.0);
    let mut positions = plane(0.5);
    positions[0][2] = 100.0;
    let cloud = file(&folder, "cloud.ply");
    write_ply(&cloud, &cloud_of(positions, |_| [0; 3])).unwrap();
    let pair = ["--cloud", &words(&cloud), "--truth-cloud", &truth, "--max-distance", "2"];
    let clamped = scores(&pair);
    close(&clamped["cloud"]["accuracy"], (399.0 * 0.5 + 2.0) / 400.0);
    let dropped = scores(&[&pair[..], &["--outliers", "drop"]].concat());
    close(&dropped["cloud"]["accuracy"], 0.5);
}

#[test]
fn the_surface_of_true_maps_judges_a_cloud() {
    let scene = made_scene();
    let pixel = |index: usize| glam::DVec2::new((index % 20) as f64, (index / 20) as f64);
    let positions = (0..PIXELS).map(|index| camera(0.0).unproject(pixel(index), 2.1).to_array()).collect();
    let cloud = words(&file(&scene, "cloud.ply"));
    write_ply(Path::new(&cloud), &cloud_of(positions, |_| [0; 3])).unwrap();
    let (dense, truth) = (words(scene.path()), words(&file(&scene, "gt")));
    let arguments = [&dense, "--truth", &truth, "--cloud", &cloud, "--distances", "0.2"];
    let found = scores(&[&arguments[..], &["--min-views", "1"]].concat());
    assert!(found.get("depth").is_none(), "there are no maps");
    assert_eq!(found["cloud"]["truth_points"], 180);
    let completeness = found["cloud"]["completeness"].as_f64().unwrap();
    assert!((0.09..0.11).contains(&completeness), "{completeness}");
    let (status, printed) = refused(&[&arguments[..], &["--min-views", "2"]].concat());
    assert!(status == Some(1) && printed.contains("--min-views is 2"), "{printed}");
}

/// An array of a MATLAB file of version 5.
fn array(name: &str, size: &[i32], values: &[f64]) -> Vec<u8> {
    let part = |kind: u32, bytes: Vec<u8>| {
        let mut part = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
        part.extend(bytes);
        part.resize(part.len().next_multiple_of(8), 0);
        part
    };
    // Class 6 and type 9 are double.
    let flags = [6u32.to_le_bytes(), [0; 4]].concat();
    let size: Vec<u8> = size.iter().flat_map(|side| side.to_le_bytes()).collect();
    let values: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    let parts = [part(6, flags), part(5, size), part(1, name.as_bytes().to_vec()), part(9, values)];
    part(14, parts.concat())
}

fn write_matlab(path: &Path, arrays: &[Vec<u8>]) {
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0x00, 0x01, b'I', b'M']);
    bytes.extend(arrays.concat());
    fs::write(path, bytes).unwrap();
}

#[test]
fn masks_and_planes_of_dtu_choose_the_points_that_count() {
    let folder = TempDir::new().unwrap();
    // Half of the plane is too high by 1, the other half by 30.
    let positions = plane(0.0).into_iter().map(|[x, y, _]| [x, y, if x < 10.0 { 1.0 } else { 30.0 }]);
    let cloud = words(&file(&folder, "cloud.ply"));
    write_ply(Path::new(&cloud), &cloud_of(positions.collect(), |_| [0; 3])).unwrap();
    let truth = write_plane(&folder, "truth.ply", 0.0);
    // Voxels of 10 units around (0, 0, 0) and (10, 0, 0), of which the first column is observed below z = 15.
    let mask = file(&folder, "mask.mat");
    let voxels = [1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0];
    let corners = [0.0, 20.0, 0.0, 20.0, 0.0, 20.0];
    let arrays = [
        array("ObsMask", &[2, 3, 2], &voxels),
        array("BB", &[2, 3], &corners),
        array("Res", &[1, 1], &[10.0]),
    ];
    write_matlab(&mask, &arrays);
    // The truth counts where x > 4.5.
    let ground = file(&folder, "plane.mat");
    write_matlab(&ground, &[array("P", &[4, 1], &[1.0, 0.0, 0.0, -4.5])]);
    let (mask, ground) = (words(&mask), words(&ground));
    let pair = ["--cloud", cloud.as_str(), "--truth-cloud", truth.as_str(), "--dtu-mask", mask.as_str()];
    let found = scores(&[&pair[..], &["--dtu-plane", &ground]].concat());
    // x from 0 to 4 rounds to the first voxel; 5 rounds up.
    assert_eq!(found["cloud"]["judged_points"], 100);
    assert_eq!(found["cloud"]["truth_points"], 300);
    close(&found["cloud"]["accuracy"], 1.0);
    // Below the high half the nearest points are those at x = 9, but none is nearer than 20 beyond x = 29.
    let expected: f64 = (5..20i32).map(|x| f64::from(1 + (x - 9).max(0).pow(2)).sqrt()).sum::<f64>() / 15.0;
    close(&found["cloud"]["completeness"], expected);

    let without = file(&folder, "without.mat");
    write_matlab(&without, &[array("BB", &[2, 3], &corners)]);
    let (status, printed) = refused(&[&pair[..5], &[&words(&without)]].concat());
    assert!(status == Some(1) && printed.contains("no array of numbers ObsMask; it has: BB"), "{printed}");
    fs::write(&without, b"MATLAB 7.3 MAT-file").unwrap();
    let (_, printed) = refused(&[&pair[..5], &[&words(&without)]].concat());
    assert!(printed.contains("version 7.3"), "{printed}");
    fs::write(&without, b"no such thing").unwrap();
    let (status, printed) = refused(&[&pair[..5], &[&words(&without)]].concat());
    assert!(status == Some(1) && printed.contains("expected a MATLAB file"), "{printed}");
}

#[test]
fn clouds_without_points_are_refused() {
    let folder = TempDir::new().unwrap();
    let truth = write_plane(&folder, "truth.ply", 0.0);
    let cloud = file(&folder, "cloud.ply");
    let header = |count: usize| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
             property float z\nend_header\n"
        )
    };
    for (content, expected) in [
        (header(0), "the cloud is empty"),
        (header(1 << 40), "truncated"),
        (header(2) + "0 0 0\n", "fewer than 2 vertices"),
        ("hello".to_owned(), "cloud.ply"),
    ] {
        fs::write(&cloud, content).unwrap();
        let (status, printed) = refused(&["--cloud", &words(&cloud), "--truth-cloud", &truth]);
        assert!(status == Some(1) && printed.contains(expected), "{expected}: {printed}");
        assert!(printed.contains("cloud.ply"), "{printed}");
    }
    let nowhere = [f64::NAN, 0.0, 0.0];
    write_ply(&cloud, &cloud_of(vec![nowhere], |_| [0; 3])).unwrap();
    let (status, printed) = refused(&["--cloud", &words(&cloud), "--truth-cloud", &truth]);
    assert!(status == Some(1) && printed.contains("none of 1 points has finite coordinates"), "{printed}");
    // Among others they are left out with a warning.
    write_ply(&cloud, &cloud_of(vec![[0.0, 0.0, 3.0], nowhere], |_| [0; 3])).unwrap();
    let output = skep(&["evaluate", "--cloud", &words(&cloud), "--truth-cloud", &truth]);
    assert!(output.status.success());
    assert!(text(&output.stderr).contains("warning: 1 points of"), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("accuracy 3.0000"), "{}", text(&output.stdout));
}

#[test]
fn a_photograph_judges_the_colors_of_a_cloud() {
    let scene = made_scene();
    // The left 12 columns carry points; of those, the 3 leftmost have another color.
    let pixels: Vec<usize> = (0..PIXELS).filter(|pixel| pixel % 20 < 12).collect();
    let place = |&pixel: &usize| {
        let pixel = glam::DVec2::new((pixel % 20) as f64, (pixel / 20) as f64);
        camera(0.0).unproject(pixel, 2.0).to_array()
    };
    let color = |index: usize| if pixels[index] % 20 < 3 { [200; 3] } else { [50; 3] };
    let cloud = file(&scene, "cloud.ply");
    write_ply(&cloud, &cloud_of(pixels.iter().map(place).collect(), color)).unwrap();
    let (folder, cloud, plots) = (words(scene.path()), words(&cloud), words(&file(&scene, "plots")));
    let found = scores(&[&folder, "--cloud", &cloud, "--views", "a.png", "--plots", &plots]);
    let mean = &found["held_out"]["mean"];
    // Discs reach a pixel farther, and so do the means.
    close(&mean["covered"], 13.0 / 20.0);
    let right = mean["right"].as_f64().unwrap();
    assert!((7.0 / 20.0..=10.0 / 20.0).contains(&right), "{right}");
    close(&mean["precision"], right / (13.0 / 20.0));
    let picture = image::open(file(&scene, "plots/a.png.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (3 * WIDTH, HEIGHT));

    let (status, printed) = refused(&[&folder, "--cloud", &cloud, "--views", "c.png"]);
    assert!(status == Some(1) && printed.contains("--views is c.png"), "{printed}");
}

#[test]
fn photographs_are_left_out_and_judge_the_reconstruction_of_the_others() {
    let scene = small_board();
    let output = file(&scene, "run");
    let schedule = "downscale=2 food_sources=3 iterations=2+1x1; downscale=1 food_sources=2 iterations=1+0x1";
    let found = scores(&[
        path(&scene),
        "--hold-out",
        "4",
        "--first",
        "1",
        "--output",
        &words(&output),
        "--preset",
        "fast",
        "--",
        "--schedule",
        schedule,
    ]);
    let names = |list: &str| fs::read_to_string(output.join(list)).unwrap();
    assert_eq!(names("left-out.txt").lines().collect::<Vec<_>>(), [NAMES[1], NAMES[5]]);
    assert_eq!(names("used.txt").lines().count(), 5);
    assert!(!output.join("stereo/depth_maps").join(format!("{}.geometric.bin", NAMES[1])).exists());
    let mean = &found["held_out"]["mean"];
    let (covered, right) = (mean["covered"].as_f64().unwrap(), mean["right"].as_f64().unwrap());
    assert!(covered > 0.3 && right > 0.6 * covered && right <= covered, "{mean}");

    for (arguments, expected) in [
        (["--hold-out", "1"], "--hold-out is 1"),
        (["--hold-out", "1000"], "--first is 9"),
        (["--hold-out", "2"], "what follows --"),
    ] {
        let rest = match arguments[1] {
            "1000" => ["--first", "9"].as_slice(),
            "2" => ["--", "--no-such-argument"].as_slice(),
            _ => &[],
        };
        let (status, printed) = refused(&[&[path(&scene)], &arguments[..], rest].concat());
        assert!(status == Some(2) && printed.contains(expected), "{arguments:?}: {printed}");
    }
}
