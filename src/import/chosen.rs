//! The scene of a path, with what the options take of it and add to it.

use super::depth_ranges::read_depth_ranges;
use super::selection::{select, select_references};
use super::source_lists::read_source_lists;
use super::{SourceScene, formats};
use crate::error::{Error, Result};
use crate::options::{InputOptions, Options};
use std::path::Path;

/// Reads the scene at a path, with what the options take of it and add to it.
///
/// # Errors
/// The errors of [`formats::read`]; a choice that fits nothing; a file of the options that is missing or
/// damaged.
pub(super) fn read(scene: &Path, options: &Options) -> Result<SourceScene> {
    let mut source = formats::read(scene)?;
    let InputOptions { sources, depth_ranges, images, masks, .. } = &options.input;
    if !sources.is_empty() {
        read_source_lists(&mut source, Path::new(sources))?;
    }
    if !depth_ranges.is_empty() {
        read_depth_ranges(&mut source, Path::new(depth_ranges))?;
    }
    select(&mut source, images)?;
    select_references(&mut source, options)?;
    if !masks.is_empty() {
        find_masks(&mut source, Path::new(masks))?;
    }
    Ok(source)
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
