//! Options, patterns and lists that people write.

use super::scenes::names_a_device;
use super::{new_folder, parts, write, write_workspace};
use skep::{Options, Stepper};
use tempfile::TempDir;

thread_local! {
    static SCENE: TempDir = {
        let folder = new_folder();
        write_workspace(folder.path());
        folder
    };
}

/// Lines `NAME=VALUE` that are set one after the other.
pub fn options(input: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(input) else { return false };
    let mut options = Options::default();
    for line in text.lines() {
        let _ = skep::parse_bytes(line);
        let (name, value) = line.split_once('=').unwrap_or((line, ""));
        let _ = (Options::info(name), options.get(name));
        if options.set(name, value).is_ok() {
            let written = options.get(name).expect("an option that was set").to_string();
            let mut again = options.clone();
            again.set(name, &written).expect("the text of an option");
            assert_eq!(again.get(name).expect("an option that was set").to_string(), written);
        }
        if let Ok(number) = value.parse() {
            let _ = options.set_number(name, number);
        }
    }
    let _ = options.input.bounds();
    if options.check().is_ok() {
        for (name, value) in options.values() {
            Options::default().set(name, &value.to_string()).expect("the text of a value");
        }
    }
    options != Options::default()
}

/// Patterns of photographs and of references, a box, and files of source views, depth ranges and patterns.
pub fn lists(input: &[u8]) -> bool {
    if names_a_device(input) {
        return false;
    }
    let parts = parts(input);
    let text = |index: usize| std::str::from_utf8(parts.get(index).unwrap_or(&&b""[..])).ok();
    SCENE.with(|folder| {
        let mut options = Options { threads: 1, ..Options::default() };
        let (Some(images), Some(reference), Some(bounds)) = (text(0), text(1), text(2)) else { return false };
        for (name, value) in [("images", images), ("reference", reference), ("bounds", bounds)] {
            if options.set(&format!("input.{name}"), value).is_err() {
                return false;
            }
        }
        for (index, name) in [(3, "sources"), (4, "depth_ranges"), (5, "images")] {
            let Some(content) = parts.get(index).filter(|content| !content.is_empty()) else { continue };
            let path = folder.path().join(format!("{name}.list"));
            write(&path, content);
            let _ = options.set(&format!("input.{name}"), path.to_str().expect("UTF-8"));
        }
        let read = skep::import::read_scene(folder.path(), None, &options, &skep::ignore_progress);
        read.is_ok_and(|scene| Stepper::new(&scene, &options).is_ok())
    })
}
