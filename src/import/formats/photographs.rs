//! The photographs of a scene: their files and sizes, and their names in the results.

use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::io::{NAME_INSIDE, picture_size, stays_inside};
use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};

/// Endings that are tried where a file names a photograph without one.
const ENDINGS: [&str; 6] = ["png", "jpg", "jpeg", "PNG", "JPG", "JPEG"];

/// The file of a photograph; `entry` names what asks for it.
///
/// # Errors
/// No such file.
pub(super) fn find(path: PathBuf, entry: &str) -> Result<PathBuf> {
    if path.is_file() {
        return Ok(path);
    }
    Err(Error::file(&path, format!("no such file; {entry} names this photograph")))
}

/// Like [`find`], for a path that may lack its ending.
pub(super) fn find_with_ending(path: PathBuf, entry: &str) -> Result<PathBuf> {
    if path.is_file() {
        return Ok(path);
    }
    let with = |ending: &&str| {
        let mut name = path.clone().into_os_string();
        name.push(format!(".{ending}"));
        Some(PathBuf::from(name)).filter(|path| path.is_file())
    };
    ENDINGS.iter().find_map(with).ok_or_else(|| {
        let endings = ENDINGS.map(|ending| format!(".{ending}")).join(", ");
        Error::file(
            &path,
            format!("no such file, nor with one of {endings} added; {entry} names this photograph"),
        )
    })
}

/// Returns an error unless a photograph has its camera's size.
pub(super) fn check_size(path: &Path, camera: &Camera, entry: &str) -> Result<()> {
    let (width, height) = picture_size(path)?;
    if (width, height) == (camera.width, camera.height) {
        return Ok(());
    }
    let expected = format!("{}x{}, the size of its camera in {entry}", camera.width, camera.height);
    Err(Error::file(path, format!("the picture is {width}x{height}; expected {expected}")))
}

/// Names in the results of photographs wherever they are: their paths below the innermost folder that holds
/// all of them. `.` and `..` in paths are resolved by their text alone.
///
/// # Errors
/// The same file twice; no folder that holds all; names of control characters or not in Unicode.
pub(super) fn names(paths: &[PathBuf]) -> Result<Vec<String>> {
    let absolute = paths.iter().map(|path| without_dots(path)).collect::<Result<Vec<_>>>()?;
    let mut common: Option<&Path> = None;
    for path in &absolute {
        let folder = path.parent().unwrap_or(path);
        common = match common {
            None => Some(folder),
            Some(known) => {
                let shared = folder.ancestors().find(|folder| known.starts_with(folder));
                Some(shared.ok_or_else(|| {
                    let known = known.display();
                    Error::file(
                        path,
                        format!("is on another drive than {known}; expected one folder above all"),
                    )
                })?)
            }
        };
    }
    let mut known = HashSet::new();
    absolute
        .iter()
        .map(|path| {
            let below = common.and_then(|common| path.strip_prefix(common).ok()).unwrap_or(path);
            let parts: Option<Vec<&str>> = below.iter().map(|part| part.to_str()).collect();
            let name = parts.map(|parts| parts.join("/")).filter(|name| stays_inside(name));
            let name =
                name.ok_or_else(|| Error::file(path, format!("has no usable name; expected {NAME_INSIDE}")))?;
            if !known.insert(name.clone()) {
                return Err(Error::file(path, "is the photograph of two entries; expected one each"));
            }
            Ok(name)
        })
        .collect()
}

fn without_dots(path: &Path) -> Result<PathBuf> {
    let absolute = std::path::absolute(path).map_err(|error| Error::file(path, error))?;
    let mut clean = PathBuf::new();
    for part in absolute.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                clean.pop();
            }
            part => clean.push(part),
        }
    }
    Ok(clean)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_of(paths: &[&str]) -> Result<Vec<String>> {
        names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>())
    }

    #[test]
    fn names_are_relative_to_the_folder_that_holds_all_photographs() {
        let found = names_of(&["/s/images/a/1.png", "/s/./images/b/1.png"]);
        assert_eq!(found, Ok(vec!["a/1.png".into(), "b/1.png".into()]));
        let found = names_of(&["/s/images/1.png", "/s/images/x/../../../other/2.png"]);
        assert_eq!(found, Ok(vec!["s/images/1.png".into(), "other/2.png".into()]));
        assert_eq!(names_of(&["images/1.png"]), Ok(vec!["1.png".into()]));
    }

    #[test]
    fn one_file_cannot_be_two_photographs() {
        let error = names_of(&["/s/1.png", "/s/x/../1.png"]).unwrap_err().to_string();
        assert!(error.contains("1.png") && error.contains("two entries"), "{error}");
    }
}
