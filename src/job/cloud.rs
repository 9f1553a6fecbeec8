//! A cloud on its way into files: fused and thinned on disk, and written.

use crate::error::{Error, Result};
use crate::fusion::{CloudSource, Emit, FusionInput, PointCloud, draw, fuse_input, thin_by_voxels};
use crate::io::{CloudSpool, ModelImage, StoredCloud, visibility_path, write_cloud, write_splat};
use crate::options::{Options, OutputOptions};
use crate::parallel::{Phase, Progress, ProgressFn};
use crate::scene::is_inside;
use std::path::{Path, PathBuf};

/// Memory for the averages of voxels at most: those of large clouds are made in several passes over the
/// points.
const VOXEL_MEMORY: u64 = 256 << 20;

/// The points of a cloud, and whether the user wants to go on.
pub(super) struct RunCloud<'a> {
    views: usize,
    points: StoredCloud,
    progress: ProgressFn<'a>,
}

/// The scene that a cloud is of, for what is written beside the cloud.
pub(super) struct CloudScene {
    pub images: Vec<ModelImage>,
    /// The folder of the photographs.
    pub photographs: PathBuf,
    /// The folder of a scene for Gaussian splatting.
    pub splat: PathBuf,
}

/// Fuses views, leaves out what is beyond the bounds, and thins the cloud as the options say, in about
/// `memory` bytes; `change` sees the points as they are made, and may replace them. The cloud is for the file
/// at `path`.
///
/// # Errors
/// Maps that cannot be read; a full disk; [`Error::Cancelled`].
pub(super) fn make<'a>(
    views: impl FusionInput,
    options: &Options,
    (path, memory): (&Path, u64),
    change: &mut dyn FnMut(PointCloud) -> PointCloud,
    progress: ProgressFn<'a>,
) -> Result<RunCloud<'a>> {
    let count = views.len();
    let bounds = options.input.bounds()?;
    let mut spool = CloudSpool::new(path)?;
    fuse_input(&views, &options.fusion, progress, &mut |points| {
        let is_wanted = |position| bounds.is_none_or(|bounds| is_inside(bounds, position));
        spool.add(&change(points.filtered(is_wanted)))
    })?;
    // Their memory is needed.
    drop(views);
    let mut cloud = RunCloud { views: count, points: spool.finish()?, progress };
    let fusion = options.fusion;
    if fusion.voxel_size > 0.0 {
        let memory = memory.min(VOXEL_MEMORY) as usize;
        cloud.points = respooled(path, &|add| thin_by_voxels(&cloud, fusion.voxel_size, memory, add))?;
    }
    let most = fusion.max_points as usize;
    if most > 0 && most < cloud.len() {
        cloud.points = respooled(path, &|add| draw(&cloud, most, add))?;
    }
    Ok(cloud)
}

/// The points that `thin` adds.
fn respooled(path: &Path, thin: &dyn Fn(Emit) -> Result<()>) -> Result<StoredCloud> {
    let mut spool = CloudSpool::new(path)?;
    thin(&mut |points| spool.add(points))?;
    spool.finish()
}

impl RunCloud<'_> {
    /// Writes the files that were asked for, and returns their names.
    ///
    /// # Errors
    /// A full disk, for example; [`Error::Cancelled`].
    pub(super) fn write(
        &self,
        path: &Path,
        output: &OutputOptions,
        scene: &CloudScene,
    ) -> Result<Vec<PathBuf>> {
        write_cloud(path, output.cloud_format, self)?;
        let mut files = cloud_files(path);
        if output.splat {
            files.extend(write_splat(&scene.splat, &scene.images, &scene.photographs, self)?);
        }
        Ok(files)
    }
}

/// The file of a cloud and that of the views of its points.
pub(super) fn cloud_files(path: &Path) -> Vec<PathBuf> {
    vec![path.to_owned(), visibility_path(path)]
}

impl CloudSource for RunCloud<'_> {
    fn len(&self) -> usize {
        self.points.len()
    }

    fn each_part(&self, body: &mut dyn FnMut(&PointCloud) -> Result<()>) -> Result<()> {
        let (view, views) = (self.views.saturating_sub(1), self.views);
        let at = Progress { phase: Phase::Fusion, downscale: 1, cycle: 0, view, views, done: 1.0 };
        self.points.each_part(&mut |points| {
            if (self.progress)(&at).is_break() {
                return Err(Error::Cancelled);
            }
            body(points)
        })
    }
}
