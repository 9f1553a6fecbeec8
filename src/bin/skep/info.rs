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
    let [first, second] = Options::PRESETS;
    let values = Options::default().entries().into_iter().zip(Options::paper().entries());
    let rows = values.flat_map(|((name, left), (_, right))| row(name, &left, &right));
    row("option", first, second).into_iter().chain(rows).collect()
}

/// The lines of one row: a value of several parts takes a line for each.
fn row(name: &str, left: &str, right: &str) -> Vec<String> {
    let (mut left, mut right) = (left.split("; "), right.split("; "));
    let mut lines = Vec::new();
    let mut name = name;
    loop {
        match (left.next(), right.next()) {
            (None, None) => return lines,
            (left, right) => {
                let line = format!("{name:<24}{:<34}{}", left.unwrap_or(""), right.unwrap_or(""));
                lines.push(line.trim_end().to_owned());
                name = "";
            }
        }
    }
}
