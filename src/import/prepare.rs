//! The workspace of a run from a scene of any program: photographs without distortion, small enough, with
//! masks, and a model of pinhole cameras. What is there already and still right is not made again.

use super::changes::{Changes, read};
use super::photograph::Change;
use super::record::{Entry, Record};
use super::{SourcePhotograph, SourceScene, chosen};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::io::{ColmapModel, ModelImage, SceneFolder, link_or_copy, write_mask, write_photograph};
use crate::io::{Fingerprint, fingerprint, fingerprint_file};
use crate::memory::memory_budget;
use crate::options::{InputOptions, Options};
use crate::parallel::{Phase, Progress, ProgressFn};
use crate::pipeline::Tracker;
use std::path::{Path, PathBuf};

/// A scene whose photographs and model a run reads as they are.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prepared {
    pub folder: SceneFolder,
    /// Whether the folder is that of the run, with photographs that were decoded and compared with their
    /// record.
    pub is_imported: bool,
    /// What the model does not hold, one for each of its images; none where there is nothing.
    pub extras: Vec<Extra>,
    /// What was found out on the way, as sentences.
    pub warnings: Vec<String>,
}

/// What a model does not hold of a view.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Extra {
    /// The file of its mask, of the size of its camera.
    pub mask: Option<PathBuf>,
    pub depth_range: Option<crate::geometry::DepthRange>,
    pub sources: Option<Vec<u32>>,
    /// Whether it gets no maps.
    pub is_source_only: bool,
}

/// Reads the scene at a path. One that is a COLMAP workspace already and of which everything is taken stays
/// where it is; any other is made into one in `folder`.
///
/// # Errors
/// The errors of [`chosen::read`]; a photograph or mask that is missing, damaged or not of the size of its
/// camera; a choice that fits nothing; a file that cannot be written; [`Error::Cancelled`].
pub(crate) fn prepare(
    scene: &Path,
    options: &Options,
    folder: &Path,
    progress: ProgressFn,
) -> Result<Prepared> {
    let source = chosen::read(scene, options)?;
    let tracker = Tracker::with_work(progress, source.photographs.len() as u64);
    let advance = |units, view| {
        let (phase, views) = (Phase::Read, source.photographs.len());
        tracker.advance(units, Progress { phase, downscale: 1, cycle: 0, view, views, done: 0.0 })
    };
    let mut warnings = source.warnings.clone();
    let changes = Changes::new(&source, &options.input, &|view| advance(0, view))?;
    warnings.extend(changes.warning());
    let import = Import { source: &source, changes: &changes, folder };
    if let Some(folder) = import.unchanged(&options.input) {
        return Ok(Prepared { folder, is_imported: false, extras: Vec::new(), warnings });
    }
    import.refuse_own_folder()?;
    let record = Record::read(folder);
    let entry = |view: usize| {
        advance(0, view)?;
        let entry = import.photograph(view, record.get(&source.photographs[view].name))?;
        advance(1, view)?;
        Ok(entry)
    };
    let entries: Vec<Result<Entry>> = changes.each(memory_budget(options.memory), &entry)?;
    // What is done is noted even if the rest failed: the next call does not do it again.
    let names = source.photographs.iter().map(|photograph| photograph.name.clone());
    let done = names.zip(&entries).filter_map(|(name, entry)| Some((name, entry.as_ref().ok()?.clone())));
    Record::new(done).write(folder)?;
    let entries = entries.into_iter().collect::<Result<Vec<_>>>()?;
    let sparse = import.write_model()?;
    let extra = |(photograph, entry): (&SourcePhotograph, &Entry)| Extra {
        mask: entry.mask.as_ref().map(|_| mask_path(folder, &photograph.name)),
        depth_range: photograph.depth_range,
        sources: photograph.sources.clone(),
        is_source_only: !photograph.is_reference,
    };
    let extras = source.photographs.iter().zip(&entries).map(extra).collect();
    Ok(Prepared {
        folder: SceneFolder { images: folder.join("images"), sparse },
        is_imported: true,
        extras,
        warnings,
    })
}

/// The file of a mask in a workspace, as COLMAP names it.
pub(crate) fn mask_path(folder: &Path, name: &str) -> PathBuf {
    folder.join("masks").join(format!("{name}.png"))
}

/// What is imported into a folder.
struct Import<'a> {
    source: &'a SourceScene,
    changes: &'a Changes<'a>,
    folder: &'a Path,
}

impl Import<'_> {
    /// The scene, if it is a COLMAP workspace in which nothing is to be changed.
    fn unchanged(&self, options: &InputOptions) -> Option<SceneFolder> {
        let has_extra = |photograph: &SourcePhotograph| {
            let SourcePhotograph { mask, depth_range, sources, .. } = photograph;
            mask.is_some() || depth_range.is_some() || sources.is_some()
        };
        let are_all = options.images.is_empty() && options.reference.is_empty();
        let is_as_it_is =
            are_all && self.changes.are_none() && !self.source.photographs.iter().any(has_extra);
        self.source.workspace.clone().filter(|_| is_as_it_is)
    }

    /// Returns an error if a photograph would be replaced by a changed one, or a scene that no run put there.
    fn refuse_own_folder(&self) -> Result<()> {
        let is_run =
            ["manifest.json", "import.json"].iter().any(|name| self.folder.join("run").join(name).is_file());
        if !is_run && SceneFolder::find(self.folder).is_ok() {
            let problem = "holds another scene, which no run of skep put there; name another folder";
            return Err(Error::file(self.folder, problem));
        }
        let own = |path: PathBuf| path.canonicalize().ok();
        let is_own = |photograph: &&SourcePhotograph| {
            let to = self.folder.join("images").join(&photograph.name);
            own(to).is_some_and(|to| Some(to) == own(photograph.path.clone()))
        };
        match self.source.photographs.iter().find(is_own) {
            Some(photograph) => Err(Error::file(
                &photograph.path,
                "would be replaced by a changed photograph; name another folder than the scene's for the \
                 results",
            )),
            None => Ok(()),
        }
    }

    /// Writes a photograph and its mask, unless they are there.
    fn photograph(&self, view: usize, earlier: Option<&Entry>) -> Result<Entry> {
        let photograph = &self.source.photographs[view];
        let bytes = read(&photograph.path)?;
        let mask = photograph.mask.as_deref().map(fingerprint_file).transpose()?;
        let made_from = format!("{:?} {mask:?} {}", fingerprint(&bytes), self.changes.key(view));
        let made_from = fingerprint(made_from.as_bytes());
        let to = self.folder.join("images").join(&photograph.name);
        let mask_to = mask_path(self.folder, &photograph.name);
        if let Some(earlier) = earlier
            && earlier.made_from == made_from
            && is_still(&to, &earlier.image)
            && earlier.mask.as_ref().is_none_or(|mask| is_still(&mask_to, mask))
        {
            return Ok(earlier.clone());
        }
        remove(&to)?;
        // Decoded even where it stays as it is: a damaged photograph is found now and not after hours.
        match self.changes.picture(view, &bytes)? {
            (_, true) => link_or_copy(&photograph.path, &to)?,
            (picture, false) => write_photograph(&to, &picture)?,
        }
        remove(&mask_to)?;
        let mask = match self.changes.mask(view, &bytes)? {
            Some(mask) => {
                let Camera { width, height, .. } = self.changes.shapes()[view].camera;
                write_mask(&mask_to, &mask, (width, height))?;
                Some(fingerprint_file(&mask_to)?)
            }
            None => None,
        };
        Ok(Entry { made_from, image: fingerprint_file(&to)?, mask })
    }

    /// Writes the model of the changed photographs, unless it is there; gives its folder.
    fn write_model(&self) -> Result<PathBuf> {
        let image = |(photograph, change): (&SourcePhotograph, &Change)| ModelImage {
            name: photograph.name.clone(),
            camera: change.camera,
        };
        let images = self.source.photographs.iter().zip(self.changes.shapes()).map(image).collect();
        let model = ColmapModel { images, points: self.source.points.clone() };
        let sparse = self.folder.join("sparse");
        for name in ["cameras", "images", "points3D"] {
            remove(&sparse.join(format!("{name}.txt")))?;
        }
        model.write_binary(&sparse)?;
        Ok(sparse)
    }
}

fn is_still(path: &Path, content: &Fingerprint) -> bool {
    fingerprint_file(path).is_ok_and(|found| found == *content)
}

fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::file(path, format!("cannot be replaced: {error}")))
        }
        _ => Ok(()),
    }
}
