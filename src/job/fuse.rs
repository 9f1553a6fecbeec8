//! The fusion of a run's finished views, and of the maps in any workspace.

use super::Job;
use super::cloud::{self, CloudScene, RunCloud, cloud_files};
use super::needs::{self, BASE};
use crate::error::{Error, Result};
use crate::fusion::{CloudSource, LoadedView, PointCloud, StreamedViews, overlaps, streamed_bytes};
use crate::io::{ModelImage, WorkspaceMaps, WorkspaceView, check_file_place};
use crate::memory::{format_bytes, memory_budget, require_memory};
use crate::options::{CloudFormat, Options, OutputOptions};
use crate::parallel::{JoinedPool, ProgressFn, useful_threads};
use crate::scene::SparsePoint;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

impl Job {
    /// Fuses the finished views into the cloud of the workspace; returns it and its file.
    pub(super) fn fuse_finished<'a>(&self, progress: ProgressFn<'a>) -> Result<(RunCloud<'a>, PathBuf)> {
        let path = self.workspace.cloud_as(self.options.output.cloud_format);
        let load = |index: usize| {
            let view = &self.scene.views()[self.references[index]];
            let (maps, confidence) = self.workspace.read_finished(&view.name, &view.camera)?;
            Ok(LoadedView { maps, confidence: Some(confidence), picture: Some(view.picture.load()?) })
        };
        let cameras = self.references.iter().map(|&view| &self.scene.views()[view].camera).collect();
        let views = StreamedViews::new(cameras, &self.overlaps, &load, self.shares.fusion);
        let memory = self.needs.memory.saturating_sub(self.shares.least.base);
        let numbers: Vec<u32> = self.references.iter().map(|&view| view as u32).collect();
        let mut change = |points: PointCloud| points.renumbered(&numbers);
        let made = cloud::make(views, &self.options, (&path, memory), &mut change, progress)?;
        Ok((made, path))
    }
}

/// What [`fuse_workspace`] fused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FusedWorkspace {
    /// Number of points.
    pub points: u64,
    /// Points that are gray: no view they were fused from has a photograph.
    pub points_without_color: u64,
    /// Pixels of the maps.
    pub pixels: u64,
    /// Pixels with a depth.
    pub depths: u64,
}

/// Fuses the maps of a workspace, on a thread pool of its own, and writes a file in the format of its ending,
/// the views of its points, `PATH.vis`, beside it, and with `output.splat` the folder
/// `splat`. Of the maps and photographs only those of a view and of the views that
/// overlap with it are in memory, and as many others as the option `memory` allows; of the other options the
/// fusion's and `threads` count.
///
/// # Errors
/// An option out of its range; less memory than the fusion needs; threads that cannot be started; a map or
/// photograph that is missing or damaged; a file that cannot be written; [`Error::Cancelled`].
pub fn fuse_workspace(
    maps: &WorkspaceMaps,
    options: &Options,
    path: &Path,
    progress: ProgressFn,
) -> Result<FusedWorkspace> {
    options.check()?;
    for file in cloud_files(path) {
        check_file_place(&file)?;
    }
    maps.check_sizes()?;
    let pool = JoinedPool::new(useful_threads(options.threads, usize::MAX))?;
    pool.install(|| fuse_on_pool(maps, options, path, progress))
}

fn fuse_on_pool(
    maps: &WorkspaceMaps,
    options: &Options,
    path: &Path,
    progress: ProgressFn,
) -> Result<FusedWorkspace> {
    // Views without maps are left out, so that they take neither memory nor places among the views that one
    // is compared with.
    let used: Vec<usize> = (0..maps.views.len()).filter(|&view| maps.views[view].has_maps).collect();
    let cameras: Vec<_> = used.iter().map(|&view| &maps.views[view].camera).collect();
    let centers: Vec<DVec3> = cameras.iter().map(|camera| camera.center()).collect();
    let overlaps = overlaps(&centers, &points_of(&maps.points, &used, maps.views.len()));
    let least = BASE + needs::point_bytes(&maps.points) + streamed_bytes(&cameras, &overlaps);
    let memory = memory_budget(options.memory);
    if memory < least {
        let expected = format!("at least {} for these maps ({least} bytes)", format_bytes(least));
        return Err(Error::argument("options.memory", format_bytes(memory), expected));
    }
    require_memory(least - BASE, "the fusion of a view with those that overlap it")?;

    let depths = AtomicU64::new(0);
    let is_counted: Vec<AtomicBool> = used.iter().map(|_| AtomicBool::new(false)).collect();
    let load = |index: usize| {
        let view = maps.load(used[index])?;
        // A view may be loaded again.
        if !is_counted[index].swap(true, Ordering::Relaxed) {
            let own = view.maps.depth.iter().filter(|&&depth| depth > 0.0).count();
            depths.fetch_add(own as u64, Ordering::Relaxed);
        }
        Ok(view)
    };
    let pixels = cameras.iter().map(|camera| camera.pixels() as u64).sum();
    let views = StreamedViews::new(cameras, &overlaps, &load, (memory - least) as usize);
    let numbers: Vec<u32> = used.iter().map(|&view| view as u32).collect();
    let mut points_without_color = 0;
    let mut change = |points: PointCloud| {
        let is_gray = |&point: &usize| {
            points.views.get(point).iter().all(|&view| !maps.views[used[view as usize]].has_photograph)
        };
        points_without_color += (0..points.views.len()).filter(is_gray).count() as u64;
        points.renumbered(&numbers)
    };
    let made = cloud::make(views, options, (path, memory - BASE), &mut change, progress)?;
    let image = |view: &WorkspaceView| ModelImage { name: view.name.clone(), camera: view.camera };
    let scene = CloudScene {
        images: maps.views.iter().map(image).collect(),
        photographs: maps.photographs().to_owned(),
        splat: path.parent().unwrap_or(Path::new("")).join("splat"),
    };
    // The ending says the format.
    let output = OutputOptions { cloud_format: CloudFormat::of_file(path)?, ..options.output };
    made.write(path, &output, &scene)?;
    let points = made.len() as u64;
    Ok(FusedWorkspace { points, points_without_color, pixels, depths: depths.into_inner() })
}

/// The sparse points with the places of their views in `used`; of `views` in all, the others are left out.
pub(super) fn points_of(points: &[SparsePoint], used: &[usize], views: usize) -> Vec<SparsePoint> {
    let mut places = vec![None; views];
    used.iter().enumerate().for_each(|(place, &view)| places[view] = Some(place as u32));
    let renumbered = |point: &SparsePoint| SparsePoint {
        position: point.position,
        views: point.views.iter().filter_map(|&view| places[view as usize]).collect(),
    };
    points.iter().map(renumbered).collect()
}
