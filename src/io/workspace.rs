//! The dense folder: maps, consistency graphs, previews and the fused cloud, laid out as COLMAP does.

use super::cloud::{self, visibility_path, write_visibility};
use super::colmap_maps::{Grid, read_depth_map, read_normal_map};
use super::colmap_model::{ColmapModel, ModelImage};
use super::files::{NAME_INSIDE, cannot_be_read, copy_file, link_or_copy, stays_inside, write_file};
use super::scene_folder::SceneFolder;
use crate::error::{Error, Result};
use crate::fusion::PointCloud;
use crate::geometry::Camera;
use crate::image::Picture;
use crate::options::CloudFormat;
use crate::scene::{Maps, SparsePoint};
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

    /// Writes a scene for programs for Gaussian splatting into a folder: `images/`, linked, and `sparse/0/` with
    /// a model and `points3D.ply`, both with the points of the cloud. `photographs` is the folder of the images.
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

    /// Reads the maps of all views of the scene, with cameras, pictures and points: the geometric maps when
    /// any view has one, else the photometric ones, never a mixture.
    ///
    /// # Errors
    /// No view with maps; a map without its other half, damaged or of another size than its camera; a damaged
    /// picture.
    pub fn read(&self, scene: &SceneFolder) -> Result<WorkspaceMaps> {
        let ColmapModel { images, points } = ColmapModel::read(&scene.sparse)?;
        let kinds = [MapKind::Validated, MapKind::Raw];
        let has_map = |name: &str, kind| self.depth_map(name, kind).is_file();
        let Some(kind) =
            kinds.into_iter().find(|&kind| images.iter().any(|image| has_map(&image.name, kind)))
        else {
            let wanted = format!("stereo/depth_maps/{}.geometric.bin or .photometric.bin", images[0].name);
            return Err(Error::file(&self.folder, format!("no depth maps; expected files like {wanted}")));
        };
        let mut missing = Vec::new();
        let mut views = Vec::new();
        for image in images {
            let mut confidence = None;
            let maps = if has_map(&image.name, kind) {
                let path = self.confidence_map(&image.name, kind);
                if path.is_file() {
                    confidence = Some(sized(&path, &image.camera, read_depth_map(&path)?)?);
                }
                self.read_maps(&image.name, kind, &image.camera)?
            } else {
                missing.push(image.name.clone());
                let pixels = image.camera.pixels();
                Maps { depth: vec![0.0; pixels], normal: vec![[0.0; 3]; pixels] }
            };
            let has_picture = scene.images.join(&image.name).is_file();
            let picture = has_picture.then(|| scene.read_picture(&image.name, &image.camera)).transpose()?;
            views.push(WorkspaceView { name: image.name, camera: image.camera, maps, confidence, picture });
        }
        Ok(WorkspaceMaps { views, points, kind, missing })
    }
}

/// A view of a workspace.
#[derive(Debug, Clone)]
pub struct WorkspaceView {
    /// Its name in the model.
    pub name: String,
    /// Its camera.
    pub camera: Camera,
    /// Its maps, of the camera's size; all zeros when there are none.
    pub maps: Maps,
    /// The confidence of every pixel, 0 to 1; `None` without a file, as COLMAP writes none.
    pub confidence: Option<Vec<f32>>,
    /// Its photograph, when the file is there.
    pub picture: Option<Picture>,
}

/// The maps of a workspace, for fusion.
#[derive(Debug, Clone)]
pub struct WorkspaceMaps {
    /// All views of the model in the order of its file.
    pub views: Vec<WorkspaceView>,
    /// The model's points.
    pub points: Vec<SparsePoint>,
    /// Which maps were read.
    pub kind: MapKind,
    /// Names of the views without maps.
    pub missing: Vec<String>,
}

/// The values of a map of the camera's size.
fn sized<T>(path: &Path, camera: &Camera, grid: Grid<T>) -> Result<Vec<T>> {
    if (grid.width, grid.height) == (camera.width, camera.height) {
        return Ok(grid.values);
    }
    let expected = format!("{}x{}, the size of its camera", camera.width, camera.height);
    Err(Error::file(path, format!("the map is {}x{}; expected {expected}", grid.width, grid.height)))
}
