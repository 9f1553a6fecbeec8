//! Whether the files of a workspace can be written, found out before the work that makes them.

use super::files::{cannot_be_written, check_file_place};
use super::workspace::Workspace;
use crate::error::{Error, Result};
use crate::options::ViewFiles;
use std::collections::{HashMap, HashSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Names of fewer bytes are allowed by every file system.
const SHORT_NAME: usize = 100;

impl Workspace {
    /// Checks that [`Workspace::write_view`] can write the files of these views: that no file has the name of
    /// a folder of another one, that nothing else is in the way, that the file system allows the names, and
    /// that folders that are there can be written to. Writes and creates nothing.
    ///
    /// # Errors
    /// The first file that cannot be written, named with what is in the way.
    ///
    /// # Examples
    /// ```
    /// let folder = tempfile::tempdir().unwrap();
    /// let workspace = skep::io::Workspace::new(folder.path());
    /// workspace.check_places(["left.jpg", "right/1.jpg"].into_iter())?;
    /// let long = format!("{}.jpg", "long".repeat(62));
    /// assert!(workspace.check_places([long.as_str()].into_iter()).is_err());
    /// # Ok::<(), skep::Error>(())
    /// ```
    pub fn check_places<'a>(&self, names: impl Iterator<Item = &'a str>) -> Result<()> {
        self.check_places_and(names, Vec::new())
    }

    /// Like [`Workspace::check_places`], for these files below the folder too.
    pub(crate) fn check_places_and<'a>(
        &self,
        names: impl Iterator<Item = &'a str>,
        others: Vec<PathBuf>,
    ) -> Result<()> {
        let mut files = others;
        for name in names {
            Workspace::check_name(name)?;
            files.extend(self.view_files(name, &ViewFiles::ALL));
        }
        files.push(self.cloud());
        for file in &mut files {
            if let Ok(below) = file.strip_prefix(self.folder()) {
                *file = below.to_owned();
            }
        }
        check_files(self.folder(), &files)
    }
}

/// Checks that these files below a folder can be written; see [`Workspace::check_places`].
pub(super) fn check_files(root: &Path, files: &[PathBuf]) -> Result<()> {
    check_each_other(root, files)?;
    let mut places = Places::new(root);
    files.iter().try_for_each(|file| places.check(file))
}

/// Returns an error if a file has the name of a folder that another one is in.
fn check_each_other(root: &Path, files: &[PathBuf]) -> Result<()> {
    let planned: HashSet<&Path> = files.iter().map(PathBuf::as_path).collect();
    for file in files {
        if let Some(both) = file.ancestors().skip(1).find(|folder| planned.contains(folder)) {
            let problem = format!("another view's file is to be {}; rename one of the two", both.display());
            return Err(cannot_be_written(&root.join(file), problem));
        }
    }
    Ok(())
}

/// Folders below a root, and whether they exist.
struct Places<'a> {
    root: &'a Path,
    /// The innermost folder that exists of the root and those above it.
    existing: &'a Path,
    folders: HashMap<PathBuf, bool>,
}

impl<'a> Places<'a> {
    fn new(root: &'a Path) -> Places<'a> {
        let exists = |folder: &&Path| folder.is_dir();
        let existing = root.ancestors().find(exists).unwrap_or(Path::new("."));
        Places { root, existing, folders: HashMap::new() }
    }

    /// Checks a file by its path relative to the root.
    fn check(&mut self, file: &Path) -> Result<()> {
        let path = self.root.join(file);
        // The file system is asked: limits differ.
        for part in file.iter().filter(|part| part.len() >= SHORT_NAME) {
            self.check_length(&self.existing.join(part), &path, part.len())?;
        }
        if file.as_os_str().len() >= SHORT_NAME {
            self.check_length(&path, &path, path.as_os_str().len())?;
        }
        if self.folder_exists(file.parent().unwrap_or(Path::new("")))? {
            check_file_place(&path)?;
        }
        Ok(())
    }

    fn check_length(&self, probe: &Path, path: &Path, length: usize) -> Result<()> {
        match std::fs::symlink_metadata(probe) {
            Err(error) if error.kind() == ErrorKind::InvalidFilename => {
                let problem = format!("a name of {length} bytes is too long; rename the photograph");
                Err(cannot_be_written(path, problem))
            }
            _ => Ok(()),
        }
    }

    /// Whether a folder exists, which can then be written to.
    fn folder_exists(&mut self, folder: &Path) -> Result<bool> {
        if let Some(&known) = self.folders.get(folder) {
            return Ok(known);
        }
        let path = self.root.join(folder);
        let exists = match std::fs::metadata(&path) {
            Ok(found) if found.is_dir() => {
                tempfile::tempfile_in(&path).map_err(|error| cannot_be_written(&path, error))?;
                true
            }
            Ok(_) => return Err(Error::file(path, "a file; expected a folder, or nothing, of this name")),
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                if let Some(parent) = folder.parent() {
                    self.folder_exists(parent)?;
                }
                false
            }
            Err(error) => return Err(cannot_be_written(&path, error)),
        };
        self.folders.insert(folder.to_owned(), exists);
        Ok(exists)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::TempDir;

    fn check(folder: &TempDir, names: &[&str]) -> String {
        let workspace = Workspace::new(folder.path().join("dense"));
        let checked = workspace.check_places(names.iter().copied());
        checked.err().map_or(String::new(), |error| error.to_string())
    }

    #[test]
    fn nothing_is_in_the_way_of_usual_names_and_nothing_is_made() {
        let folder = TempDir::new().unwrap();
        assert_eq!(check(&folder, &["a.png", "A.png", "b/a.png", "b/c.d/e"]), "");
        assert!(!folder.path().join("dense").exists());
        std::fs::create_dir_all(folder.path().join("dense/stereo/depth_maps")).unwrap();
        std::fs::write(folder.path().join("dense/stereo/depth_maps/a.png.geometric.bin"), "old").unwrap();
        assert_eq!(check(&folder, &["a.png", "b.png"]), "", "old files are replaced");
    }

    #[test]
    fn names_whose_maps_would_be_too_long_are_refused() {
        let folder = TempDir::new().unwrap();
        let name = |length: usize| format!("{}.png", "x".repeat(length - 4));
        assert_eq!(check(&folder, &[&name(239)]), "");
        let found = check(&folder, &["a.png", &name(240)]);
        assert!(found.contains("a name of 256 bytes is too long; rename the photograph"), "{found}");
        let deep = vec!["folder"; 700].join("/");
        assert!(check(&folder, &[&deep]).contains("too long"));
    }

    #[test]
    fn a_view_in_a_folder_called_like_a_file_of_another_one_is_refused() {
        let folder = TempDir::new().unwrap();
        let found = check(&folder, &["a.png", "a.png.geometric.bin/b.png"]);
        assert!(found.contains("b.png") && found.contains("a.png.geometric.bin; rename"), "{found}");
    }

    #[test]
    fn folders_in_the_way_of_files_and_files_in_the_way_of_folders_are_named() {
        let folder = TempDir::new().unwrap();
        let dense = folder.path().join("dense");
        std::fs::create_dir_all(dense.join("preview/a.png.depth.png")).unwrap();
        let found = check(&folder, &["a.png"]);
        assert!(found.contains("a.png.depth.png: cannot be written: a folder has this name"), "{found}");
        std::fs::write(dense.join("stereo"), "").unwrap();
        let found = check(&folder, &["b.png"]);
        assert!(found.contains("stereo: a file; expected a folder"), "{found}");
    }
}
