//! `--progress`: lines that programs and people read.

use super::{path, skep, small_board, text};
use serde_json::Value;
use tempfile::TempDir;

fn printed(more: &[&str]) -> String {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    let fixed = ["reconstruct", path(&scene), "--preset", "fast", "--output", path(&output)];
    let done = skep(&[&fixed[..], more].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    text(&done.stderr).to_owned()
}

#[test]
fn json_is_an_object_on_each_line_whose_phases_follow_each_other_and_whose_progress_never_falls() {
    let printed = printed(&["--progress", "json"]);
    let lines = printed.lines().filter(|line| !line.starts_with("warning: "));
    let objects: Vec<Value> = lines.map(|line| serde_json::from_str(line).unwrap()).collect();
    let reports: Vec<&Value> = objects.iter().filter(|object| object["message"].is_null()).collect();
    let mut phases: Vec<&str> = reports.iter().map(|report| report["phase"].as_str().unwrap()).collect();
    phases.dedup();
    assert_eq!((phases[0], phases[1], phases[phases.len() - 1]), ("read", "search", "fusion"));
    let done: Vec<f64> = reports
        .iter()
        .filter(|report| report["phase"] != "read")
        .map(|report| report["done"].as_f64().unwrap())
        .collect();
    assert!(done.is_sorted() && done.iter().all(|done| (0.0..=1.0).contains(done)), "{done:?}");
    for report in reports {
        assert!(report["view"].as_u64() < Some(7) && report["views"] == 7, "{report}");
        let is_of_cycle = ["search", "check"].contains(&report["phase"].as_str().unwrap());
        assert_eq!(report["cycle"].is_u64() && report["downscale"].is_u64(), is_of_cycle, "{report}");
        assert!(report["seconds_left"].is_null() || report["seconds_left"].as_f64() >= Some(0.0));
    }
}

#[test]
fn a_bar_that_is_asked_for_is_drawn_in_place_and_removed() {
    let printed = printed(&["--progress", "bar"]);
    assert!(printed.contains(" %  search at full size, cycle 1, 7 views"), "{printed}");
    let last = printed.rsplit_once("7 views").unwrap().1;
    assert!(last.contains("\r\u{1b}[J\r"), "removed at the end: {last:?}");
    assert!(!printed.contains("view 1"), "no number of a view that jumps");
}
