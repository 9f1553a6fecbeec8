//! What the program tells about itself: options, completions, manual pages.

use super::{failure, path, skep, text};
use tempfile::TempDir;

#[test]
fn a_group_or_a_part_of_a_name_lists_options() {
    let listed = |word: &str| text(&skep(&["info", word]).stdout).to_owned();
    let group = listed("fusion");
    assert!(group.starts_with("Fusion"), "{group}");
    assert!(group.contains("\nfusion.depth_tolerance ") && !group.contains("check."), "{group}");
    let part = listed("tolerance");
    assert!(part.contains("check.depth_tolerance") && part.contains("fusion.depth_tolerance"), "{part}");
}

#[test]
fn an_option_that_does_not_exist_is_refused_with_similar_ones() {
    let (status, printed) = failure(&["info", "check.depth_tolerence"]);
    assert_eq!(status, Some(2));
    assert!(printed.contains("check.depth_tolerance") && printed.len() < 500, "{printed}");
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
    let (status, printed) = failure(&["man", "/dev/null/pages"]);
    assert!(status == Some(1) && printed.contains("/dev/null/pages"), "{printed}");
}
