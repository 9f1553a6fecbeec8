//! The dense folder: maps, consistency graphs, previews and the fused cloud, laid out as COLMAP does.

use super::cloud::{self, visibility_path, write_visibility};
use super::colmap_maps::{Grid, read_depth_map, read_normal_map};
use super::colmap_model::{ColmapModel, ModelImage};
use super::files::{NAME_INSIDE, cannot_be_read, copy_file, link_or_copy, stays_inside, write_file};
use super::scene_folder::SceneFolder;
use crate::error::{Error, Result};
use crate::fusion::PointCloud;
use crate::geometry::Camera;
use crate::options::CloudFormat;
use crate::scene::Maps;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Kind of a view's maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapKind {
    /// The raw estimate of every pixel; "photometric" in COLMAP's file names.
    Raw,
    /// The validated pixels only; "geometric" in COLMAP's file names.
    Validated,
}

impl MapKind {
    /// COLMAP's name of the kind, a part of file names.
    pub fn colmap_name(self) -> &'static str {
        match self {
            MapKind::Raw => "photometric",
            MapKind::Validated => "geometric",
        }
    }
}

/// A dense folder. Views have the names of the model's images, which may contain folders.
///
/// # Examples
/// ```
/// use skep::io::{MapKind, Workspace};
/// use std::path::Path;
///
/// let workspace = Workspace::new("dense");
/// let map = workspace.depth_map("left/1.jpg", MapKind::Validated);
/// assert_eq!(map, Path::new("dense/stereo/depth_maps/left/1.jpg.geometric.bin"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Workspace {
    folder: PathBuf,
}

impl Workspace {
    /// The dense folder at this path; reads and creates nothing.
    pub fn new(folder: impl Into<PathBuf>) -> Workspace {
        Workspace { folder: folder.into() }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// `stereo/depth_maps/NAME.KIND.bin`
    pub fn depth_map(&self, name: &str, kind: MapKind) -> PathBuf {
        self.map("depth_maps", name, kind)
    }

    /// `stereo/normal_maps/NAME.KIND.bin`
    pub fn normal_map(&self, name: &str, kind: MapKind) -> PathBuf {
        self.map("normal_maps", name, kind)
    }

    /// `stereo/consistency_graphs/NAME.KIND.bin`
    pub fn consistency_graph(&self, name: &str, kind: MapKind) -> PathBuf {
        self.map("consistency_graphs", name, kind)
    }

    /// `stereo/confidence_maps/NAME.KIND.bin`
    pub fn confidence_map(&self, name: &str, kind: MapKind) -> PathBuf {
        self.map("confidence_maps", name, kind)
    }

    /// `stereo/status_maps/NAME.png`
    pub fn status_map(&self, name: &str) -> PathBuf {
        self.folder.join("stereo").join("status_maps").join(format!("{name}.png"))
    }

    /// `preview/NAME.WHAT.png`, `what` being `depth`, `normal`, `views` or `confidence`.
    pub fn preview(&self, name: &str, what: &str) -> PathBuf {
        self.folder.join("preview").join(format!("{name}.{what}.png"))
    }

    /// `fused.ply`
    pub fn cloud(&self) -> PathBuf {
        self.cloud_as(CloudFormat::Ply)
    }

    /// `fused.FORMAT`
    pub fn cloud_as(&self, format: CloudFormat) -> PathBuf {
        self.folder.join(format!("fused.{}", format.name()))
    }

    /// `splat/`
    pub fn splat(&self) -> PathBuf {
        self.folder.join("splat")
    }

    pub(super) fn map(&self, what: &str, name: &str, kind: MapKind) -> PathBuf {
        self.folder.join("stereo").join(what).join(format!("{name}.{}.bin", kind.colmap_name()))
    }

    /// Returns an error for a view's name whose files would be outside the folder.
    pub fn check_name(name: &str) -> Result<()> {
        if stays_inside(name) { Ok(()) } else { Err(Error::argument("view's name", name, NAME_INSIDE)) }
    }

    /// Writes `stereo/patch-match.cfg` and `stereo/fusion.cfg`, the lists of images that COLMAP requires.
    pub fn write_lists<'a>(&self, names: impl Iterator<Item = &'a str> + Clone) -> Result<()> {
        let stereo = self.folder.join("stereo");
        write_file(&stereo.join("fusion.cfg"), |out| {
            names.clone().try_for_each(|name| writeln!(out, "{name}"))
        })?;
        // `__auto__` lets COLMAP choose the source views itself.
        write_file(&stereo.join("patch-match.cfg"), |out| {
            names.clone().try_for_each(|name| writeln!(out, "{name}\n__auto__, 20"))
        })
    }

    /// Adds photographs and model of the scene, which makes the folder a COLMAP workspace. The model is
    /// copied, since tools change models in place; photographs are hard-linked where the file system can,
    /// else copied. Existing files are kept.
    pub fn adopt(&self, scene: &SceneFolder) -> Result<()> {
        let is_new = |from: &Path, to: &Path| from.is_file() && !to.exists();
        for image in ColmapModel::read(&scene.sparse)?.images {
            let (from, to) = (scene.images.join(&image.name), self.folder.join("images").join(&image.name));
            if is_new(&from, &to) {
                link_or_copy(&from, &to)?;
            }
        }
        for stem in ["cameras", "images", "points3D"] {
            for name in ["bin", "txt"].map(|extension| format!("{stem}.{extension}")) {
                let (from, to) = (scene.sparse.join(&name), self.folder.join("sparse").join(&name));
                if is_new(&from, &to) {
                    copy_file(&from, &to)?;
                }
            }
        }
        Ok(())
    }

    /// Writes `fused.ply` and `fused.ply.vis`, or another file of a cloud, in the format of its ending, and
    /// its `.vis` beside it.
    ///
    /// # Errors
    /// An ending of no known format; a file that cannot be written.
    pub fn write_cloud(path: &Path, cloud: &PointCloud) -> Result<()> {
        cloud::write_points(path, CloudFormat::of_file(path)?, cloud)?;
        write_visibility(&visibility_path(path), &cloud.views)
    }

    /// Writes a scene for programs for Gaussian splatting into a folder: `images/`, linked, and `sparse/0/`
    /// with a model and `points3D.ply`, both with the points of the cloud. `photographs` is the folder of the
    /// images.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_splat(
        folder: &Path,
        images: &[ModelImage],
        photographs: &Path,
        cloud: &PointCloud,
    ) -> Result<()> {
        cloud::write_splat(folder, images, photographs, cloud).map(drop)
    }

    /// Reads depth and normal map of one view.
    ///
    /// # Errors
    /// A missing or damaged file; another size than the camera's; a depth without a unit normal.
    pub fn read_maps(&self, name: &str, kind: MapKind, camera: &Camera) -> Result<Maps> {
        let depth_path = self.depth_map(name, kind);
        let normal_path = self.normal_map(name, kind);
        let depth = sized(&depth_path, camera, read_depth_map(&depth_path)?)?;
        let mut normal = sized(&normal_path, camera, read_normal_map(&normal_path)?)?;
        for (pixel, (depth, normal)) in depth.iter().zip(&mut normal).enumerate() {
            if *depth == 0.0 {
                *normal = [0.0; 3];
                continue;
            }
            let length = normal.iter().map(|component| component * component).sum::<f32>().sqrt();
            if (length - 1.0).abs() > 0.01 {
                let (column, row) = (pixel % camera.width as usize, pixel / camera.width as usize);
                let place = format!("the normal at column {column}, row {row}");
                return Err(Error::file(
                    &normal_path,
                    format!("{place} has the length {length}; expected 1"),
                ));
            }
        }
        Ok(Maps { depth, normal })
    }

    /// Reads the validated maps and the confidence of a view that [`Workspace::write_view`] wrote.
    pub(crate) fn read_finished(&self, name: &str, camera: &Camera) -> Result<(Maps, Vec<f32>)> {
        let maps = self.read_maps(name, MapKind::Validated, camera)?;
        let path = self.confidence_map(name, MapKind::Validated);
        let confidence = sized(&path, camera, read_depth_map(&path)?)?;
        Ok((maps, confidence))
    }

    /// The scene the workspace belongs to: its own `sparse/` (and `images/`), as COLMAP's workspaces have
    /// them, else those of the folder above it.
    pub fn find_scene(&self) -> Result<SceneFolder> {
        let folder = self.folder.canonicalize().map_err(|error| cannot_be_read(&self.folder, error))?;
        SceneFolder::find(&folder).or_else(|own| match folder.parent() {
            Some(parent) => SceneFolder::find(parent).map_err(|_| {
                let expected = "sparse/ with cameras.bin and images.bin, or cameras.txt and images.txt";
                let problem = format!("no COLMAP model here or in the folder above; expected {expected}");
                Error::file(&folder, format!("{problem} (--scene SCENE names another folder)"))
            }),
            None => Err(own),
        })
    }
}

/// The values of a map of the camera's size.
pub(super) fn sized<T>(path: &Path, camera: &Camera, grid: Grid<T>) -> Result<Vec<T>> {
    require_size(path, camera, (grid.width, grid.height)).map(|()| grid.values)
}

/// Returns an error unless a map has the camera's size.
pub(super) fn require_size(path: &Path, camera: &Camera, (width, height): (u32, u32)) -> Result<()> {
    if (width, height) == (camera.width, camera.height) {
        return Ok(());
    }
    let expected = format!("{}x{}, the size of its camera", camera.width, camera.height);
    Err(Error::file(path, format!("the map is {width}x{height}; expected {expected}")))
}
