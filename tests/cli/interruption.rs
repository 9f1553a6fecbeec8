//! Ctrl-C and SIGTERM: the exit status, what is printed, and that files are complete.

use super::layouts::map;
use super::{HEIGHT, WIDTH, board, command, files, path, small_board};
use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Starts a run and sends it a signal once a line of its progress begins with `cue`; gives its exit status
/// and what it printed after the cue.
fn interrupted(arguments: &[&str], cue: &str, signal: &str) -> (Option<i32>, String) {
    let mut process = command(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(process.stderr.take().unwrap()).lines().map(|line| line.unwrap());
    assert!(lines.by_ref().any(|line| line.starts_with(cue)), "no line begins with {cue}");
    let sent = Command::new("kill").args([signal, &process.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let printed = lines.collect::<Vec<_>>().join("\n");
    (process.wait().unwrap().code(), printed)
}

#[test]
fn ctrl_c_and_sigterm_during_the_search_leave_everything_as_it_was() {
    let output = TempDir::new().unwrap();
    let earlier = output.path().join("report.json");
    for signal in ["-INT", "-TERM"] {
        fs::write(&earlier, "of an earlier run").unwrap();
        let board = board();
        let arguments = ["reconstruct", board.to_str().unwrap(), "--output", path(&output)];
        let (status, printed) = interrupted(&arguments, "search", signal);
        assert_eq!(status, Some(130), "{printed}");
        assert!(printed.contains("interrupted: nothing was written"), "{printed}");
        assert_eq!(files(output.path()), [(earlier.clone(), 17)]);
    }
}

#[test]
fn ctrl_c_during_the_writing_leaves_complete_files() {
    let scene = small_board();
    let (status, printed) = interrupted(&["reconstruct", path(&scene)], "writing", "-INT");
    let dense = scene.path().join("dense");
    // The few files may be written before the signal arrives.
    let finished = status == Some(0);
    assert!(finished || status == Some(130) && printed.contains("complete"), "{status:?} {printed}");
    assert_eq!(finished, dense.join("report.json").exists(), "only finished runs have a report");
    let stereo = dense.join("stereo");
    // It may also arrive before the first file.
    let written = if stereo.exists() { files(&stereo) } else { Vec::new() };
    for (path, _) in written.into_iter().filter(|(path, _)| path.extension().is_some_and(|e| e == "bin")) {
        let channels = match path.components().any(|part| part.as_os_str() == "normal_maps") {
            true => 3,
            false => 1,
        };
        let is_graph = path.components().any(|part| part.as_os_str() == "consistency_graphs");
        let whole = is_graph || map(&path, WIDTH / 4, HEIGHT / 4, channels).is_some();
        assert!(whole, "{} is not complete", path.display());
    }
}
