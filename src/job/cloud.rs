//! The cloud of a run: fused and thinned on disk, and written.

use super::fuse::FinishedViews;
use crate::error::{Error, Result};
use crate::fusion::{CloudSource, PointCloud, draw, fuse_input, thin_by_voxels};
use crate::io::{CloudSpool, ModelImage, StoredCloud, Workspace, visibility_path, write_cloud, write_splat};
use crate::options::{Options, OutputOptions};
use crate::parallel::{Phase, Progress, ProgressFn};
use crate::scene::Scene;
use std::path::{Path, PathBuf};

/// Memory for the averages of voxels at most: those of large clouds are made in several passes over the points.
const VOXEL_MEMORY: u64 = 256 << 20;

/// The points of a run, and whether the user wants to go on.
pub(super) struct RunCloud<'a> {
    scene: &'a Scene,
    workspace: &'a Workspace,
    points: StoredCloud,
    progress: ProgressFn<'a>,
}

/// Fuses the finished views, and thins the cloud as the options say, in about `memory` bytes.
///
/// # Errors
/// Maps that cannot be read; a full disk; [`Error::Cancelled`].
pub(super) fn make<'a>(
    views: FinishedViews<'a>,
    options: &Options,
    memory: u64,
    progress: ProgressFn<'a>,
) -> Result<RunCloud<'a>> {
    let (scene, workspace) = (views.scene, views.workspace);
    let path = workspace.cloud_as(options.output.cloud_format);
    let mut spool = CloudSpool::new(&path)?;
    fuse_input(&views, &options.fusion, progress, &mut |points| spool.add(points))?;
    // Their memory is needed.
    drop(views);
    let mut cloud = RunCloud { scene, workspace, points: spool.finish()?, progress };
    let fusion = options.fusion;
    if fusion.voxel_size > 0.0 {
        let memory = memory.min(VOXEL_MEMORY) as usize;
        cloud.points = respooled(&path, &|add| thin_by_voxels(&cloud, fusion.voxel_size, memory, add))?;
    }
    let most = fusion.max_points as usize;
    if most > 0 && most < cloud.len() {
        cloud.points = respooled(&path, &|add| draw(&cloud, most, add))?;
    }
    Ok(cloud)
}

/// The points that `thin` adds.
fn respooled(
    path: &Path,
    thin: &dyn Fn(&mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()>,
) -> Result<StoredCloud> {
    let mut spool = CloudSpool::new(path)?;
    thin(&mut |points| spool.add(points))?;
    spool.finish()
}

impl RunCloud<'_> {
    /// Writes the files that were asked for, and returns their names.
    ///
    /// # Errors
    /// A full disk, for example; [`Error::Cancelled`].
    pub(super) fn write(&self, output: &OutputOptions) -> Result<Vec<PathBuf>> {
        let workspace = self.workspace;
        let path = workspace.cloud_as(output.cloud_format);
        write_cloud(&path, output.cloud_format, self)?;
        let mut files = vec![visibility_path(&path), path];
        if output.splat {
            let views = self.scene.views().iter();
            let images: Vec<ModelImage> =
                views.map(|view| ModelImage { name: view.name.clone(), camera: view.camera }).collect();
            let photographs = workspace.folder().join("images");
            files.extend(write_splat(&workspace.splat(), &images, &photographs, self)?);
        }
        Ok(files)
    }
}

impl CloudSource for RunCloud<'_> {
    fn len(&self) -> usize {
        self.points.len()
    }

    fn each_part(&self, body: &mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()> {
        let views = self.scene.views().len();
        let at = Progress { phase: Phase::Fusion, downscale: 1, cycle: 0, view: views - 1, views, done: 1.0 };
        self.points.each_part(&mut |points| {
            if (self.progress)(&at).is_break() {
                return Err(Error::Cancelled);
            }
            body(points)
        })
    }
}
