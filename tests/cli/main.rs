//! The command line: its output, its files and its exit status.
#![cfg(feature = "cli")]

mod documents;
mod dump;
mod evaluate;
mod fuse;
mod import;
#[cfg(unix)]
mod interruption;
mod layouts;
#[cfg(unix)]
mod outputs;
mod progress;
mod refusals;
mod report;
mod run_folder;

use layouts::{check_cloud, check_maps};
use serde_json::Value;
use skep::simd::SimdLevel;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

const WIDTH: usize = 640;
const HEIGHT: usize = 360;
/// The board's photographs in the order of the model's file.
const NAMES: [&str; 7] =
    ["key.jpg", "source0.jpg", "source1.jpg", "source2.jpg", "source3.jpg", "source4.jpg", "source5.jpg"];

fn skep(arguments: &[&str]) -> Output {
    command(arguments).output().expect("skep starts")
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_skep"));
    command.args(arguments).stdin(Stdio::null());
    command
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("skep prints UTF-8")
}

/// The exit status and what was printed about the failure.
fn failure(arguments: &[&str]) -> (Option<i32>, String) {
    let output = skep(arguments);
    assert!(output.stdout.is_empty(), "a failure prints no results: {}", text(&output.stdout));
    (output.status.code(), text(&output.stderr).to_owned())
}

fn board() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data/board")
}

/// A copy of the board's scene: `SCENE/dense` goes there, not into the repository.
fn copied_board() -> TempDir {
    let folder = TempDir::new().unwrap();
    for part in ["images", "sparse"] {
        fs::create_dir(folder.path().join(part)).unwrap();
        for entry in fs::read_dir(board().join(part)).unwrap() {
            let entry = entry.unwrap();
            fs::copy(entry.path(), folder.path().join(part).join(entry.file_name())).unwrap();
        }
    }
    folder
}

/// The board at a quarter of its size, for runs whose accuracy does not matter.
fn small_board() -> TempDir {
    let folder = copied_board();
    for name in NAMES {
        let path = folder.path().join("images").join(name);
        let photograph = image::open(&path).unwrap();
        let (width, height) = (WIDTH as u32 / 4, HEIGHT as u32 / 4);
        photograph.resize_exact(width, height, image::imageops::FilterType::Triangle).save(&path).unwrap();
    }
    let cameras = folder.path().join("sparse/cameras.txt");
    let original = fs::read_to_string(&cameras).unwrap();
    let fields: Vec<&str> =
        original.lines().find(|line| !line.starts_with('#')).unwrap().split_whitespace().collect();
    let quarters: Vec<String> =
        fields[2..].iter().map(|number| (number.parse::<f64>().unwrap() / 4.0).to_string()).collect();
    fs::write(&cameras, format!("{} {} {}\n", fields[0], fields[1], quarters.join(" "))).unwrap();
    folder
}

fn path(folder: &TempDir) -> &str {
    folder.path().to_str().unwrap()
}

fn report(dense: &Path) -> Value {
    serde_json::from_slice(&fs::read(dense.join("report.json")).unwrap()).unwrap()
}

/// All files below a folder with their sizes.
fn files(folder: &Path) -> Vec<(PathBuf, u64)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            match entry.file_type().unwrap().is_dir() {
                true => folders.push(entry.path()),
                false => found.push((entry.path(), entry.metadata().unwrap().len())),
            }
        }
    }
    found.sort();
    found
}

#[test]
fn info_prints_version_machine_and_every_option_of_the_presets() {
    let output = skep(&["info"]);
    assert!(output.status.success());
    let printed = text(&output.stdout);
    assert!(printed.starts_with(&format!("skep {}\n", env!("CARGO_PKG_VERSION"))), "{printed}");
    assert!(printed.contains("SIMD level: ") && printed.contains("threads: "), "{printed}");
    for (name, value) in
        [skep::Options::default(), skep::Options::paper()].iter().flat_map(skep::Options::values)
    {
        // Long values are on lines of their own below the name.
        let is_named = |line: &&str| line.split_whitespace().next() == Some(name);
        let rows: Vec<&str> = printed
            .lines()
            .skip_while(|line| !is_named(line))
            .enumerate()
            .take_while(|(place, line)| *place == 0 || line.starts_with(' '))
            .flat_map(|(_, line)| line.split_whitespace())
            .collect();
        assert!(!rows.is_empty(), "no row for {name}:\n{printed}");
        let value = value.to_string();
        let words: Vec<&str> = value.split_whitespace().collect();
        assert!(words.is_empty() || rows.windows(words.len()).any(|part| part == words), "{name}: {value}");
    }
}

#[test]
fn what_is_said_of_options_fits_80_columns() {
    let every_name: Vec<&str> = skep::Options::infos().map(|info| info.name).collect();
    let groups = skep::Options::groups().map(|(name, _)| name);
    for arguments in [&["info"][..]]
        .into_iter()
        .map(<[&str]>::to_vec)
        .chain(every_name.into_iter().chain(groups).map(|name| vec!["info", name]))
    {
        let output = skep(&arguments);
        assert!(output.status.success());
        let long = text(&output.stdout).lines().find(|line| line.chars().count() > 80);
        assert_eq!(long, None, "{arguments:?}");
    }
}

#[test]
fn the_environment_forces_a_simd_level_lowered_to_the_machine_s() {
    let level = |forced: Option<&str>| {
        let mut info = command(&["info"]);
        info.env_remove("SKEP_SIMD").envs(forced.map(|level| ("SKEP_SIMD", level)));
        let output = info.output().unwrap();
        assert!(output.status.success());
        let printed = text(&output.stdout).to_owned();
        let level = printed.lines().find_map(|line| line.strip_prefix("SIMD level: "));
        level.expect("info prints the level").to_owned()
    };
    let best = SimdLevel::ALL.into_iter().rfind(|level| level.is_available()).unwrap();
    assert_eq!(level(None), best.name());
    for forced in SimdLevel::ALL {
        assert_eq!(level(Some(forced.name())), forced.min(best).name());
    }
    assert_eq!(level(Some("")), best.name());
}

#[test]
fn help_names_files_and_remedies() {
    let output = skep(&["help", "reconstruct"]);
    assert!(output.status.success());
    for word in ["fused.ply", "report.json", "preview/", "transforms.json", "--depth-range", "Examples:"] {
        assert!(text(&output.stdout).contains(word), "help lacks {word}");
    }
}

#[test]
fn wrong_arguments_end_with_status_2_and_name_the_valid_values() {
    let scene = board();
    let scene = scene.to_str().unwrap();
    let cases: [(&[&str], &str); 17] = [
        (&[], "Usage:"),
        (&["reconstruct"], "<SCENE>"),
        (&["reconstruct", scene, "--preset", "quick"], "default, fast, paper"),
        (&["reconstruct", scene, "--set", "smoothness_reward"], "NAME=VALUE"),
        (&["reconstruct", scene, "--set", "smoothness_reward=much"], "a number from 0 to 1"),
        (
            &["reconstruct", scene, "--set", "depth_tolerance=0.1"],
            "check.depth_tolerance, fusion.depth_tolerance",
        ),
        (&["reconstruct", scene, "--schedule", "2:3:5+4x1"], "downscale=2 food_sources=3 iterations=5+4x1"),
        (&["reconstruct", scene, "--schedule", "downscale=3 food_sources=2 iterations=0+0x1"], "the last 1"),
        (&["reconstruct", scene, "--without", "rewards"], "view-selection, reward, propagation"),
        (
            &["reconstruct", scene, "--depth-range", "2", "1"],
            "--depth-range is 2 to 1; expected finite depths",
        ),
        (&["reconstruct", scene, "--depth-range", "NaN", "1"], "0 < near < far"),
        (&["reconstruct", scene, "--depth-range", "-1", "1"], "0 < near < far"),
        (&["reconstruct", scene, "--threads", "many"], "--threads"),
        (&["reconstruct", scene, "--threads", "-1"], "invalid value '-1' for '--threads"),
        (&["reconstruct", scene, "--memory", "-5GiB"], "memory is `-5GiB`; expected a number with a unit"),
        (&["reconstruct", scene, "--min-confidence", "-1"], "fusion.min_confidence is -1; expected"),
        (&["reconstruct", scene, "--set", "preset=fast"], "--preset"),
    ];
    for (arguments, expected) in cases {
        let (status, printed) = failure(arguments);
        assert_eq!(status, Some(2), "{arguments:?}: {printed}");
        assert!(printed.contains(expected), "{arguments:?} lacks {expected}: {printed}");
    }
}

#[test]
fn a_file_that_an_argument_names_and_that_is_missing_ends_with_status_2_and_its_name() {
    let (folder, board) = (TempDir::new().unwrap(), board());
    let scene = folder.path().join("nowhere");
    let (scene_name, board) = (scene.to_str().unwrap(), board.to_str().unwrap());
    for arguments in [
        &["reconstruct", scene_name][..],
        &["reconstruct", board, "-o", path(&folder), "--masks", scene_name],
        &["reconstruct", board, "-o", path(&folder), "--options", scene_name],
        &["fuse", scene_name],
        &["search", scene_name, "--cycle", "0"],
        &["view", scene_name],
        &["convert", scene_name, "--to", "npy", "-o", path(&folder)],
        &["evaluate", "--cloud", scene_name, "--truth-cloud", scene_name],
    ] {
        let (status, printed) = failure(arguments);
        assert_eq!(status, Some(2), "{printed}");
        assert_eq!(printed, format!("error: {scene_name}: no such file or folder\n"));
    }
    assert!(!scene.exists(), "nothing is created for a missing scene");
}

#[test]
fn without_points_the_error_names_both_remedies_and_a_range_works() {
    let scene = small_board();
    fs::write(scene.path().join("sparse/points3D.txt"), "").unwrap();
    let (status, printed) = failure(&["reconstruct", path(&scene)]);
    assert_eq!(status, Some(1), "{printed}");
    assert!(printed.contains("sparse points") && printed.contains("--depth-range MIN MAX"), "{printed}");

    let output = skep(&["reconstruct", path(&scene), "--depth-range", "0.3", "1.5"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let report = report(&scene.path().join("dense"));
    assert_eq!(
        (&report["views"][0]["depth_min"], &report["views"][0]["depth_max"]),
        (&0.3.into(), &1.5.into())
    );
}

#[test]
fn an_output_that_cannot_be_written_is_detected_before_the_run() {
    let scene = small_board();
    let occupied = scene.path().join("occupied");
    fs::write(&occupied, "a file").unwrap();
    let (status, printed) = failure(&["reconstruct", path(&scene), "--output", occupied.to_str().unwrap()]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("occupied: cannot be written: it is a file; expected a folder"), "{printed}");
    assert!(!printed.contains("search"), "{printed}");
}

#[test]
fn parts_of_the_method_can_be_left_out_quietly() {
    let scene = small_board();
    let schedule = "downscale=2 food_sources=3 iterations=2+1x1; downscale=1 food_sources=2 iterations=1+0x1";
    let output = skep(&[
        "reconstruct",
        path(&scene),
        "--quiet",
        "--threads",
        "2",
        "--seed",
        "7",
        "--without",
        "view-selection,reward,propagation",
        "--set",
        "sigma_spatial=2.5",
        "--schedule",
        schedule,
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(output.stdout.is_empty(), "{}", text(&output.stdout));
    assert!(
        text(&output.stderr).lines().all(|line| line.starts_with("warning: ")),
        "{}",
        text(&output.stderr)
    );
    let report = report(&scene.path().join("dense"));
    let option = |name: &str| &report["options"][name];
    assert_eq!(option("view_selection.pixelwise_view_selection"), false);
    assert_eq!(
        (option("search.smoothness_reward"), option("search.view_propagation")),
        (&0.0.into(), &false.into())
    );
    assert_eq!((option("seed"), &report["threads"]), (&7.into(), &2.into()));
    assert_eq!(option("window.sigma_spatial"), 2.5);
    assert_eq!(option("schedule.scales"), schedule);
}

/// README's first command, on a copy: the layout of every documented file, the report, then the cloud from
/// the maps alone.
#[test]
fn the_embedded_scene_end_to_end() {
    let repository = files(&board());
    let scene = copied_board();
    let output = skep(&["reconstruct", path(&scene), "--write", "+graphs"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let dense = scene.path().join("dense");
    let report = report(&dense);

    for (index, name) in NAMES.iter().enumerate() {
        let validated = &report["views"][index]["outcomes"]["validated"];
        check_maps(&dense, name, validated.as_u64().unwrap() as usize);
        for what in ["depth", "normal", "views"] {
            let preview = dense.join(format!("preview/{name}.{what}.png"));
            assert_eq!(image::image_dimensions(preview).unwrap(), (WIDTH as u32, HEIGHT as u32));
        }
    }
    let listed = std::fs::read_to_string(dense.join("stereo/fusion.cfg")).unwrap();
    assert_eq!(listed.lines().collect::<Vec<_>>(), NAMES, "what COLMAP's fusion reads first");
    assert!(NAMES.iter().all(|name| dense.join("images").join(name).is_file()));
    assert!(dense.join("sparse/cameras.txt").is_file());
    let points = check_cloud(&dense.join("fused.ply"));
    assert!(points > 50_000, "{points} points");
    assert_eq!(report["totals"]["points"], points);
    check_report(&report);
    check_summary(text(&output.stdout), &dense, points);
    check_lines(text(&output.stderr));

    let again = dense.join("again.ply");
    let output = skep(&["fuse", dense.to_str().unwrap(), "--output", again.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let points_again = check_cloud(&again);
    assert!(points_again > 50_000, "{points_again} points from the maps alone");
    assert_eq!(files(&board()), repository, "nothing is written into the repository");
}

/// Checks the fields that tools read, and that the totals are the sums over the views.
fn check_report(report: &Value) {
    let totals = &report["totals"];
    assert_eq!(totals["pixels"], NAMES.len() * WIDTH * HEIGHT);
    for field in ["cpu_seconds", "wall_seconds"] {
        assert!(totals[field].as_f64().unwrap() > 0.0, "{field}");
        for phase in ["reading", "search", "check", "fusion", "writing"] {
            assert!(report["phases"][phase][field].as_f64().unwrap() >= 0.0, "{phase}.{field}");
        }
    }
    if cfg!(target_os = "linux") {
        assert!(totals["peak_resident_bytes"].as_u64().unwrap() > 1 << 20);
    }
    let views = report["views"].as_array().unwrap();
    let names: Vec<&str> = views.iter().map(|view| view["name"].as_str().unwrap()).collect();
    assert_eq!(names, NAMES);
    for field in ["pixels", "ncc_evaluations", "bilinear_samples", "early_terminations"] {
        let sum: u64 = views.iter().map(|view| view[field].as_u64().unwrap()).sum();
        assert_eq!(totals[field], sum, "{field}");
    }
    for part in [totals, &views[0]] {
        assert_eq!(part["outcomes"].as_object().unwrap().len(), skep::PixelStatus::ALL.len());
        assert_eq!(part["outcomes"], part["status_counts"]);
    }
    let outcomes = totals["outcomes"].as_object().unwrap().values();
    assert_eq!(totals["pixels"], outcomes.map(|count| count.as_u64().unwrap()).sum::<u64>());
    assert!(totals["ncc_evaluations"].as_u64() > Some(0) && totals["bilinear_samples"].as_u64() > Some(0));
    assert!(!totals["cycles"].as_array().unwrap().is_empty());
    assert!(totals["cycles"][0]["changed"].as_u64() > Some(0));
    assert_eq!(
        (&report["version"], &report["preset"]),
        (&env!("CARGO_PKG_VERSION").into(), &"default".into())
    );
    assert!(["scalar", "baseline", "v3"].contains(&report["simd"].as_str().unwrap()));
    assert_eq!(report["options"].as_object().unwrap().len(), skep::Options::default().values().count());
    assert!(report["threads"].as_u64() > Some(0) && report["warnings"].is_array());
}

/// Checks that the last lines name the results.
fn check_summary(printed: &str, dense: &Path, points: usize) {
    let cloud = format!("{points} points in {}", dense.join("fused.ply").display());
    assert!(printed.contains(&cloud), "{printed}");
    assert!(printed.contains("% of 1612800 pixels validated"), "{printed}");
    for place in ["preview/key.jpg.depth.png", "stereo", "report.json"] {
        assert!(printed.contains(dense.join(place).to_str().unwrap()), "{printed}");
    }
}

/// Checks that without a terminal each new step prints a line.
fn check_lines(printed: &str) {
    let steps: Vec<&str> = printed.lines().filter_map(|line| line.split(", 7 views:").next()).collect();
    assert!(steps.iter().any(|step| step.starts_with("search")), "{printed}");
    assert!(steps.contains(&"fusion"), "{printed}");
    // A step that takes long has several lines, but none comes back.
    let mut order = steps.clone();
    order.dedup();
    let different: std::collections::HashSet<&str> = steps.into_iter().collect();
    assert_eq!(order.len(), different.len(), "{printed}");
    assert!(!printed.contains('\r') && !printed.contains('\u{1b}'), "no bar without a terminal:\n{printed}");
}
