//! The formats of scenes, one file each.

mod colmap;

use super::SourceScene;
use crate::error::{Error, Result};
use std::path::Path;

/// A format: whether a path is of it, and how it is read.
struct Format {
    /// Whether there is a scene of this format at a path, by the names of files only.
    is_at: fn(&Path) -> bool,
    read: fn(&Path) -> Result<SourceScene>,
    /// What is looked for, for the error where nothing is found.
    looked_for: &'static str,
}

/// In the order in which they are looked for.
const FORMATS: [Format; 1] = [Format {
    is_at: colmap::is_at,
    read: colmap::read,
    looked_for: "a COLMAP model (cameras and images, .bin or .txt, in sparse/ or sparse/0/) beside images/",
}];

/// Reads the scene at a path, a folder or a file, whichever format it has.
///
/// # Errors
/// Nothing that is known; the errors of the format's reader.
pub fn read(path: &Path) -> Result<SourceScene> {
    if !path.exists() {
        return Err(Error::file(path, "no such file or folder; expected a scene"));
    }
    match FORMATS.iter().find(|format| (format.is_at)(path)) {
        Some(format) => (format.read)(path),
        None => {
            let looked_for = FORMATS.iter().map(|format| format.looked_for).collect::<Vec<_>>().join("; ");
            Err(Error::file(path, format!("no scene; expected one of: {looked_for}")))
        }
    }
}
