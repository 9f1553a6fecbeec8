//! Ctrl-C, SIGTERM and kill -9: the exit status, what is printed, and that the same command goes on.

use super::{board, command, failure, files, path, skep, small_board, text};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
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

/// The results below a folder: all files but those of the run itself and the report with its times.
pub(super) fn results(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let relative = |path: &Path| path.strip_prefix(folder).unwrap().to_owned();
    let is_report = |path: &Path| path.ends_with("report.json") || path.ends_with("report.html");
    let is_result = |path: &Path| !path.starts_with("run") && !is_report(path);
    let all = files(folder).into_iter().map(|(path, _)| relative(&path)).filter(|path| is_result(path));
    all.map(|path| (path.clone(), std::fs::read(folder.join(path)).unwrap())).collect()
}

/// Whether the tests, and so the commands they start, ignore a signal: `nohup` and `&` of scripts ask for
/// that.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() >> (signal - 1) & 1 == 1)
}

#[test]
fn each_signal_ends_with_its_status_and_says_how_to_go_on() {
    for (signal, expected) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        if is_ignored(expected - 128) {
            continue;
        }
        let (output, board) = (TempDir::new().unwrap(), board());
        let arguments = ["reconstruct", board.to_str().unwrap(), "--output", path(&output)];
        let (status, printed) = interrupted(&arguments, "search", signal);
        assert_eq!(status, Some(expected), "{printed}");
        assert!(printed.contains("interrupted") && printed.contains("the same command goes on"), "{printed}");
        assert!(!output.path().join("report.json").exists(), "only finished runs have a report");
        assert!(!output.path().join("fused.ply").exists());
    }
}

#[test]
fn an_interruption_while_photographs_are_read_leaves_nothing() {
    let (folder, scene) = (TempDir::new().unwrap(), board());
    let dense = folder.path().join("new/dense");
    let arguments = ["reconstruct", scene.to_str().unwrap(), "--output", dense.to_str().unwrap()];
    let (status, printed) = interrupted(&arguments, "read", "-TERM");
    assert_eq!(status, Some(143), "{printed}");
    if printed.contains("nothing was changed") {
        assert!(!folder.path().join("new").exists());
    }
}

/// As `nohup` and the `&` of a script have it.
#[test]
#[cfg(target_os = "linux")]
fn signals_that_are_ignored_at_the_start_stay_ignored() {
    let (scene, output) = (small_board(), TempDir::new().unwrap());
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' INT HUP; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_skep")]);
    shell.args(["reconstruct", path(&scene), "--preset", "fast", "--output", path(&output)]);
    let mut process = shell.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(process.stderr.take().unwrap()).lines().map(|line| line.unwrap());
    assert!(lines.by_ref().any(|line| line.starts_with("search")));
    for signal in ["-INT", "-HUP"] {
        assert!(Command::new("kill").args([signal, &process.id().to_string()]).status().unwrap().success());
    }
    let printed = lines.collect::<Vec<_>>().join("\n");
    assert!(process.wait().unwrap().success(), "{printed}");
    assert!(output.path().join("fused.ply").is_file());
}

#[test]
fn a_run_that_is_killed_goes_on_and_gives_the_same_bits() {
    let scene = small_board();
    let (whole, killed) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let arguments = |output| ["reconstruct", path(&scene), "--preset", "fast", "--quiet", "--output", output];
    let done = skep(&arguments(path(&whole)));
    assert!(done.status.success(), "{}", text(&done.stderr));

    let tasks = killed.path().join("run/tasks");
    let count = || std::fs::read_dir(&tasks).map_or(0, Iterator::count);
    let mut kills = 0;
    for least in [3, 20, 40] {
        let mut process = command(&arguments(path(&killed))).spawn().unwrap();
        while count() < least && process.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        kills += usize::from(process.try_wait().unwrap().is_none());
        process.kill().unwrap();
        process.wait().unwrap();
        assert!(count() >= least, "what is done is kept");
    }
    assert!(kills > 0, "every process was faster than the test");
    let done = skep(&arguments(path(&killed)));
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(results(whole.path()) == results(killed.path()));
}

#[test]
fn a_disk_without_room_is_named_and_the_run_goes_on_when_there_is_room() {
    let scene = small_board();
    let (whole, full) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let arguments = |output| ["reconstruct", path(&scene), "--preset", "fast", "--quiet", "--output", output];
    assert!(skep(&arguments(path(&whole))).status.success());

    // No file of more than 150 kB: the estimates at half size fit, those at full size do not.
    let mut limited = Command::new("sh");
    limited.args(["-c", "trap '' XFSZ; ulimit -f 300; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_skep")]);
    let failed = limited.args(arguments(path(&full))).output().unwrap();
    let printed = text(&failed.stderr);
    assert_eq!(failed.status.code(), Some(1), "{printed}");
    assert!(printed.contains("run/estimates") && printed.contains("cannot be written"), "{printed}");
    assert!(!full.path().join("report.json").exists() && !full.path().join("fused.ply").exists());

    let done = skep(&arguments(path(&full)));
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(results(whole.path()) == results(full.path()));
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_before_anything_is_read() {
    let scene = small_board();
    let file = scene.path().join("file");
    std::fs::write(&file, "").unwrap();
    // As root no folder is read-only: one below a file stands for it.
    let output = file.join("dense");
    let (status, printed) = failure(&["reconstruct", path(&scene), "--output", output.to_str().unwrap()]);
    assert_eq!(status, Some(1), "{printed}");
    let expected = format!("{}: cannot be written: {} is a file", output.display(), file.display());
    assert!(printed.contains(&expected), "{printed}");
    assert!(!printed.contains("read, 7 views"), "{printed}");
}
