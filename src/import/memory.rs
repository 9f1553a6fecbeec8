//! Scenes in memory, from any program.

use super::changes::{Changes, read};
use super::{SourcePhotograph, chosen};
use crate::error::Result;
use crate::geometry::DepthRange;
use crate::memory::memory_budget;
use crate::options::Options;
use crate::parallel::{JoinedPool, useful_threads};
use crate::scene::{Scene, View};
use rayon::prelude::*;
use std::path::Path;

/// Reads a scene of any format that [`read`](super::read()) knows into memory: photographs are undistorted,
/// reduced and masked as [`InputOptions`](crate::InputOptions) say. `depth_range` applies to every view; it
/// is required if nothing else says where the surfaces are. Of the options that choose photographs
/// `input.reference` leaves out what is neither chosen nor a source of a chosen one; the rest are equal
/// views. Works on a thread pool of its own.
///
/// # Errors
/// An option out of its range; a file that is missing or damaged, or an unknown format; a choice that fits no
/// photograph; a lens that cannot be undistorted; the errors of [`Scene::new`].
pub fn read_scene(path: &Path, depth_range: Option<DepthRange>, options: &Options) -> Result<Scene> {
    options.check()?;
    let pool = JoinedPool::new(useful_threads(options.threads, usize::MAX))?;
    pool.install(|| read_on_pool(path, depth_range, options))
}

fn read_on_pool(path: &Path, depth_range: Option<DepthRange>, options: &Options) -> Result<Scene> {
    let source = chosen::read(path, options)?;
    let changes = Changes::new(&source, &options.input, &|_| Ok(()))?;
    let view = |index: usize| -> Result<View> {
        let SourcePhotograph { name, path, depth_range: own_range, sources, .. } = &source.photographs[index];
        let bytes = read(path)?;
        Ok(View {
            name: name.clone(),
            picture: changes.picture(index, &bytes)?.0.into(),
            camera: changes.shapes()[index].camera,
            mask: changes.mask(index, &bytes)?.map(Into::into),
            depth_range: depth_range.or(*own_range),
            sources: sources.clone(),
        })
    };
    let views = changes.each(memory_budget(options.memory), &view)?;
    let views = views.into_par_iter().collect::<Result<Vec<_>>>()?;
    let warnings = source.warnings.iter().cloned().chain(changes.warning()).collect();
    Ok(Scene::new(views, source.points.clone())?.with_warnings(warnings))
}
