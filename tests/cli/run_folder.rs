//! Runs in a folder: budgets of memory, tasks one by one, damage, and changes of what a run is made from.

use super::interruption::results;
use super::{NAMES, failure, path, report, skep, small_board, text};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Runs the small board with the preset `fast`; returns what was printed as warnings.
fn reconstruct(scene: &Path, output: &Path, more: &[&str]) -> String {
    let (scene, output) = (scene.to_str().unwrap(), output.to_str().unwrap());
    let fixed = ["reconstruct", scene, "--preset", "fast", "--quiet", "--output", output];
    let done = skep(&[&fixed[..], more].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    text(&done.stderr).to_owned()
}

/// A scene and its run.
fn finished() -> (TempDir, PathBuf) {
    let scene = small_board();
    let output = scene.path().join("dense");
    reconstruct(scene.path(), &output, &[]);
    (scene, output)
}

fn flip_a_bit(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::remove_file(path).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_budget_of_memory_changes_no_bit_and_one_too_small_is_refused_with_the_least() {
    let (scene, output) = finished();
    let (status, printed) =
        failure(&["reconstruct", path(&scene), "--output", path(&scene), "--fresh", "--memory", "10MiB"]);
    assert_eq!(status, Some(1), "{printed}");
    let least = printed.split_once('(').and_then(|(_, rest)| rest.split_once(" bytes)")).unwrap().0;
    assert!(printed.contains("options.memory is 10.0 MiB; expected at least"), "{printed}");
    let other = TempDir::new().unwrap();
    reconstruct(scene.path(), other.path(), &["--memory", least]);
    assert!(results(&output) == results(other.path()));
}

#[test]
fn the_options_in_the_report_of_a_run_make_the_same_run() {
    let (scene, output) = finished();
    let (output, report) = (output.to_str().unwrap(), output.join("report.json"));
    let options = report.to_str().unwrap();
    let again = skep(&["reconstruct", path(&scene), "--options", options, "--output", output]);
    assert!(text(&again.stderr).contains("the run was complete before"), "{}", text(&again.stderr));
    let (status, printed) =
        failure(&["reconstruct", path(&scene), "--options", options, "--preset", "fast", "--output", output]);
    assert!(status == Some(2) && printed.contains("cannot be used with"), "{printed}");
}

#[test]
fn the_log_level_debug_prints_what_a_run_is_made_of_and_error_no_warnings() {
    let (scene, run) = (small_board(), TempDir::new().unwrap());
    let planned = |level: &str| {
        let done =
            skep(&["plan", path(&scene), "--preset", "fast", "--log-level", level, "--output", path(&run)]);
        assert!(done.status.success(), "{}", text(&done.stderr));
        text(&done.stderr).to_owned()
    };
    let printed = planned("debug");
    assert!(
        printed.contains(", SIMD level ") && printed.contains("cost.best_views=3, by default 4"),
        "{printed}"
    );
    assert!(printed.contains("view 0, key.jpg: ") && printed.contains(", sources source"), "{printed}");
    assert!(!planned("info").contains("SIMD level"));
    assert_eq!(planned("warning"), "");
}

#[test]
fn a_depth_range_without_sparse_points_and_results_of_others_are_warnings() {
    let (scene, run) = (small_board(), TempDir::new().unwrap());
    fs::write(run.path().join("fused.ply"), "of another program").unwrap();
    let range = ["--depth-range", "1000", "2000"];
    let arguments = ["plan", path(&scene), "--quiet", "--output", path(&run)];
    let done = skep(&[&arguments[..], &range].concat());
    let printed = text(&done.stderr);
    assert!(printed.contains("warning: 0 of ") && printed.contains("--depth-range 1000 2000"), "{printed}");
    assert!(printed.contains("results of another program (fused.ply)"), "{printed}");
    let again = skep(&[&arguments[..], &["--depth-range", "0.3", "3"]].concat());
    assert!(!text(&again.stderr).contains("another program"), "{}", text(&again.stderr));
    assert!(!text(&again.stderr).contains("sparse points"), "{}", text(&again.stderr));
}

#[test]
fn the_tasks_one_by_one_give_the_same_bits_and_may_be_repeated() {
    let (scene, output) = finished();
    let run = TempDir::new().unwrap();
    let planned = skep(&["plan", path(&scene), "--preset", "fast", "--output", path(&run)]);
    assert!(planned.status.success(), "{}", text(&planned.stderr));
    let printed = text(&planned.stdout);
    let tasks: Vec<&str> = printed.lines().filter(|line| !line.starts_with('#')).collect();
    assert!(tasks.len() > 10 && tasks[0].starts_with("skep search "), "{printed}");
    for task in &tasks {
        let arguments: Vec<&str> = task.split(' ').skip(1).collect();
        for _ in 0..2 {
            let done = skep(&arguments);
            assert!(done.status.success(), "{task}: {}", text(&done.stderr));
        }
    }
    assert!(results(&output) == results(run.path()));
    assert!(!run.path().join("run/estimates").exists(), "no task needs them any more");
}

#[test]
fn a_task_before_its_inputs_is_refused_and_names_what_is_missing() {
    let (scene, run) = (small_board(), TempDir::new().unwrap());
    let planned = skep(&["plan", path(&scene), "--quiet", "--output", path(&run)]);
    assert!(planned.status.success(), "{}", text(&planned.stderr));
    let refused = |arguments: &[&str], expected: &str| {
        let (status, printed) = failure(&[&[arguments[0], path(&run)], &arguments[1..]].concat());
        assert_ne!(status, Some(0));
        assert!(printed.contains(expected), "{arguments:?}: {printed}");
    };
    refused(&["search", "--cycle", "1"], "before the tasks of cycle 0 are done");
    refused(&["check", "--cycle", "0"], "is done; expected a cycle whose views are all searched");
    refused(&["next", "--cycle", "0"], "before the check of view 0 is done");
    refused(&["finish"], "before the last cycle is done");
    refused(&["fuse"], "before view 0 is finished");
    refused(&["search", "--cycle", "99"], "below their number");
    refused(&["search", "--cycle", "0", "--views", "5..8"], "views of 0..7");
    refused(&["search", "--cycle", "0", "--views", "3..3"], "A..B");
    let manifest = run.path().join("run/manifest.json");
    let renamed = fs::read_to_string(&manifest).unwrap().replace("key.jpg", "source9.jpg");
    fs::write(&manifest, renamed).unwrap();
    refused(&["search", "--cycle", "0"], "other photographs than the model has");
    let elsewhere = scene.path().to_str().unwrap();
    let (_, printed) = failure(&["search", elsewhere, "--cycle", "0"]);
    assert!(printed.contains("manifest.json") && printed.contains("skep plan"), "{printed}");
}

#[test]
fn damaged_files_are_named_and_made_again() {
    let scene = small_board();
    let (output, more) = (scene.path().join("dense"), ["--write", "+graphs"]);
    reconstruct(scene.path(), &output, &more);
    let expected = results(&output);
    let files = [
        "fused.ply",
        "stereo/depth_maps/key.jpg.geometric.bin",
        "stereo/consistency_graphs/source0.jpg.photometric.bin",
        "preview/key.jpg.normal.png",
    ];
    for file in files {
        flip_a_bit(&output.join(file));
        let warnings = reconstruct(scene.path(), &output, &more);
        assert!(warnings.contains(file) && warnings.contains("damaged"), "{file}: {warnings}");
        assert!(results(&output) == expected, "{file}");
    }
    fs::write(output.join("fused.ply.vis"), "short").unwrap();
    let warnings = reconstruct(scene.path(), &output, &more);
    assert!(warnings.contains("5 bytes; the run wrote"), "{warnings}");
    fs::write(output.join("run/manifest.json"), "{").unwrap();
    let warnings = reconstruct(scene.path(), &output, &more);
    assert!(warnings.contains("not a manifest of a run"), "{warnings}");
    assert!(results(&output) == expected);
}

#[test]
fn a_damaged_estimate_between_two_processes_begins_anew_and_says_so() {
    let (scene, output) = finished();
    let run = TempDir::new().unwrap();
    let plan = ["plan", path(&scene), "--preset", "fast", "--quiet", "--output", path(&run)];
    for arguments in [
        &plan[..],
        &["search", path(&run), "--cycle", "0"],
        &["check", path(&run), "--cycle", "0"],
        &["next", path(&run), "--cycle", "0"],
    ] {
        assert!(skep(arguments).status.success(), "{arguments:?}");
    }
    let estimate = run.path().join("run/estimates/cycle00-00002.checked");
    flip_a_bit(&estimate);
    let (status, printed) = failure(&["search", path(&run), "--cycle", "1"]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("cycle00-00002.checked") && printed.contains("damaged"), "{printed}");
    let warnings = reconstruct(scene.path(), run.path(), &[]);
    assert!(warnings.contains("cycle00-00002.checked") && warnings.contains("begins anew"), "{warnings}");
    assert!(results(&output) == results(run.path()));
}

#[test]
fn a_change_of_what_a_run_is_made_from_begins_it_anew_and_drops_what_is_gone() {
    let (scene, output) = finished();
    let warnings = reconstruct(scene.path(), &output, &["--seed", "3"]);
    assert!(warnings.contains("begins anew") && warnings.contains("option seed (0 to 3)"), "{warnings}");

    // The last view leaves the model.
    let list = scene.path().join("sparse/images.txt");
    let text = fs::read_to_string(&list).unwrap();
    let gone = NAMES[6];
    let mut lines: Vec<&str> = text.lines().collect();
    let place = lines.iter().position(|line| line.ends_with(gone)).unwrap();
    lines.drain(place..(place + 2).min(lines.len()));
    fs::write(&list, lines.join("\n") + "\n").unwrap();
    let points = scene.path().join("sparse/points3D.txt");
    let without_tracks = |line: &str| line.split_whitespace().take(8).collect::<Vec<_>>().join(" ");
    let text = fs::read_to_string(&points).unwrap();
    fs::write(&points, text.lines().map(without_tracks).collect::<Vec<_>>().join("\n")).unwrap();

    // The maps on disk are of the model before: a fusion with the new one refuses them.
    let (status, printed) = failure(&["fuse", output.to_str().unwrap(), "--scene", path(&scene)]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("were made with other cameras, poses or points"), "{printed}");

    let warnings = reconstruct(scene.path(), &output, &[]);
    assert!(warnings.contains("the model") && warnings.contains("(gone)"), "{warnings}");
    assert_eq!(report(&output)["views"].as_array().unwrap().len(), 6);
    let names: Vec<PathBuf> = results(&output).into_iter().map(|(path, _)| path).collect();
    let stays = |path: &&PathBuf| path.to_str().unwrap().contains(gone) && !path.starts_with("images");
    assert_eq!(names.iter().find(stays), None);
    assert_eq!(
        fs::read(output.join("sparse/images.txt")).unwrap(),
        fs::read(scene.path().join("sparse/images.txt")).unwrap()
    );
}

#[test]
fn a_folder_with_another_scene_or_another_process_is_left_alone() {
    let (scene, other) = (small_board(), small_board());
    let cameras = other.path().join("sparse/cameras.txt");
    let changed = fs::read_to_string(&cameras).unwrap().replace("160 90", "160 90 ");
    fs::write(&cameras, changed.replacen('.', ".1", 1)).unwrap();
    let before = results(other.path());
    let (status, printed) = failure(&["reconstruct", path(&scene), "--output", path(&other)]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("another scene"), "{printed}");
    assert!(results(other.path()) == before);

    let run = TempDir::new().unwrap();
    fs::create_dir(run.path().join("run")).unwrap();
    let lock = fs::File::create(run.path().join("run/lock")).unwrap();
    lock.lock().unwrap();
    let (status, printed) = failure(&["reconstruct", path(&scene), "--output", path(&run)]);
    assert_eq!(status, Some(1));
    assert!(printed.contains("another process"), "{printed}");
}
