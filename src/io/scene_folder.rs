//! Scenes from a folder with `images/` and `sparse/` or `sparse/0/`, as COLMAP's image_undistorter writes it.

use super::colmap_model::ColmapModel;
use super::files::{NAME_INSIDE, stays_inside};
use super::pictures::{picture_size, read_picture, write_picture};
use super::places::check_files;
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::Picture;
use crate::scene::{Scene, View};
use std::path::{Path, PathBuf};

/// The folders of a scene's photographs and model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneFolder {
    /// The folder that the names of the model's images are relative to.
    pub images: PathBuf,
    /// The folder of the model.
    pub sparse: PathBuf,
}

impl SceneFolder {
    /// Finds the model in `sparse/`, else in `sparse/0/`. Does not check for `images/`.
    pub fn find(folder: &Path) -> Result<SceneFolder> {
        if !folder.is_dir() {
            return Err(Error::file(folder, "no such folder; expected one with images/ and sparse/"));
        }
        let places = [folder.join("sparse"), folder.join("sparse").join("0")];
        match places.into_iter().find(|place| ColmapModel::is_in(place)) {
            Some(sparse) => Ok(SceneFolder { images: folder.join("images"), sparse }),
            None => Err(Error::file(
                folder,
                "no COLMAP model; expected cameras.bin and images.bin, or cameras.txt and images.txt, in \
                 sparse/ or sparse/0/",
            )),
        }
    }

    /// Reads the photograph of one image of the model.
    ///
    /// # Errors
    /// A missing or damaged file; another size than the camera's.
    pub fn read_picture(&self, name: &str, camera: &Camera) -> Result<Picture> {
        read_picture(&self.photograph(name, camera)?)
    }

    /// The file of one image of the model; checks its size, and decodes nothing.
    ///
    /// # Errors
    /// A missing or damaged file; another size than the camera's.
    pub fn photograph(&self, name: &str, camera: &Camera) -> Result<PathBuf> {
        let path = self.images.join(name);
        if !path.is_file() {
            let sparse = self.sparse.display();
            return Err(Error::file(
                &path,
                format!("no such file; the model in {sparse} has an image of this name"),
            ));
        }
        let (width, height) = picture_size(&path)?;
        if (width, height) != (camera.width, camera.height) {
            let expected = format!("{}x{}, the size of its camera in the model", camera.width, camera.height);
            return Err(Error::file(&path, format!("the picture is {width}x{height}; expected {expected}")));
        }
        Ok(path)
    }
}

/// Writes a scene as a folder: its photographs as PNG files under their views' names in `images/`, and a
/// binary model in `sparse/`. A name need not end in `.png`: readers of pictures look at the content.
///
/// # Errors
/// A view whose name leads outside the folder, or is also that of a folder of another view; a file that
/// cannot be written.
pub fn write_scene(folder: &Path, scene: &Scene) -> Result<()> {
    for (index, view) in scene.views().iter().enumerate() {
        if !stays_inside(&view.name) {
            return Err(Error::argument(format!("views[{index}].name"), &view.name, NAME_INSIDE));
        }
    }
    let files: Vec<PathBuf> = scene.views().iter().map(|view| Path::new("images").join(&view.name)).collect();
    check_files(folder, &files)?;
    for view in scene.views() {
        write_picture(&folder.join("images").join(&view.name), &view.picture.load()?)?;
    }
    let image = |view: &View| super::ModelImage { name: view.name.clone(), camera: view.camera };
    let images = scene.views().iter().map(image).collect();
    ColmapModel { images, points: scene.points().to_vec() }.write_binary(&folder.join("sparse"))
}
