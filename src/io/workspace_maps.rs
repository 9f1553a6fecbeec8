//! The maps in a workspace, read view by view.

use super::colmap_maps::{map_size, read_depth_map};
use super::colmap_model::ColmapModel;
use super::files::cannot_be_read;
use super::scene_folder::SceneFolder;
use super::workspace::{MapKind, Workspace, require_size, sized};
use crate::error::{Error, Result};
use crate::fusion::LoadedView;
use crate::geometry::Camera;
use crate::image::Picture;
use crate::scene::{Maps, SparsePoint};
use std::collections::HashSet;

/// A view of a workspace.
#[derive(Debug, Clone)]
pub struct WorkspaceView {
    /// Its name in the model.
    pub name: String,
    /// Its camera.
    pub camera: Camera,
    /// Whether `stereo/fusion.cfg` lists it, or is missing.
    pub is_listed: bool,
    /// Whether it is listed and there is a depth map.
    pub has_maps: bool,
    /// Whether there is a photograph.
    pub has_photograph: bool,
}

/// The maps and photographs of a workspace, which are read when they are asked for.
///
/// # Examples
/// ```no_run
/// use skep::io::Workspace;
///
/// let workspace = Workspace::new("SCENE/dense");
/// let maps = workspace.maps(&workspace.find_scene()?)?;
/// println!("{} views have no maps", maps.views.iter().filter(|view| !view.has_maps).count());
/// let fused = skep::job::fuse_workspace(
///     &maps,
///     &skep::Options::default(),
///     &workspace.cloud(),
///     &skep::ignore_progress,
/// )?;
/// println!("{} points", fused.points);
/// # Ok::<(), skep::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct WorkspaceMaps {
    /// All views of the model in the order of its file.
    pub views: Vec<WorkspaceView>,
    /// The model's points.
    pub points: Vec<SparsePoint>,
    /// Which maps are read.
    pub kind: MapKind,
    workspace: Workspace,
    scene: SceneFolder,
}

impl WorkspaceMaps {
    /// The folder of the photographs.
    pub(crate) fn photographs(&self) -> &std::path::Path {
        &self.scene.images
    }
}

impl Workspace {
    /// Finds the maps of all views of the scene: the geometric maps when any view has one, else the
    /// photometric ones, never a mixture. Views that `stereo/fusion.cfg` does not list, where there is one,
    /// are left out as COLMAP leaves them out: they have no maps. Reads the model only.
    ///
    /// # Errors
    /// The errors of [`ColmapModel::read`]; a list that cannot be read or that names no image of the model;
    /// no view with maps.
    pub fn maps(&self, scene: &SceneFolder) -> Result<WorkspaceMaps> {
        let ColmapModel { images, points } = ColmapModel::read(&scene.sparse)?;
        let kinds = [MapKind::Validated, MapKind::Raw];
        let listed = self.read_fusion_list(&images)?;
        let is_listed = |name: &str| listed.as_ref().is_none_or(|listed| listed.contains(name));
        let has_map = |name: &str, kind| is_listed(name) && self.depth_map(name, kind).is_file();
        let Some(kind) =
            kinds.into_iter().find(|&kind| images.iter().any(|image| has_map(&image.name, kind)))
        else {
            let wanted = format!("stereo/depth_maps/{}.geometric.bin or .photometric.bin", images[0].name);
            return Err(Error::file(self.folder(), format!("no depth maps; expected files like {wanted}")));
        };
        let view = |image: super::ModelImage| WorkspaceView {
            is_listed: is_listed(&image.name),
            has_maps: has_map(&image.name, kind),
            has_photograph: scene.images.join(&image.name).is_file(),
            name: image.name,
            camera: image.camera,
        };
        let views = images.into_iter().map(view).collect();
        Ok(WorkspaceMaps { views, points, kind, workspace: self.clone(), scene: scene.clone() })
    }

    /// The names in `stereo/fusion.cfg`; `None` without the file.
    fn read_fusion_list(&self, images: &[super::ModelImage]) -> Result<Option<HashSet<String>>> {
        let path = self.folder().join("stereo").join("fusion.cfg");
        if !path.is_file() {
            return Ok(None);
        }
        let text = std::fs::read_to_string(&path).map_err(|error| cannot_be_read(&path, error))?;
        let known: HashSet<&str> = images.iter().map(|image| image.name.as_str()).collect();
        let mut listed = HashSet::new();
        for (number, line) in (1..).zip(text.lines().map(str::trim)) {
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if !known.contains(line) {
                return Err(Error::line(&path, number, format!("{line:?} is no image of the model")));
            }
            listed.insert(line.to_owned());
        }
        Ok(Some(listed))
    }
}

impl WorkspaceMaps {
    /// Reads depth and normal map of a view.
    ///
    /// # Errors
    /// The errors of [`Workspace::read_maps`].
    pub fn read_maps(&self, view: usize) -> Result<Maps> {
        let WorkspaceView { name, camera, .. } = &self.views[view];
        self.workspace.read_maps(name, self.kind, camera)
    }

    /// Reads the confidence of every pixel of a view, 0 to 1; `None` without a file, as COLMAP writes none.
    ///
    /// # Errors
    /// A damaged file; another size than the camera's.
    pub fn read_confidence(&self, view: usize) -> Result<Option<Vec<f32>>> {
        let WorkspaceView { name, camera, .. } = &self.views[view];
        let path = self.workspace.confidence_map(name, self.kind);
        path.is_file().then(|| sized(&path, camera, read_depth_map(&path)?)).transpose()
    }

    /// Reads the photograph of a view; `None` without a file.
    ///
    /// # Errors
    /// A damaged file; another size than the camera's.
    pub fn read_picture(&self, view: usize) -> Result<Option<Picture>> {
        let WorkspaceView { name, camera, has_photograph, .. } = &self.views[view];
        has_photograph.then(|| self.scene.read_picture(name, camera)).transpose()
    }

    /// Checks that every depth map has its normal map and that all files have their cameras' sizes, from
    /// their headers: what does not fit is found now and not in the middle of a fusion.
    ///
    /// # Errors
    /// A file that is missing or of another size, named.
    pub fn check_sizes(&self) -> Result<()> {
        for view in self.views.iter().filter(|view| view.has_maps) {
            let depth = self.workspace.depth_map(&view.name, self.kind);
            require_size(&depth, &view.camera, map_size(&depth, 1)?)?;
            let normal = self.workspace.normal_map(&view.name, self.kind);
            require_size(&normal, &view.camera, map_size(&normal, 3)?)?;
            let confidence = self.workspace.confidence_map(&view.name, self.kind);
            if confidence.is_file() {
                require_size(&confidence, &view.camera, map_size(&confidence, 1)?)?;
            }
            if view.has_photograph {
                self.scene.photograph(&view.name, &view.camera)?;
            }
        }
        Ok(())
    }

    /// A view with all that a fusion reads of it.
    pub(crate) fn load(&self, view: usize) -> Result<LoadedView> {
        Ok(LoadedView {
            maps: self.read_maps(view)?,
            confidence: self.read_confidence(view)?,
            picture: self.read_picture(view)?,
        })
    }
}
