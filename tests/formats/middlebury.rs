//! Middlebury's files of cameras.

use crate::*;
use tempfile::{TempDir, tempdir};

fn line(ModelImage { name, camera }: &ModelImage) -> String {
    let k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0];
    let pose = [rows(camera).as_flattened(), &camera.translation.to_array()].concat();
    format!("{name} {} {}\n", words(&k), words(&pose))
}

fn lines() -> String {
    let images = model().images;
    format!("{}\n{}", images.len(), images.iter().map(line).collect::<String>())
}

fn scene(lines: &str) -> TempDir {
    let folder = tempdir().unwrap();
    copy_photographs(folder.path());
    write(&folder.path().join("board_par.txt"), lines);
    folder
}

#[test]
fn the_scene_is_read_from_the_folder_and_the_file() {
    let folder = scene(&lines());
    for path in ["", "board_par.txt"] {
        let scene = read(&folder.path().join(path)).unwrap();
        assert_cameras(&scene);
        assert!(scene.points.is_empty() && scene.warnings.is_empty());
    }
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let change = |from: &str, to: &str| scene(&lines().replacen(from, to, 1));
    let file = "board_par.txt, line ";
    let cases = [
        (change("7\n", "8\n"), &[file, "the file ends here", "the name of photograph 7 of 8"][..]),
        (change("7\n", "6\n"), &[file, "source5.jpg", "expected the end of the file"]),
        (change("7\n", "x\n"), &["line 1", "number of photographs is \"x\""]),
        (change("key.jpg", "no.jpg"), &["no.jpg", "no such file", "board_par.txt"]),
        (change("key.jpg 462.4", "key.jpg NaN 462.4"), &["line 2", "key.jpg is NaN", "finite"]),
        (change("key.jpg 462.4", "key.jpg -462.4"), &["line 2", "key.jpg.fx is -462.4"]),
        (change("0.0 0.0 1.0 1.0 0.0", "0.0 0.0 1.0 1.01 0.0"), &["line 2", "rotation of key.jpg is [1.01"]),
        (change("key.jpg 462.4376220703125 0.0", "key.jpg 462.4376220703125 3.0"), &["line 2", "skew up to"]),
        (change("source0.jpg", "key.jpg"), &["key.jpg", "photograph of two entries"]),
    ];
    for (folder, words) in cases {
        assert_refused(folder.path(), words);
    }
}

#[test]
fn one_of_several_files_must_be_named() {
    let folder = scene(&lines());
    write(&folder.path().join("other_par.txt"), lines());
    assert_refused(folder.path(), &["board_par.txt", "other_par.txt", "expected one"]);
    assert!(read(&folder.path().join("other_par.txt")).is_ok());
}
