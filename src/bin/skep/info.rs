//! `skep info`: what this build and machine offer, and what the presets hold.

use crate::streams;
use skep::Options;
use skep::simd::Level;

/// Prints it all.
pub fn run() {
    let version = env!("CARGO_PKG_VERSION");
    let level = Level::detect().name();
    streams::result(&format!("skep {version}\nSIMD level: {level}\nthreads: {}\n", cores()));
    preset_table().iter().for_each(|line| streams::result(line));
}

/// The threads that `--threads 0` takes.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// A row for each option, a column for each preset.
fn preset_table() -> Vec<String> {
    let presets: Vec<Vec<(&str, String)>> = (Options::PRESETS.iter())
        .map(|name| Options::preset(name).expect("presets are found by their names").entries())
        .collect();
    let mut lines = row("option", &Options::PRESETS);
    for (place, (name, _)) in presets[0].iter().enumerate() {
        let values: Vec<&str> = presets.iter().map(|entries| entries[place].1.as_str()).collect();
        lines.extend(row(name, &values));
    }
    lines
}

/// The lines of one row: a value of several parts takes a line for each.
fn row(name: &str, values: &[&str]) -> Vec<String> {
    let parts: Vec<Vec<&str>> = values.iter().map(|value| value.split("; ").collect()).collect();
    let count = parts.iter().map(Vec::len).max().unwrap_or(0);
    let line = |index: usize| {
        let mut line = format!("{:<24}", if index == 0 { name } else { "" });
        for parts in &parts {
            line += &format!("{:<34}", parts.get(index).unwrap_or(&""));
        }
        line.trim_end().to_owned()
    };
    (0..count).map(line).collect()
}
