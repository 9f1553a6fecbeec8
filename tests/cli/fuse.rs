//! `skep fuse` of a workspace that no run made: memory, missing files, and what is said of them.

use super::{failure, path, skep, text};
use glam::{DMat3, DVec3};
use image::{ImageBuffer, Rgb};
use skep::geometry::Camera;
use skep::io::{
    ColmapModel, MapKind, ModelImage, Workspace, read_ply, read_visibility, write_depth_map, write_normal_map,
};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const VIEWS: usize = 5;
const SIZE: (u32, u32) = (32, 24);

fn name(view: usize) -> String {
    format!("{view}.png")
}

fn camera(view: usize) -> Camera {
    Camera {
        width: SIZE.0,
        height: SIZE.1,
        fx: 40.0,
        fy: 40.0,
        cx: 15.5,
        cy: 11.5,
        rotation: DMat3::IDENTITY,
        translation: DVec3::new(-0.05 * view as f64, 0.0, 0.0),
    }
}

/// The plane z = 2 seen by cameras side by side, each photograph of one color, with maps of all views but the
/// first.
fn workspace() -> (TempDir, Workspace) {
    let folder = TempDir::new().unwrap();
    let images = (0..VIEWS).map(|view| ModelImage { name: name(view), camera: camera(view) }).collect();
    ColmapModel { images, points: vec![] }.write_text(&folder.path().join("sparse")).unwrap();
    fs::create_dir(folder.path().join("images")).unwrap();
    let workspace = Workspace::new(folder.path());
    let pixels = (SIZE.0 * SIZE.1) as usize;
    for view in 0..VIEWS {
        let photograph = ImageBuffer::from_pixel(SIZE.0, SIZE.1, Rgb([100u8, 150, 200]));
        photograph.save(folder.path().join("images").join(name(view))).unwrap();
        if view > 0 {
            let depth = workspace.depth_map(&name(view), MapKind::Validated);
            write_depth_map(&depth, SIZE.0, SIZE.1, &vec![2.0; pixels]).unwrap();
            let normal = workspace.normal_map(&name(view), MapKind::Validated);
            write_normal_map(&normal, SIZE.0, SIZE.1, &vec![[0.0, 0.0, -1.0]; pixels]).unwrap();
        }
    }
    (folder, workspace)
}

/// What was printed as errors and warnings.
fn fuse(folder: &TempDir, more: &[&str]) -> String {
    let done = skep(&[&["fuse", path(folder)], more].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    text(&done.stderr).to_owned()
}

fn cloud(folder: &TempDir) -> [Vec<u8>; 2] {
    ["fused.ply", "fused.ply.vis"].map(|file| fs::read(folder.path().join(file)).unwrap())
}

#[test]
fn a_view_without_maps_is_named_takes_no_memory_and_keeps_its_number() {
    let (folder, workspace) = workspace();
    let warnings = fuse(&folder, &["--quiet"]);
    assert_eq!(warnings.trim(), "warning: 1 of 5 views have no geometric maps: 0.png");
    let points = read_ply(&workspace.cloud()).unwrap();
    assert!(points.positions.len() > 500 && points.colors.iter().all(|color| *color == [100, 150, 200]));
    let views = read_visibility(&folder.path().join("fused.ply.vis")).unwrap();
    let numbers: Vec<u32> = (0..views.len()).flat_map(|point| views.get(point)).copied().collect();
    assert!(numbers.iter().all(|number| (1..5).contains(number)), "numbers of the model's images");
    assert!(numbers.contains(&4));

    // The view without maps is of a gigapixel now: 24 GB, if it were in memory.
    let expected = cloud(&folder);
    let list = folder.path().join("sparse/cameras.txt");
    let cameras = fs::read_to_string(&list).unwrap() + "7 PINHOLE 32768 32768 40000 40000 16384 16384\n";
    fs::write(&list, cameras).unwrap();
    let list = folder.path().join("sparse/images.txt");
    let images = fs::read_to_string(&list).unwrap().replace(" 1 0.png", " 7 0.png");
    fs::write(&list, images).unwrap();
    fuse(&folder, &["--quiet", "--memory", "300MiB"]);
    assert!(cloud(&folder) == expected, "the budget changes no bit");
}

#[test]
fn views_that_are_not_in_fusion_cfg_are_left_out_by_name() {
    let (folder, workspace) = workspace();
    let list = folder.path().join("stereo/fusion.cfg");
    fs::write(&list, "1.png\n2.png\n3.png\n").unwrap();
    let warnings = fuse(&folder, &["--quiet"]);
    assert_eq!(
        warnings.trim(),
        "warning: 2 of 5 views are not in stereo/fusion.cfg and are left out: 0.png, 4.png"
    );
    let views = read_visibility(&folder.path().join("fused.ply.vis")).unwrap();
    let numbers: Vec<u32> = (0..views.len()).flat_map(|point| views.get(point)).copied().collect();
    assert!(numbers.iter().all(|number| (1..4).contains(number)) && numbers.contains(&3));
    assert!(!read_ply(&workspace.cloud()).unwrap().positions.is_empty());
    fs::write(&list, "1.png\n\n7.png\n").unwrap();
    let (status, error) = failure(&["fuse", path(&folder)]);
    assert_eq!(status, Some(1));
    assert!(error.contains("fusion.cfg, line 3: \"7.png\" is no image of the model"), "{error}");
}

#[test]
fn missing_photographs_are_a_warning_with_the_number_of_gray_points() {
    let (folder, workspace) = workspace();
    for view in [1, 3] {
        fs::remove_file(folder.path().join("images").join(name(view))).unwrap();
    }
    let warnings = fuse(&folder, &["--quiet"]);
    let expected = "2 of 4 photographs are missing: their points are gray, 0 points; missing: 1.png, 3.png";
    assert!(warnings.contains(expected), "{warnings}");
    fs::remove_dir_all(folder.path().join("images")).unwrap();
    let warnings = fuse(&folder, &[]);
    let points = read_ply(&workspace.cloud()).unwrap().colors;
    let expected = format!("4 of 4 photographs are missing: their points are gray, {} points", points.len());
    assert!(warnings.contains(&expected), "{warnings}");
    assert!(points.iter().all(|color| *color == [128; 3]));
}

#[test]
fn an_empty_cloud_is_a_warning_also_with_quiet_and_names_the_option() {
    let (folder, _) = workspace();
    let warnings =
        fuse(&folder, &["--quiet", "--set", "min_agreeing_views=4", "--set", "min_agreeing_fraction=0"]);
    assert!(
        warnings.contains("the cloud is empty: 3072 of 3072 pixels (100.0 %) have a depth"),
        "{warnings}"
    );
    assert!(warnings.contains("--set fusion.min_agreeing_views=3"), "{warnings}");
}

#[test]
fn what_cannot_be_fused_or_written_is_refused_and_leaves_nothing() {
    let (folder, workspace) = workspace();
    let before = super::files(folder.path());
    let new: PathBuf = folder.path().join("new/folder/cloud.ply");
    let new = new.to_str().unwrap();
    let refused = |more: &[&str], parts: &[&str]| {
        let (status, printed) = failure(&[&["fuse", path(&folder)], more].concat());
        assert_eq!(status, Some(1), "{printed}");
        assert!(parts.iter().all(|part| printed.contains(part)), "{parts:?}: {printed}");
        assert!(!folder.path().join("new").exists());
        assert_eq!(super::files(folder.path()), before);
    };
    refused(&["--output", new, "--memory", "10MiB"], &["options.memory is 10.0 MiB", "at least"]);
    let in_the_way = folder.path().join("cloud.ply");
    fs::create_dir(&in_the_way).unwrap();
    refused(&["--output", in_the_way.to_str().unwrap()], &["cloud.ply", "a folder has this name"]);
    fuse(&folder, &["--output", new]);
    assert!(folder.path().join("new/folder/cloud.ply.vis").is_file());
    fs::remove_dir_all(folder.path().join("new")).unwrap();

    // A damaged map is found when it is read: in the middle of the fusion.
    let depth = workspace.depth_map(&name(4), MapKind::Validated);
    let mut bytes = fs::read(&depth).unwrap();
    let last = bytes.len() - 4;
    bytes[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(&depth, &bytes).unwrap();
    let before = super::files(folder.path());
    let (status, printed) = failure(&["fuse", path(&folder), "--output", new]);
    assert_eq!(status, Some(1), "{printed}");
    assert!(printed.contains("4.png.geometric.bin") && printed.contains("NaN"), "{printed}");
    assert_eq!(super::files(folder.path()), before, "no temporary file");
    assert!(!folder.path().join("new").exists());
    fs::write(&depth, &bytes[..last]).unwrap();
    let (_, printed) = failure(&["fuse", path(&folder)]);
    assert!(printed.contains("4.png.geometric.bin") && printed.contains("expected 32 x 24"), "{printed}");
}
