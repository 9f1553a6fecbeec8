//! The beginning of a run: the scene is read and compared with what the folder holds.

use super::folder::RunFolder;
use super::manifest::{Manifest, PhotographEntry};
use super::photograph::FilePhotograph;
use super::task::{Record, Task};
use crate::error::{Error, Result};
use crate::geometry::DepthRange;
use crate::image::{Mask, Photograph};
use crate::import::{Extra, Prepared};
use crate::io::{
    ColmapModel, ModelImage, SceneFolder, Workspace, cannot_be_read, link_or_copy, picture_from_bytes,
    read_mask, remove_temporary_files,
};
use crate::io::{fingerprint, fingerprint_file};
use crate::options::Options;
use crate::parallel::{Phase, Progress, ProgressFn};
use crate::pipeline::Tracker;
use crate::scene::{Scene, View};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// A scene in files and what it is made from.
pub(super) struct Plan {
    pub scene: Scene,
    pub manifest: Manifest,
}

/// Reads a scene and decodes each photograph once: a damaged one is found now and not after hours.
///
/// # Errors
/// A file that is missing, damaged, or not of its camera's size; one of the run that could not be written;
/// [`Error::Cancelled`].
pub(super) fn read(
    prepared: &Prepared,
    depth_range: Option<DepthRange>,
    options: &Options,
    run: &RunFolder,
    progress: ProgressFn,
) -> Result<Plan> {
    let folder = &prepared.folder;
    let model = ColmapModel::read(&folder.sparse)?;
    let mut others = run.own_files();
    let (images, sparse) = (run.root().join("images"), run.root().join("sparse"));
    if !is_same(&images, &folder.images) {
        others.extend(model.images.iter().map(|image| images.join(&image.name)));
    }
    if !is_same_model(&sparse, folder) {
        others.push(sparse.join("cameras.bin"));
    }
    let names = model.images.iter().map(|image| image.name.as_str());
    Workspace::new(run.root()).check_places_and(names, others)?;
    let tracker = Tracker::with_work(progress, model.images.len() as u64);
    let advance = |units, view| {
        let (phase, views) = (Phase::Read, model.images.len());
        tracker.advance(units, Progress { phase, downscale: 1, cycle: 0, view, views, done: 0.0 })
    };
    let entry = |(view, image): (usize, &ModelImage)| {
        advance(0, view)?;
        // Checks that it exists and its size.
        let path = folder.photograph(&image.name, &image.camera)?;
        let bytes = std::fs::read(&path).map_err(|error| cannot_be_read(&path, error))?;
        // Photographs that were imported have been decoded.
        if !prepared.is_imported {
            picture_from_bytes(&bytes, &path)?;
        }
        advance(1, view)?;
        let extra = prepared.extras.get(view).cloned().unwrap_or_default();
        let Extra { mask, depth_range, sources, is_source_only } = extra;
        Ok(PhotographEntry {
            name: image.name.clone(),
            content: fingerprint(&bytes),
            mask: mask.as_deref().map(fingerprint_file).transpose()?,
            depth_range: depth_range.map(|range| [range.near, range.far]),
            sources,
            is_source_only,
        })
    };
    let photographs: Vec<_> =
        model.images.par_iter().enumerate().with_max_len(1).map(entry).collect::<Result<_>>()?;
    let manifest = Manifest::new(&model, photographs, depth_range, options);
    let scene = scene(folder, model, &manifest)?;
    Ok(Plan { scene, manifest })
}

/// The scene of a run that was planned before, in the run's own folder.
///
/// # Errors
/// A model that is missing or not that of the run.
pub(super) fn read_planned(folder: &RunFolder, manifest: &Manifest, options: &Options) -> Result<Scene> {
    let own = SceneFolder::find(folder.root())?;
    let model = ColmapModel::read(&own.sparse)?;
    let names = model.images.iter().map(|image| &image.name);
    if !names.eq(manifest.photographs.iter().map(|entry| &entry.name)) {
        let problem = "lists other photographs than the model has; plan the run again";
        return Err(Error::file(folder.manifest(), problem));
    }
    let found = Manifest::new(&model, manifest.photographs.clone(), manifest.depth_range(), options);
    let differences = found.differences(manifest);
    if differences.is_empty() {
        return scene(&own, model, manifest);
    }
    let problem = format!(
        "not what the run was planned with: {}; `skep reconstruct` or `skep plan` \
                          begins anew, and `skep fuse DIR --output FILE` fuses the maps as they are",
        differences.join(", ")
    );
    Err(Error::file(folder.manifest(), problem))
}

fn scene(folder: &SceneFolder, model: ColmapModel, manifest: &Manifest) -> Result<Scene> {
    let masks = folder.images.with_file_name("masks");
    let view = |(image, entry): (ModelImage, &PhotographEntry)| -> Result<View> {
        let mask = entry.mask.as_ref().map(|expected| {
            let path = masks.join(format!("{}.png", image.name));
            match fingerprint_file(&path)? == *expected {
                true => read_mask(&path, (image.camera.width, image.camera.height)).map(Mask::from),
                false => Err(Error::file(path, "the mask changed since the run began; plan the run again")),
            }
        });
        let photograph = FilePhotograph {
            path: folder.images.join(&image.name),
            size: (image.camera.width, image.camera.height),
            fingerprint: entry.content.clone(),
        };
        Ok(View {
            name: image.name,
            picture: Photograph::Deferred(Arc::new(photograph)),
            camera: image.camera,
            mask: mask.transpose()?,
            depth_range: manifest.depth_range().or(entry.depth_range()),
            sources: entry.sources.clone(),
        })
    };
    let views = model.images.into_iter().zip(&manifest.photographs).map(view).collect::<Result<_>>()?;
    Scene::new(views, model.points)
}

/// Prepares the folder for a run: one that it began before goes on, anything else begins anew. Returns what
/// was done in words, if it is worth a notice.
///
/// # Errors
/// Files that cannot be replaced.
pub(super) fn prepare(
    folder: &RunFolder,
    source: &SceneFolder,
    manifest: &Manifest,
    fresh: bool,
) -> Result<Vec<String>> {
    let mut notices = Vec::new();
    if !folder.manifest().is_file() {
        refuse_other_scene(folder, source)?;
    }
    let earlier = match Manifest::read(&folder.manifest()) {
        Ok(earlier) => earlier,
        Err(error) => {
            notices.push(format!("{error}; the run begins anew"));
            None
        }
    };
    remove_temporary_files(folder.root());
    let is_same = earlier.as_ref() == Some(manifest);
    let goes_on =
        !fresh && (is_same || earlier.as_ref().is_some_and(|earlier| keeps_maps(folder, earlier, manifest)));
    if !goes_on || !is_same {
        let is_notable = !goes_on || Record::read(folder, manifest.run(), Task::Fuse).is_some();
        if let Some(earlier) = earlier.filter(|_| !fresh && is_notable) {
            let (what, again) = match goes_on {
                true => ("cloud", "is made again"),
                false => ("run", "begins anew"),
            };
            notices.push(format!(
                "the {what} in {} was made from something else and {again}; changed: {}",
                folder.root().display(),
                listed(&manifest.differences(&earlier))
            ));
        }
        if goes_on { remove_cloud(folder, manifest.run())? } else { remove_run(folder)? }
    }
    adopt(folder, source, manifest)?;
    let workspace = Workspace::new(folder.root());
    let references = manifest.photographs.iter().filter(|photograph| !photograph.is_source_only);
    workspace.write_lists(references.map(|photograph| photograph.name.as_str()))?;
    if !(goes_on && is_same) {
        manifest.write(&folder.manifest())?;
    }
    Ok(notices)
}

/// Whether the maps of an earlier run are those of this one, and there: only the cloud differs.
fn keeps_maps(folder: &RunFolder, earlier: &Manifest, manifest: &Manifest) -> bool {
    let run = manifest.run();
    let keeps_all =
        || manifest.options(&Options::default()).is_ok_and(|options| options.output.write.has_fused_maps());
    // After the fusion the maps that were not asked for are gone.
    earlier.run() == run && (Record::read(folder, run, Task::Fuse).is_none() || keeps_all())
}

/// Removes the cloud and what says that it is complete.
fn remove_cloud(folder: &RunFolder, run: u64) -> Result<()> {
    remove(&folder.report())?;
    remove(&folder.report_page())?;
    if let Some(record) = Record::read(folder, run, Task::Fuse) {
        remove(&folder.record(Task::Fuse))?;
        record.remove_files(folder);
    }
    Ok(())
}

/// The first entries of a list, and the number of the others.
fn listed(entries: &[String]) -> String {
    const MOST: usize = 5;
    let first = entries.iter().take(MOST).cloned().collect::<Vec<_>>().join(", ");
    match entries.len().checked_sub(MOST) {
        Some(more) if more > 0 => format!("{first} and {more} more"),
        _ => first,
    }
}

/// Removes the records of a run and the files they list.
pub(super) fn remove_run(folder: &RunFolder) -> Result<()> {
    // A report and a cloud say that what is beside them is complete.
    for path in [folder.report(), folder.report_page(), folder.manifest()] {
        remove(&path)?;
    }
    for entry in std::fs::read_dir(folder.tasks()).into_iter().flatten().flatten() {
        let record = std::fs::read(entry.path()).ok().and_then(|bytes| Record::parse(&bytes));
        record.iter().for_each(|record| record.remove_files(folder));
    }
    for path in [folder.tasks(), folder.estimates()] {
        match std::fs::remove_dir_all(&path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::file(path, format!("cannot be removed: {error}")));
            }
            _ => (),
        }
    }
    Ok(())
}

/// A folder with a model that no run put there may be a scene of the user.
fn refuse_other_scene(folder: &RunFolder, scene: &SceneFolder) -> Result<()> {
    match SceneFolder::find(folder.root()) {
        Ok(found) if !is_same(&found.sparse, &scene.sparse) => {
            let (own, given) = (ColmapModel::read(&found.sparse), ColmapModel::read(&scene.sparse)?);
            if own.is_ok_and(|own| own == given) {
                return Ok(());
            }
            let problem = "holds another scene, which no run of skep put there; name another folder";
            Err(Error::file(folder.root(), problem))
        }
        _ => Ok(()),
    }
}

fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::file(path, format!("cannot be replaced: {error}")))
        }
        _ => Ok(()),
    }
}

/// Puts the scene into the run's folder: photographs as hard links where the file system can, and the model.
/// What differs from the scene is replaced.
fn adopt(folder: &RunFolder, scene: &SceneFolder, manifest: &Manifest) -> Result<()> {
    let images = folder.root().join("images");
    if !is_same(&images, &scene.images) {
        for entry in &manifest.photographs {
            let (from, to) = (scene.images.join(&entry.name), images.join(&entry.name));
            let is_there = std::fs::read(&to).is_ok_and(|bytes| fingerprint(&bytes) == entry.content);
            if !is_there {
                remove(&to)?;
                link_or_copy(&from, &to)?;
            }
        }
    }
    let sparse = folder.root().join("sparse");
    if is_same_model(&sparse, scene) {
        return Ok(());
    }
    // A model is a set of files: those of another one must not stay beside it.
    for stem in ["cameras", "images", "points3D"] {
        for name in ["bin", "txt"].map(|extension| format!("{stem}.{extension}")) {
            let (from, to) = (scene.sparse.join(&name), sparse.join(&name));
            match std::fs::read(&from) {
                Ok(bytes) => {
                    if std::fs::read(&to).ok().as_ref() != Some(&bytes) {
                        crate::io::write_file(&to, |out| std::io::Write::write_all(out, &bytes))?;
                    }
                }
                Err(_) => remove(&to)?,
            }
        }
    }
    Ok(())
}

/// Whether the model of a scene is in this folder `sparse`, or in `sparse/0`.
fn is_same_model(sparse: &Path, scene: &SceneFolder) -> bool {
    is_same(sparse, &scene.sparse) || is_same(&sparse.join("0"), &scene.sparse)
}

/// Whether two paths are the same folder.
fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
