//! What the program tells about itself: options, completions, manual pages.

use super::{failure, path, skep, text};
use tempfile::TempDir;

#[test]
fn a_group_or_a_part_of_a_name_lists_options() {
    let listed = |word: &str| text(&skep(&["info", word]).stdout).to_owned();
    let group = listed("fusion");
    assert!(group.starts_with("Fusion"), "{group}");
    assert!(group.contains("\nfusion.depth_tolerance\n") && !group.contains("check."), "{group}");
    let part = listed("tolerance");
    assert!(part.contains("check.depth_tolerance") && part.contains("fusion.depth_tolerance"), "{part}");
}

#[test]
fn an_option_that_does_not_exist_is_refused_with_similar_ones() {
    let (status, printed) = failure(&["info", "check.depth_tolerence"]);
    assert_eq!(status, Some(2));
    assert!(printed.contains("check.depth_tolerance") && printed.len() < 500, "{printed}");
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_written_are_a_failure() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let done = super::command(&["info"]).stdout(full).output().unwrap();
    assert_eq!(done.status.code(), Some(1));
    let printed = text(&done.stderr);
    assert!(printed.contains("standard output") && printed.contains("No space left"), "{printed}");
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    let script = skep(&["completions", "bash"]);
    let folder = TempDir::new().unwrap();
    let written = skep(&["man", path(&folder)]);
    assert!(script.status.success() && written.status.success());
    for command in ["reconstruct", "plan", "fuse", "view", "convert", "evaluate", "info"] {
        assert!(text(&script.stdout).contains(command), "{command}");
        let page = std::fs::read_to_string(folder.path().join(format!("skep-{command}.1"))).unwrap();
        assert!(page.contains(".TH") && page.contains("SYNOPSIS"), "{command}");
    }
    let page = std::fs::read_to_string(folder.path().join("skep-reconstruct.1")).unwrap();
    let kept = page.split_once(".nf\n").and_then(|(_, rest)| rest.split_once(".fi\n")).unwrap().0;
    assert!(kept.contains("\n\\&    colmap point_triangulator "), "examples are not filled: {kept}");
    let (status, printed) = failure(&["man", "/dev/null/pages"]);
    assert!(status == Some(1) && printed.contains("/dev/null/pages"), "{printed}");
}
