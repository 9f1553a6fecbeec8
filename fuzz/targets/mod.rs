//! What the fuzz targets do with their input. `fuzz_targets/` calls these functions from libFuzzer,
//! `tests/fuzz_seeds.rs` with the seeds and mutations of them, so that both run the same code.
//!
//! An input of several files has [`BETWEEN`] between them. Readers take paths: each thread has a folder with
//! the files that do not change, and writes the input beside them.

mod c_api;
mod files;
mod run;
mod scenes;
mod texts;

use std::path::Path;
use tempfile::TempDir;

/// What a target does with its input; whether it was accepted, and did not merely end in errors.
pub type Body = fn(&[u8]) -> bool;

/// The targets by name.
pub const TARGETS: [(&str, Body); 12] = [
    ("colmap_text", scenes::colmap_text),
    ("colmap_binary", scenes::colmap_binary),
    ("scene_formats", scenes::scene_formats),
    ("maps", files::maps),
    ("clouds", files::clouds),
    ("pictures", files::pictures),
    ("options", texts::options),
    ("lists", texts::lists),
    ("run_files", run::run_files),
    ("estimates", run::estimates),
    ("c_api", c_api::pixels_and_arrays),
    ("c_files", c_api::files),
];

/// Runs the target of this name; whether the input was accepted.
pub fn run(name: &str, input: &[u8]) -> bool {
    let (_, body) = TARGETS.iter().find(|(known, _)| *known == name).expect("a target of this name");
    body(input)
}

/// Stands between the files of an input.
pub const BETWEEN: &[u8] = b"\n=====\n";

/// The files of an input.
fn parts(input: &[u8]) -> Vec<&[u8]> {
    let mut parts = Vec::new();
    let mut rest = input;
    while let Some(at) = rest.windows(BETWEEN.len()).position(|window| window == BETWEEN) {
        parts.push(&rest[..at]);
        rest = &rest[at + BETWEEN.len()..];
    }
    parts.push(rest);
    parts
}

/// A run as the target `run_files` opens it.
pub fn new_run() -> run::Run {
    run::Run::new()
}

pub use run::stepper;

/// Writes the files of an input under these names, and removes those that it does not have.
fn write_parts(folder: &Path, names: &[&str], input: &[u8]) {
    let parts = parts(input);
    for (index, name) in names.iter().enumerate() {
        let path = folder.join(name);
        match parts.get(index) {
            Some(part) => write(&path, part),
            None => drop(std::fs::remove_file(path)),
        }
    }
}

fn write(path: &Path, content: &[u8]) {
    std::fs::create_dir_all(path.parent().expect("a file in a folder")).expect("a temporary folder");
    std::fs::write(path, content).expect("a temporary file");
}

/// A folder in memory where there is one: writers wait for disks.
fn new_folder() -> TempDir {
    let in_memory = tempfile::tempdir_in("/dev/shm");
    in_memory.or_else(|_| tempfile::tempdir()).expect("a temporary folder")
}

/// Width and height of the photographs beside the input.
const SIZE: (u32, u32) = (24, 16);
/// Their names: those of MVSNet are numbers, those of a run are these as well.
const NAMES: [&str; 3] = ["00000000.png", "00000001.png", "00000002.png"];

/// A photograph with texture.
fn photograph(shift: u32) -> skep::image::Picture {
    let (width, height) = SIZE;
    let gray = |pixel: u32| {
        let (x, y) = (pixel % width + shift, pixel / width);
        (x * 37 + y * 91 + x * y * 13) as u8
    };
    skep::image::Picture::from_gray(width, height, (0..width * height).map(gray).collect()).expect("a size")
}

/// Writes the photographs into a folder.
fn write_photographs(folder: &Path) {
    for (shift, name) in (0..).zip(NAMES) {
        skep::io::write_picture(&folder.join(name), &photograph(shift)).expect("a temporary file");
    }
}

/// The model of the photographs as COLMAP's text files: cameras side by side before a wall.
const MODEL: [(&str, &str); 3] = [
    ("cameras.txt", "1 PINHOLE 24 16 24 24 12 8\n"),
    (
        "images.txt",
        "1 1 0 0 0 0 0 0 1 00000000.png\n12 8 1 14 9 2\n2 1 0 0 0 -0.2 0 0 1 00000001.png\n11 8 1 13 9 2\n\
         3 1 0 0 0 -0.4 0 0 1 00000002.png\n10 8 1 12 9 2\n",
    ),
    ("points3D.txt", "1 0 0 4 9 9 9 0.5 1 0 2 0 3 0\n2 0.4 0.2 5 9 9 9 0.5 1 1 2 1 3 1\n"),
];

/// Writes photographs and model: a workspace of COLMAP.
fn write_workspace(folder: &Path) {
    write_photographs(&folder.join("images"));
    for (name, content) in MODEL {
        write(&folder.join("sparse").join(name), content.as_bytes());
    }
}
