//! Scenes from folders.

use crate::{assert_refused, model};
use image::{ImageBuffer, Rgb};
use skep::DepthRange;
use skep::import;
use skep::io::{ColmapModel, SceneFolder, write_scene};
use skep::{Options, Result, Scene, View};
use std::path::Path;
use tempfile::tempdir;

/// Writes a picture for each image of the model, of its camera's size, the image's index in red.
pub fn write_pictures(folder: &Path, model: &ColmapModel) {
    for (index, image) in model.images.iter().enumerate() {
        let path = folder.join("images").join(&image.name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        let (width, height) = (image.camera.width, image.camera.height);
        ImageBuffer::from_pixel(width, height, Rgb([index as u8, 50, 60])).save(path).unwrap();
    }
}

/// Reads a scene with the default options.
fn read_scene(folder: &Path, depth_range: Option<DepthRange>) -> Result<Scene> {
    import::read_scene(folder, depth_range, &Options::default(), &skep::ignore_progress)
}

const RANGE: Option<DepthRange> = Some(DepthRange { near: 1.0, far: 9.0 });

#[test]
fn a_scene_is_read_from_sparse_and_from_sparse_0() {
    for place in ["sparse", "sparse/0"] {
        let folder = tempdir().unwrap();
        write_pictures(folder.path(), &model());
        model().write_text(&folder.path().join(place)).unwrap();
        assert_eq!(SceneFolder::find(folder.path()).unwrap().sparse, folder.path().join(place));
        let scene = read_scene(folder.path(), None).unwrap();
        assert_eq!(scene.views()[1].name, "cam 1/right side.png");
        assert_eq!(scene.views()[1].picture.decoded().unwrap().rgb(0), [1, 50, 60]);
        assert_eq!(scene.views()[0].camera.cx, 2.5);
        assert_eq!(scene.points().len(), 3);
        assert!(scene.depth_range(0).near < 4.0 && scene.depth_range(0).far > 4.0);
    }
}

#[test]
fn a_given_depth_range_holds_for_every_view() {
    let folder = tempdir().unwrap();
    write_pictures(folder.path(), &model());
    model().write_binary(&folder.path().join("sparse")).unwrap();
    let scene = read_scene(folder.path(), RANGE).unwrap();
    assert_eq!((scene.depth_range(0), scene.depth_range(1)), (RANGE.unwrap(), RANGE.unwrap()));
}

#[test]
fn without_points_a_depth_range_is_needed() {
    let folder = tempdir().unwrap();
    write_pictures(folder.path(), &model());
    ColmapModel { points: vec![], ..model() }.write_text(&folder.path().join("sparse")).unwrap();
    assert_refused(read_scene(folder.path(), None), &["depth range", "points", "--depth-range MIN MAX"]);
    assert!(read_scene(folder.path(), RANGE).is_ok());
}

#[test]
fn what_is_missing_is_named() {
    let folder = tempdir().unwrap();
    assert_refused(read_scene(&folder.path().join("none"), None), &["none", "no such file or folder"]);
    assert_refused(
        read_scene(folder.path(), None),
        &["no scene", "COLMAP model", "sparse/", "transforms.json"],
    );
    let photographs = tempdir().unwrap();
    std::fs::write(photographs.path().join("IMG_1.JPG"), "").unwrap();
    assert_refused(read_scene(photographs.path(), None), &["photographs without cameras", "COLMAP finds"]);
    model().write_text(&folder.path().join("sparse")).unwrap();
    assert_refused(read_scene(folder.path(), None), &["images", "no such folder"]);
    write_pictures(folder.path(), &model());
    std::fs::remove_file(folder.path().join("images/cam 1/right side.png")).unwrap();
    assert_refused(read_scene(folder.path(), None), &["cam 1/right side.png", "no such file", "sparse"]);
}

#[test]
fn a_picture_of_another_size_is_refused_with_both_sizes() {
    let folder = tempdir().unwrap();
    write_pictures(folder.path(), &model());
    let mut model = model();
    model.images[1].camera.width = 7;
    model.write_text(&folder.path().join("sparse")).unwrap();
    assert_refused(read_scene(folder.path(), None), &["right side.png", "picture is 6x4", "7x4"]);
}

#[test]
fn one_view_is_refused() {
    let folder = tempdir().unwrap();
    let mut model = model();
    model.images.truncate(1);
    model.points.clear();
    write_pictures(folder.path(), &model);
    model.write_text(&folder.path().join("sparse")).unwrap();
    assert_refused(read_scene(folder.path(), RANGE), &["views is 1", "at least 2"]);
}

#[test]
fn a_scene_that_is_written_is_read_back_the_same() {
    let folder = tempdir().unwrap();
    write_pictures(folder.path(), &model());
    model().write_text(&folder.path().join("sparse")).unwrap();
    let scene = read_scene(folder.path(), None).unwrap();
    let copy = tempdir().unwrap();
    write_scene(copy.path(), &scene).unwrap();
    let again = read_scene(copy.path(), None).unwrap();
    assert_eq!(again.points(), scene.points());
    for (again, view) in again.views().iter().zip(scene.views()) {
        assert_eq!((&again.name, again.picture.decoded()), (&view.name, view.picture.decoded()));
        let difference = again.camera.rotation - view.camera.rotation;
        assert!(difference.to_cols_array().iter().all(|entry| entry.abs() < 1e-12));
        assert_eq!((again.camera.cx, again.camera.translation), (view.camera.cx, view.camera.translation));
    }
}

#[test]
fn a_view_may_have_any_name_that_is_a_file_of_the_folder() {
    let folder = tempdir().unwrap();
    write_pictures(folder.path(), &model());
    model().write_text(&folder.path().join("sparse")).unwrap();
    let (views, points) = read_scene(folder.path(), None).unwrap().into_parts();
    for name in ["photograph.jpg", "photograph", "left/0001", "rück wärts.tif"] {
        let mut renamed = views.clone();
        renamed[0] = View { name: name.to_owned(), ..views[0].clone() };
        let scene = Scene::new(renamed, points.clone()).unwrap();
        let target = tempdir().unwrap();
        write_scene(target.path(), &scene).unwrap();
        let again = read_scene(target.path(), None).unwrap();
        assert_eq!(again.views()[0].name, name);
        assert_eq!(again.views()[0].picture.decoded(), views[0].picture.decoded());
    }
    // The other view is in a folder of this name.
    for name in ["../outside.png", "/outside.png", "left//a.png", "left/./a.png", "cam 1", ""] {
        let mut renamed = views.clone();
        renamed[0] = View { name: name.to_owned(), ..views[0].clone() };
        let scene = Scene::new(renamed, points.clone()).unwrap();
        let target = folder.path().join("copy");
        assert_refused(write_scene(&target, &scene), &[name]);
        assert!(!target.exists(), "nothing is written");
    }
}
