//! What a run writes: formats and thinning of the cloud, the files of views, scenes for splatting, and maps
//! in other formats.

use super::interruption::results;
use super::{NAMES, failure, path, report, skep, small_board, text};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Runs the small board with the preset `fast`; returns what was printed as warnings.
fn reconstruct(scene: &TempDir, output: &Path, more: &[&str]) -> String {
    let output = output.to_str().unwrap();
    let fixed = ["reconstruct", path(scene), "--preset", "fast", "--quiet", "--output", output];
    let done = skep(&[&fixed[..], more].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    text(&done.stderr).to_owned()
}

fn points(output: &Path) -> u64 {
    report(output)["totals"]["points"].as_u64().unwrap()
}

fn names(output: &Path) -> Vec<PathBuf> {
    results(output).into_iter().map(|(path, _)| path).collect()
}

#[test]
fn only_the_files_that_are_wanted_remain() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    let arguments = ["--write", "depth,status", "--cloud-format", "laz"];
    reconstruct(&scene, output.path(), &arguments);
    let maps: Vec<PathBuf> =
        names(output.path()).into_iter().filter(|path| !path.starts_with("images")).collect();
    let is_wanted = |path: &&PathBuf| {
        path.starts_with("stereo/depth_maps")
            || path.starts_with("stereo/status_maps")
            || path.starts_with("sparse")
    };
    let others: Vec<&PathBuf> = maps.iter().filter(|path| !is_wanted(path)).collect();
    assert_eq!(
        others,
        ["fused.laz", "fused.laz.vis", "stereo/fusion.cfg", "stereo/patch-match.cfg"].map(Path::new),
        "what the fusion alone needs is removed"
    );
    assert_eq!(maps.iter().filter(|path| path.starts_with("stereo/depth_maps")).count(), 2 * NAMES.len());
    let status = image::open(output.path().join("stereo/status_maps/key.jpg.png")).unwrap().into_luma8();
    let validated = status.pixels().filter(|pixel| pixel.0[0] == skep::PixelStatus::Validated as u8).count();
    assert_eq!(report(output.path())["views"][0]["status_counts"]["validated"], validated);

    // The run is complete as it is: nothing is missed or made again.
    let before = results(output.path());
    assert_eq!(reconstruct(&scene, output.path(), &arguments), "");
    assert!(results(output.path()) == before);
    // Without normals another cloud takes another run.
    let warnings = reconstruct(&scene, output.path(), &["--write", "depth,status"]);
    assert!(warnings.contains("begins anew") && warnings.contains("cloud_format (laz to ply)"), "{warnings}");
    assert!(!output.path().join("fused.laz").exists());
}

#[test]
fn another_cloud_is_made_from_the_maps_that_are_there() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    reconstruct(&scene, output.path(), &[]);
    let (all, first) = (points(output.path()), results(output.path()));
    let has_graphs = names(output.path()).iter().any(|path| path.starts_with("stereo/consistency_graphs"));
    assert!(!has_graphs, "graphs are written when they are asked for");
    let other =
        ["--voxel", "0.01", "--max-points", "200", "--cloud-format", "las", "--splat", "--threads", "1"];
    let warnings = reconstruct(&scene, output.path(), &other);
    assert!(warnings.contains("the cloud in") && warnings.contains("is made again"), "{warnings}");
    assert!(warnings.contains("option fusion.voxel_size (0 to 0.01)"), "{warnings}");
    assert!(all > 1000 && points(output.path()) == 200, "{all}");
    for file in [
        "sparse/0/cameras.bin",
        "sparse/0/images.bin",
        "sparse/0/points3D.bin",
        "sparse/0/points3D.ply",
        "images/key.jpg",
    ] {
        assert!(output.path().join("splat").join(file).is_file(), "{file}");
    }
    assert!(!output.path().join("fused.ply").exists(), "the cloud before is gone");

    let whole = TempDir::new().unwrap();
    reconstruct(&scene, whole.path(), &[&other[..7], &["--threads", "3"]].concat());
    assert!(results(whole.path()) == results(output.path()), "the same bits in one run, on other threads");
    reconstruct(&scene, output.path(), &[]);
    assert!(results(output.path()) == first, "and back");
}

#[test]
fn a_cloud_is_fused_into_the_format_of_its_ending_and_thinned() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    reconstruct(&scene, output.path(), &[]);
    let cloud = output.path().join("else/thin.laz");
    let cloud = cloud.to_str().unwrap();
    let done = skep(&["fuse", path(&output), "--output", cloud, "--max-points", "123", "--splat"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains(&format!("123 points in {cloud}")), "{}", text(&done.stdout));
    assert!(output.path().join("else/splat/sparse/0/points3D.ply").is_file());

    for (arguments, expected) in [
        (&["--output", "cloud.xyz"][..], "ending of cloud.xyz is `xyz`; expected one of ply, las, laz"),
        (&["--output", "cloud.las", "--cloud-format", "ply"], "ends in .ply, as --cloud-format says"),
        (&["--cloud-format", "obj"], "expected one of ply, las, laz"),
        (&["--voxel", "-1"], "options.fusion.voxel_size is -1"),
    ] {
        let (status, printed) = failure(&[&["fuse", path(&output)], arguments].concat());
        assert_eq!(status, Some(2), "{printed}");
        assert!(printed.contains(expected) && !printed.contains("reading"), "{printed}");
    }
    let (status, printed) = failure(&["reconstruct", path(&scene), "--write", "depth,depths"]);
    assert_eq!(status, Some(2));
    assert!(printed.contains("depth, normals, confidence, status, graphs, previews"), "{printed}");
}

#[test]
fn maps_are_converted_into_other_formats() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    reconstruct(&scene, output.path(), &[]);
    let converted = TempDir::new().unwrap();
    let pixels = 160 * 90;
    for (format, bytes) in [("pfm", 15), ("npy", 128)] {
        let done = skep(&["convert", path(&output), "--to", format, "-o", path(&converted)]);
        assert!(done.status.success(), "{}", text(&done.stderr));
        assert!(text(&done.stdout).contains("geometric maps of 7 views"), "{}", text(&done.stdout));
        for (what, channels) in [("depth_maps", 1), ("normal_maps", 3), ("confidence_maps", 1)] {
            let file = converted.path().join(format!("{what}/key.jpg.{format}"));
            assert_eq!(fs::metadata(file).unwrap().len(), bytes + 4 * channels * pixels);
        }
    }
    let raw = skep(&["convert", path(&output), "--to", "npy", "--raw", "--quiet", "-o", path(&converted)]);
    assert!(raw.status.success() && raw.stdout.is_empty());
    let map = fs::read(output.path().join("stereo/depth_maps/key.jpg.photometric.bin")).unwrap();
    let array = fs::read(converted.path().join("depth_maps/key.jpg.npy")).unwrap();
    assert_eq!(map[map.len() - 4 * pixels as usize..], array[128..]);
    for (format, file) in [("tiff", "normal_maps/source5.jpg.tiff"), ("dmap", "depth0006.dmap")] {
        let done = skep(&["convert", path(&output), "--to", format, "-o", path(&converted)]);
        assert!(done.status.success(), "{}", text(&done.stderr));
        assert!(converted.path().join(file).is_file(), "{file}");
    }
    let (status, printed) = failure(&["convert", path(&scene), "--to", "pfm", "-o", path(&converted)]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("no depth maps; expected files like"), "{printed}");
}
