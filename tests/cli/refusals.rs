//! What a run would fail of is refused before the search, and leaves nothing behind.

use super::{NAMES, failure, files, path, small_board};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Gives the first photograph of a scene another name.
fn rename(scene: &Path, name: &str) {
    let to = scene.join("images").join(name);
    fs::create_dir_all(to.parent().unwrap()).unwrap();
    fs::rename(scene.join("images").join(NAMES[0]), to).unwrap();
    let list = scene.join("sparse/images.txt");
    let renamed = fs::read_to_string(&list).unwrap().replace(NAMES[0], name);
    fs::write(list, renamed).unwrap();
}

/// Runs a scene, which must be refused before the search with a text of these parts, and leave nothing.
#[track_caller]
fn assert_refused(scene: &TempDir, parts: &[&str]) {
    let before = files(scene.path());
    let (status, printed) = failure(&["reconstruct", path(scene), "--preset", "fast"]);
    assert_eq!(status, Some(1), "{printed}");
    assert!(parts.iter().all(|part| printed.contains(part)), "{parts:?}: {printed}");
    assert!(!printed.contains("search"), "{printed}");
    assert_eq!(files(scene.path()), before);
    assert!(!scene.path().join("dense/run").exists());
}

#[test]
fn a_name_that_is_too_long_for_its_maps() {
    let scene = small_board();
    rename(scene.path(), &format!("{}.jpg", "x".repeat(240)));
    assert_refused(&scene, &["a name of 260 bytes is too long", "rename the photograph"]);
    assert!(!scene.path().join("dense").exists());
}

#[test]
fn a_folder_called_like_the_map_of_another_view() {
    let scene = small_board();
    rename(scene.path(), "source0.jpg.geometric.bin/key.jpg");
    assert_refused(&scene, &["key.jpg.", "source0.jpg.geometric.bin"]);
}

#[test]
fn files_and_folders_in_the_way() {
    let scene = small_board();
    fs::create_dir(scene.path().join("dense")).unwrap();
    fs::write(scene.path().join("dense/stereo"), "").unwrap();
    assert_refused(&scene, &["dense/stereo: a file; expected a folder"]);
    fs::remove_file(scene.path().join("dense/stereo")).unwrap();
    fs::create_dir_all(scene.path().join("dense/fused.ply.vis")).unwrap();
    assert_refused(&scene, &["dense/fused.ply.vis: cannot be written: a folder has this name"]);
}

#[test]
fn photographs_in_place_of_masks() {
    let scene = small_board();
    let before = files(scene.path());
    let images = scene.path().join("images/../images");
    for argument in [["--masks", images.to_str().unwrap()], ["--set", "masks=images"]] {
        let mut command = super::command(&["reconstruct", path(&scene), argument[0], argument[1]]);
        let refused = command.current_dir(scene.path()).output().unwrap();
        let printed = super::text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{printed}");
        assert!(
            printed.contains("input.masks is ") && printed.contains("that of the photographs"),
            "{printed}"
        );
    }
    assert_eq!(files(scene.path()), before);
}

#[test]
fn a_scene_that_is_no_scene_but_a_file() {
    let scene = small_board();
    let photograph = scene.path().join("images").join(NAMES[0]);
    let (status, printed) = failure(&["reconstruct", photograph.to_str().unwrap()]);
    assert!(status == Some(1) && printed.contains("key.jpg: photographs without cameras"), "{printed}");
    assert!(!scene.path().join("images/dense").exists());
}

#[test]
fn two_names_of_one_file() {
    for name in ["d//key.jpg", "d/./key.jpg", "./key.jpg", "d/key.jpg/"] {
        let scene = small_board();
        let list = scene.path().join("sparse/images.txt");
        let renamed = fs::read_to_string(&list).unwrap().replace(NAMES[0], name);
        fs::write(list, renamed).unwrap();
        assert_refused(&scene, &["images.txt, line", name, "without `..`, `.` or empty parts"]);
    }
}

#[test]
fn a_truncated_photograph_and_memory_that_does_not_suffice() {
    let scene = small_board();
    let photograph = scene.path().join("images").join(NAMES[2]);
    let bytes = fs::read(&photograph).unwrap();
    fs::write(&photograph, &bytes[..bytes.len() * 2 / 5]).unwrap();
    assert_refused(&scene, &[NAMES[2], "truncated"]);
    fs::write(&photograph, [&bytes[..], b"what a camera appends"].concat()).unwrap();
    let (status, printed) = failure(&["plan", path(&scene), "--memory", "10MiB"]);
    assert_eq!(status, Some(1), "{printed}");
    assert!(printed.contains("options.memory"), "{printed}");
    assert!(!scene.path().join("dense").exists());
}
