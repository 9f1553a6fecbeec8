//! `--dump`: pictures of every cycle, and the same result as without it.

use super::{NAMES, files, path, report, skep, small_board, text};
use std::path::Path;
use tempfile::TempDir;

#[test]
fn a_dump_has_pictures_of_every_cycle_and_changes_no_result() {
    let scene = small_board();
    let schedule = "downscale=2 food_sources=2 iterations=1+1x1; downscale=1 food_sources=2 iterations=1+0x1";
    let run = |more: &[&str]| {
        let output = TempDir::new().unwrap();
        let arguments = ["reconstruct", path(&scene), "--schedule", schedule, "--output", path(&output)];
        let printed = skep(&[&arguments[..], more].concat());
        assert!(printed.status.success(), "{}", text(&printed.stderr));
        output
    };
    let dump = TempDir::new().unwrap();
    let (plain, dumped) = (run(&[]), run(&["--dump", path(&dump)]));

    let names = |folder: &TempDir| -> Vec<_> {
        files(folder.path())
            .into_iter()
            .map(|(file, _)| file.strip_prefix(folder.path()).unwrap().to_owned())
            .collect()
    };
    assert_eq!(names(&plain), names(&dumped));
    let is_report = |file: &Path| file.ends_with("report.json") || file.ends_with("report.html");
    for file in names(&plain).iter().filter(|file| !is_report(file)) {
        let read = |folder: &TempDir| std::fs::read(folder.path().join(file)).unwrap();
        assert!(read(&plain) == read(&dumped), "{} differs", file.display());
    }
    let cycles = report(plain.path())["totals"]["cycles"].clone();
    assert_eq!(cycles, report(dumped.path())["totals"]["cycles"]);

    let folders = [("00-size2-cycle1", 2), ("01-size2-cycle2", 2), ("02-size1-cycle1", 1)];
    assert_eq!(names(&dump).len(), folders.len() * NAMES.len() * 3);
    for (cycle, (folder, downscale)) in folders.iter().enumerate() {
        let mut white = 0;
        for name in NAMES {
            let picture = |what: &str| {
                image::open(dump.path().join(folder).join(format!("{name}.{what}.png"))).unwrap()
            };
            for what in ["depth", "normal", "validated"] {
                assert_eq!(picture(what).width(), 160 / downscale, "{folder}/{name}.{what}");
            }
            white += picture("validated").to_luma8().pixels().filter(|pixel| pixel.0 == [255]).count();
        }
        assert_eq!(cycles[cycle]["validated"], white, "{folder}");
    }
}
