//! The workspace of a run from a scene of any program: photographs without distortion, small enough, with
//! masks, and a model of pinhole cameras. What is there already and still right is not made again.

use super::photograph::Change;
use super::record::{Entry, Record};
use super::selection::select;
use super::source_lists::read_source_lists;
use super::{SourcePhotograph, SourceScene, formats};
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::io::{
    ColmapModel, ModelImage, SceneFolder, cannot_be_read, deep_picture_from_bytes, largest_value,
    link_or_copy, opaque_pixels, picture_from_bytes, picture_header, read_mask, write_mask, write_photograph,
};
use crate::io::{Fingerprint, fingerprint, fingerprint_file};
use crate::memory::{memory_budget, require_memory};
use crate::options::{InputOptions, Options};
use crate::parallel::{Phase, Progress, ProgressFn};
use crate::pipeline::Tracker;
use rayon::prelude::*;
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
}

/// Reads the scene at a path. One that is a COLMAP workspace already and of which everything is taken stays
/// where it is; any other is made into one in `folder`.
///
/// # Errors
/// The errors of [`formats::read`]; a photograph or mask that is missing, damaged or not of the size of its
/// camera; a choice that fits nothing; a file that cannot be written; [`Error::Cancelled`].
pub(crate) fn prepare(
    scene: &Path,
    options: &Options,
    folder: &Path,
    progress: ProgressFn,
) -> Result<Prepared> {
    let (memory, options) = (memory_budget(options.memory), &options.input);
    let mut source = formats::read(scene)?;
    if !options.sources.is_empty() {
        read_source_lists(&mut source, Path::new(&options.sources))?;
    }
    select(&mut source, &options.images)?;
    if !options.masks.is_empty() {
        find_masks(&mut source, Path::new(&options.masks))?;
    }
    let tracker = Tracker::with_work(progress, source.photographs.len() as u64);
    let advance = |units, view| {
        let (phase, views) = (Phase::Read, source.photographs.len());
        tracker.advance(units, Progress { phase, downscale: 1, cycle: 0, view, views, done: 0.0 })
    };
    let mut warnings = source.warnings.clone();
    let white = white_level(&source, &|view| advance(0, view))?;
    if white != u16::MAX {
        warnings.push(format!(
            "the photographs have 16 bits a channel, but no value above {white}: {white} is taken as white"
        ));
    }
    let import = Import { source: &source, options, folder, white };
    let changes = import.changes()?;
    if let Some(folder) = import.unchanged(&changes) {
        return Ok(Prepared { folder, is_imported: false, extras: Vec::new(), warnings });
    }
    import.refuse_own_folder()?;
    let record = Record::read(folder);
    let entry = |(view, change): (usize, &Change)| {
        advance(0, view)?;
        let entry = import.photograph(view, change, record.get(&source.photographs[view].name))?;
        advance(1, view)?;
        Ok(entry)
    };
    // As many at a time as fit into the memory.
    let largest = changes.iter().map(Change::memory).max().unwrap_or(0);
    require_memory(largest, "the change of a photograph")?;
    let at_a_time = (memory / largest.max(1)).clamp(1, rayon::current_num_threads() as u64) as usize;
    let numbered: Vec<(usize, &Change)> = changes.iter().enumerate().collect();
    let in_turns = numbered.chunks(numbered.len().div_ceil(at_a_time).max(1)).collect::<Vec<_>>();
    let one_by_one =
        |part: &[(usize, &Change)]| part.iter().copied().map(entry).collect::<Vec<Result<Entry>>>();
    let entries: Vec<Result<Entry>> =
        in_turns.into_par_iter().with_max_len(1).flat_map_iter(one_by_one).collect();
    // What is done is noted even if the rest failed: the next call does not do it again.
    let names = source.photographs.iter().map(|photograph| photograph.name.clone());
    let done = names.zip(&entries).filter_map(|(name, entry)| Some((name, entry.as_ref().ok()?.clone())));
    Record::new(done).write(folder)?;
    let entries = entries.into_iter().collect::<Result<Vec<_>>>()?;
    let sparse = import.write_model(&changes)?;
    let extra = |(photograph, entry): (&SourcePhotograph, &Entry)| Extra {
        mask: entry.mask.as_ref().map(|_| mask_path(folder, &photograph.name)),
        depth_range: photograph.depth_range,
        sources: photograph.sources.clone(),
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

/// Finds the mask of each photograph in a folder: the file of its name with `.png` after it, or with another
/// ending in place of its own.
///
/// # Errors
/// No such folder; a folder without a mask of any photograph.
fn find_masks(source: &mut SourceScene, folder: &Path) -> Result<()> {
    if !folder.is_dir() {
        return Err(Error::argument("options.input.masks", folder.display(), "a folder with masks"));
    }
    for photograph in &mut source.photographs {
        let named = folder.join(format!("{}.png", photograph.name));
        let own = folder.join(&photograph.name);
        let endings = ["png", "jpg", "jpeg", "tif", "tiff", "bmp"].map(|ending| own.with_extension(ending));
        if let Some(found) = [named, own].into_iter().chain(endings).find(|path| path.is_file()) {
            photograph.mask = Some(found);
        }
    }
    let count = source.photographs.iter().filter(|photograph| photograph.mask.is_some()).count();
    match (count, source.photographs.first()) {
        (0, Some(first)) => {
            let expected = format!("a folder with masks such as {}.png", first.name);
            Err(Error::argument("options.input.masks", folder.display(), expected))
        }
        (count, _) if count < source.photographs.len() => {
            let without = source.photographs.len() - count;
            source.warnings.push(format!("{without} photographs have no mask in {}", folder.display()));
            Ok(())
        }
        _ => Ok(()),
    }
}

/// The value of white in photographs of 16 bits: the largest of the usual ones that is needed for all of
/// them, since cameras and converters store 10, 12 or 14 bits in 16.
fn white_level(source: &SourceScene, before: &(dyn Fn(usize) -> Result<()> + Sync)) -> Result<u16> {
    let largest = |(view, photograph): (usize, &SourcePhotograph)| -> Result<Option<u16>> {
        before(view)?;
        if !photograph.path.is_file() {
            return Err(missing(source, photograph));
        }
        if !picture_header(&photograph.path)?.is_deep {
            return Ok(None);
        }
        let bytes = read(&photograph.path)?;
        largest_value(&bytes, &photograph.path).map(Some)
    };
    let all: Vec<Option<u16>> =
        source.photographs.par_iter().enumerate().with_max_len(1).map(largest).collect::<Result<_>>()?;
    let Some(largest) = all.iter().flatten().max() else { return Ok(u16::MAX) };
    let levels = [8, 10, 12, 14].map(|bits| (1u16 << bits) - 1);
    Ok(levels.into_iter().find(|level| largest <= level).unwrap_or(u16::MAX))
}

fn missing(source: &SourceScene, photograph: &SourcePhotograph) -> Error {
    let problem = format!("no such file; {} has a photograph of this name", source.origin);
    Error::file(&photograph.path, problem)
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|error| cannot_be_read(path, error))
}

/// What is imported into a folder.
struct Import<'a> {
    source: &'a SourceScene,
    options: &'a InputOptions,
    folder: &'a Path,
    white: u16,
}

impl Import<'_> {
    /// How each photograph is changed.
    ///
    /// # Errors
    /// A photograph that is not of its camera's size; a lens that cannot be undistorted.
    fn changes(&self) -> Result<Vec<Change>> {
        let change = |photograph: &SourcePhotograph| {
            let size = picture_header(&photograph.path)?.size;
            let Camera { width, height, .. } = photograph.lens.camera;
            if size != (width, height) {
                let expected = format!("{width}x{height}, the size of its camera in {}", self.source.origin);
                let problem = format!("the picture is {}x{}; expected {expected}", size.0, size.1);
                return Err(Error::file(&photograph.path, problem));
            }
            Change::new(photograph.lens, self.options.max_image_size, &photograph.name)
        };
        self.source.photographs.par_iter().with_max_len(1).map(change).collect()
    }

    /// The scene, if it is a COLMAP workspace in which nothing is to be changed.
    fn unchanged(&self, changes: &[Change]) -> Option<SceneFolder> {
        let has_extra = |photograph: &SourcePhotograph| {
            let SourcePhotograph { mask, depth_range, sources, .. } = photograph;
            mask.is_some() || depth_range.is_some() || sources.is_some()
        };
        let is_as_it_is = self.options.images.is_empty()
            && !self.options.alpha_mask
            && self.white == u16::MAX
            && changes.iter().all(Change::is_none)
            && !self.source.photographs.iter().any(has_extra);
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
                "would be replaced by a changed photograph; name another folder than the scene's for the results",
            )),
            None => Ok(()),
        }
    }

    /// Writes a photograph and its mask, unless they are there.
    fn photograph(&self, view: usize, change: &Change, earlier: Option<&Entry>) -> Result<Entry> {
        let photograph = &self.source.photographs[view];
        let bytes = read(&photograph.path)?;
        let mask = photograph.mask.as_deref().map(fingerprint_file).transpose()?;
        let (alpha, white) = (self.options.alpha_mask, self.white);
        let made_from = format!("{:?} {change:?} {mask:?} {alpha} {white}", fingerprint(&bytes));
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
        let is_deep = white != u16::MAX && picture_header(&photograph.path)?.is_deep;
        remove(&to)?;
        if change.is_none() && !is_deep {
            // Decoded all the same: a damaged photograph is found now and not after hours.
            picture_from_bytes(&bytes, &photograph.path)?;
            link_or_copy(&photograph.path, &to)?;
        } else {
            let picture = match is_deep {
                true => deep_picture_from_bytes(&bytes, &photograph.path, white)?,
                false => picture_from_bytes(&bytes, &photograph.path)?,
            };
            write_photograph(&to, &change.apply(&picture)?)?;
        }
        remove(&mask_to)?;
        let mask = match self.mask(photograph, change, &bytes)? {
            Some(mask) => {
                write_mask(&mask_to, &mask, (change.camera.width, change.camera.height))?;
                Some(fingerprint_file(&mask_to)?)
            }
            None => None,
        };
        Ok(Entry { made_from, image: fingerprint_file(&to)?, mask })
    }

    /// The mask of a changed photograph; `None` where nothing is ignored.
    fn mask(
        &self,
        photograph: &SourcePhotograph,
        change: &Change,
        bytes: &[u8],
    ) -> Result<Option<Vec<bool>>> {
        let Camera { width, height, .. } = photograph.lens.camera;
        let mut own = photograph.mask.as_deref().map(|path| read_mask(path, (width, height))).transpose()?;
        if self.options.alpha_mask
            && let Some(opaque) = opaque_pixels(bytes, &photograph.path, (width, height))?
        {
            own = Some(match own {
                Some(mask) => mask.iter().zip(&opaque).map(|(&a, &b)| a && b).collect(),
                None => opaque,
            });
        }
        if own.is_none() && photograph.lens.distortion.is_none() {
            return Ok(None);
        }
        let mask = change.mask(own.as_deref());
        Ok((!mask.iter().all(|&is_known| is_known)).then_some(mask))
    }

    /// Writes the model of the changed photographs, unless it is there; gives its folder.
    fn write_model(&self, changes: &[Change]) -> Result<PathBuf> {
        let image = |(photograph, change): (&SourcePhotograph, &Change)| ModelImage {
            name: photograph.name.clone(),
            camera: change.camera,
        };
        let images = self.source.photographs.iter().zip(changes).map(image).collect();
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
