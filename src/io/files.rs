//! Atomic writes of files, and a reader of binary files that checks every size.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Component, Path, PathBuf};

/// The first letters of the names of temporary files: a process that was killed leaves some.
const TEMPORARY_PREFIX: &str = ".skep-tmp-";

/// A temporary file in a folder, removed when it is dropped.
pub(super) fn temporary_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    tempfile::Builder::new().prefix(TEMPORARY_PREFIX).tempfile_in(folder)
}

/// Removes the temporary files that killed processes left in a folder and those below it.
pub(crate) fn remove_temporary_files(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder {
            remove_temporary_files(&entry.path());
        } else if entry.file_name().to_string_lossy().starts_with(TEMPORARY_PREFIX) {
            // One that cannot be removed does no harm.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Folders that were created; those that are still empty are removed when it is dropped.
#[derive(Debug)]
pub(crate) struct NewFolders(Vec<PathBuf>);

impl NewFolders {
    /// Creates a folder, and those above it, where there is none.
    pub(crate) fn create(folder: &Path) -> io::Result<NewFolders> {
        let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        // The innermost first.
        let new = folder.ancestors().take_while(is_missing).map(Path::to_owned).collect();
        // Also if only some of them can be created, those are removed.
        let new = NewFolders(new);
        std::fs::create_dir_all(folder).map(|()| new)
    }
}

impl Drop for NewFolders {
    fn drop(&mut self) {
        // Fails where there is a file, or another folder with one.
        self.0.iter().for_each(|folder| drop(std::fs::remove_dir(folder)));
    }
}

/// Returns an error if something that is no file is where a file is about to be written.
pub(crate) fn check_file_place(path: &Path) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(cannot_be_written(path, "a folder has this name")),
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(cannot_be_written(path, error)),
        _ => Ok(()),
    }
}

/// Writes a file under a temporary name in the same folder and renames it; a missing folder is created.
pub fn write_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let attempt = || -> io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY_PREFIX);
        // Temporary files are private to the user; the result gets the permissions of the umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut temporary = builder.tempfile_in(folder)?;
        let mut writer = BufWriter::new(temporary.as_file_mut());
        write(&mut writer)?;
        writer.flush()?;
        drop(writer);
        // A name must not appear before its content is on the disk: power may fail in between.
        temporary.as_file().sync_data()?;
        temporary.persist(path)?;
        Ok(())
    };
    attempt().map_err(|error| cannot_be_written(path, error))
}

/// The error of a file that cannot be written.
pub(crate) fn cannot_be_written(path: &Path, error: impl std::fmt::Display) -> Error {
    Error::file(path, format!("cannot be written: {error}"))
}

/// Whether the files of a view of this name lie inside their folder.
pub(crate) fn stays_inside(name: &str) -> bool {
    let is_below = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
    // `components` skips what means nothing: `a//b` and `a/./b` would be other names of the file `a/b`.
    let is_plain = name.split('/').all(|part| !part.is_empty() && part != ".");
    is_plain && is_below && !name.contains(char::is_control)
}

/// What [`stays_inside`] requires, for error texts.
pub(crate) const NAME_INSIDE: &str = "a path below the folder of images, without `..`, `.` or empty parts";

/// Copies a file atomically.
pub(crate) fn copy_file(from: &Path, to: &Path) -> Result<()> {
    let mut source = File::open(from).map_err(|error| cannot_be_read(from, error))?;
    write_file(to, |out| io::copy(&mut source, out).map(drop))
}

/// Hard-links a file; copies it where the file system cannot link.
pub(crate) fn link_or_copy(from: &Path, to: &Path) -> Result<()> {
    if let Some(parent) = to.parent() {
        let made = std::fs::create_dir_all(parent);
        made.map_err(|error| cannot_be_written(to, error))?;
    }
    match std::fs::hard_link(from, to) {
        Ok(()) => Ok(()),
        Err(_) => copy_file(from, to),
    }
}

/// Reads a file sequentially and checks every read against its size.
pub(crate) struct FileReader {
    path: PathBuf,
    reader: BufReader<File>,
    remaining: u64,
}

impl FileReader {
    pub(crate) fn open(path: &Path) -> Result<FileReader> {
        let open = || -> io::Result<(File, u64)> {
            let file = File::open(path)?;
            let metadata = file.metadata()?;
            if metadata.is_dir() {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            Ok((file, metadata.len()))
        };
        let (file, remaining) = open().map_err(|error| cannot_be_read(path, error))?;
        Ok(FileReader { path: path.to_owned(), reader: BufReader::new(file), remaining })
    }

    /// An error that names the file.
    pub(crate) fn error(&self, problem: impl std::fmt::Display) -> Error {
        Error::file(&self.path, problem)
    }

    /// Bytes not read yet.
    pub(crate) fn remaining(&self) -> u64 {
        self.remaining
    }

    /// Returns an error unless `count` entries of `size` bytes remain: call it before any allocation of that
    /// size.
    pub(crate) fn require(&self, count: u64, size: u64, what: &str) -> Result<()> {
        match count.checked_mul(size) {
            Some(bytes) if bytes <= self.remaining => Ok(()),
            _ => {
                let remaining = self.remaining;
                Err(self
                    .error(format!("truncated: {count} x {size} bytes of {what} expected, {remaining} left")))
            }
        }
    }

    pub(crate) fn fill(&mut self, buffer: &mut [u8], what: &str) -> Result<()> {
        self.require(1, buffer.len() as u64, what)?;
        self.reader.read_exact(buffer).map_err(|error| cannot_be_read(&self.path, error))?;
        self.remaining -= buffer.len() as u64;
        Ok(())
    }

    pub(crate) fn bytes<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let mut buffer = [0; N];
        self.fill(&mut buffer, what)?;
        Ok(buffer)
    }

    pub(crate) fn u32(&mut self, what: &str) -> Result<u32> {
        self.bytes(what).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, what: &str) -> Result<u64> {
        self.bytes(what).map(u64::from_le_bytes)
    }

    /// Numbers that must be finite.
    pub(crate) fn f64s<const N: usize>(&mut self, what: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = f64::from_le_bytes(self.bytes(what)?);
        }
        if values.iter().all(|value| value.is_finite()) {
            return Ok(values);
        }
        Err(self.error(format!("{what} is {values:?}; expected finite numbers")))
    }

    /// Skips `count` entries of `size` bytes.
    pub(crate) fn skip(&mut self, count: u64, size: u64, what: &str) -> Result<()> {
        self.require(count, size, what)?;
        let bytes = count * size;
        self.reader.seek_relative(bytes as i64).map_err(|error| cannot_be_read(&self.path, error))?;
        self.remaining -= bytes;
        Ok(())
    }

    /// Returns an error if bytes remain.
    pub(crate) fn finish(self) -> Result<()> {
        match self.remaining {
            0 => Ok(()),
            bytes => Err(self.error(format!("{bytes} bytes too many after the last entry"))),
        }
    }
}

/// The error of a file that cannot be opened or read.
pub(crate) fn cannot_be_read(path: &Path, error: impl std::fmt::Display) -> Error {
    Error::file(path, format!("cannot be read: {error}"))
}
