//! Scenes in memory, from any program.

use super::changes::{Changes, read};
use super::{SourcePhotograph, chosen};
use crate::error::Result;
use crate::geometry::DepthRange;
use crate::memory::memory_budget;
use crate::options::Options;
use crate::parallel::{JoinedPool, Phase, Progress, ProgressFn, useful_threads};
use crate::pipeline::Tracker;
use crate::scene::{Scene, View};
use rayon::prelude::*;
use std::path::Path;

/// Reads a scene of any format that [`read`](super::read()) knows into memory: photographs are undistorted,
/// reduced and masked as [`InputOptions`](crate::InputOptions) say. `depth_range` applies to every view; it
/// is required if nothing else says where the surfaces are. Of the options that choose photographs
/// `input.reference` leaves out what is neither chosen nor a source of a chosen one; the rest are equal
/// views. Works on a thread pool of its own. `progress` is told of the photographs that are read.
///
/// # Errors
/// An option out of its range; a file that is missing or damaged, or an unknown format; a choice that fits no
/// photograph; a lens that cannot be undistorted; the errors of [`Scene::new`];
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn read_scene(
    path: &Path,
    depth_range: Option<DepthRange>,
    options: &Options,
    progress: ProgressFn,
) -> Result<Scene> {
    options.check()?;
    let pool = JoinedPool::new(useful_threads(options.threads, usize::MAX))?;
    pool.install(|| read_on_pool(path, depth_range, options, progress))
}

fn read_on_pool(
    path: &Path,
    depth_range: Option<DepthRange>,
    options: &Options,
    progress: ProgressFn,
) -> Result<Scene> {
    let source = chosen::read(path, options)?;
    let views = source.photographs.len();
    let tracker = Tracker::with_work(progress, views as u64);
    let advance = |units, view| {
        tracker
            .advance(units, Progress { phase: Phase::Read, downscale: 1, cycle: 0, view, views, done: 0.0 })
    };
    let changes = Changes::new(&source, &options.input, &|view| advance(0, view))?;
    let view = |index: usize| -> Result<View> {
        let SourcePhotograph { name, path, depth_range: own_range, sources, .. } = &source.photographs[index];
        advance(0, index)?;
        let bytes = read(path)?;
        let view = View {
            name: name.clone(),
            picture: changes.picture(index, &bytes)?.0.into(),
            camera: changes.shapes()[index].camera,
            mask: changes.mask(index, &bytes)?.map(Into::into),
            depth_range: depth_range.or(*own_range),
            sources: sources.clone(),
        };
        advance(1, index)?;
        Ok(view)
    };
    let views = changes.each(memory_budget(options.memory), &view)?;
    let views = views.into_par_iter().collect::<Result<Vec<_>>>()?;
    let warnings = source.warnings.iter().cloned().chain(changes.warning()).collect();
    Ok(Scene::new(views, source.points.clone())?.with_warnings(warnings))
}
