//! JSON files, read entry by entry: errors name the entry, its value and what was expected.

use crate::error::{Error, Result};
use crate::io::cannot_be_read;
use crate::memory::require_memory;
use glam::{DMat3, DVec3};
use serde_json::Value;
use std::path::Path;

use super::poses::{ROTATION, from_rows, rotation};

/// Memory for a byte of a file, mostly numbers in short lists.
const MEMORY_PER_BYTE: u64 = 12;
/// Characters of a value that an error shows.
const SHOWN: usize = 60;

/// Reads a whole file.
///
/// # Errors
/// A file that is no JSON; `NaN` and `Infinity` are none.
pub(super) fn read(path: &Path) -> Result<Value> {
    let bytes = std::fs::metadata(path).map_err(|error| cannot_be_read(path, error))?.len();
    require_memory(bytes.saturating_mul(MEMORY_PER_BYTE), format!("the file {}", path.display()))?;
    let content = std::fs::read(path).map_err(|error| cannot_be_read(path, error))?;
    serde_json::from_slice(&content).map_err(|error| Error::file(path, format!("is no JSON: {error}")))
}

/// A value of a file and its place in it.
#[derive(Debug, Clone)]
pub(super) struct Entry<'a> {
    path: &'a Path,
    name: String,
    value: &'a Value,
}

impl<'a> Entry<'a> {
    pub(super) fn root(path: &'a Path, value: &'a Value) -> Entry<'a> {
        Entry { path, name: String::new(), value }
    }

    /// Its place, such as `frames[3].fl_x`.
    pub(super) fn name(&self) -> &str {
        if self.name.is_empty() { "the file" } else { &self.name }
    }

    /// The error of a value that cannot be used.
    pub(super) fn error(&self, expected: impl std::fmt::Display) -> Error {
        let mut value = self.value.to_string();
        if let Some((end, _)) = value.char_indices().nth(SHOWN) {
            value.truncate(end);
            value.push_str("...");
        }
        Error::file(self.path, format!("{} is {value}; expected {expected}", self.name()))
    }

    /// An error that names the file.
    pub(super) fn file_error(&self, problem: impl std::fmt::Display) -> Error {
        Error::file(self.path, problem)
    }

    /// An entry of an object; `None` if it is missing or null.
    pub(super) fn get(&self, key: &str) -> Result<Option<Entry<'a>>> {
        let object = self.value.as_object().ok_or_else(|| self.error("an object {...}"))?;
        let value = object.get(key).filter(|value| !value.is_null());
        Ok(value.map(|value| self.child(key, value)))
    }

    /// An entry that must be there.
    pub(super) fn require(&self, key: &str) -> Result<Entry<'a>> {
        self.get(key)?.ok_or_else(|| {
            Error::file(self.path, format!("{} has no entry {key:?}; expected one", self.name()))
        })
    }

    fn child(&self, key: &str, value: &'a Value) -> Entry<'a> {
        let name = if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) };
        Entry { path: self.path, name, value }
    }

    /// The entries of an object, sorted by their keys.
    pub(super) fn fields(&self) -> Result<impl Iterator<Item = (&'a str, Entry<'a>)>> {
        let object = self.value.as_object().ok_or_else(|| self.error("an object {...}"))?;
        Ok(object.iter().map(|(key, value)| (key.as_str(), self.child(key, value))))
    }

    /// The entries of a list.
    pub(super) fn items(&self) -> Result<impl Iterator<Item = Entry<'a>>> {
        let list = self.value.as_array().ok_or_else(|| self.error("a list [...]"))?;
        Ok(list.iter().enumerate().map(|(index, value)| Entry {
            path: self.path,
            name: format!("{}[{index}]", self.name),
            value,
        }))
    }

    pub(super) fn number(&self) -> Result<f64> {
        self.value.as_f64().filter(|value| value.is_finite()).ok_or_else(|| self.error("a number"))
    }

    /// A number of pixels that is whole, though it may be written with a fraction of 0.
    pub(super) fn side(&self) -> Result<u32> {
        let value = self.number()?;
        let is_side = value.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&value);
        if is_side { Ok(value as u32) } else { Err(self.error("a whole number of pixels, 1 or more")) }
    }

    pub(super) fn text(&self) -> Result<&'a str> {
        self.value.as_str().ok_or_else(|| self.error("a text"))
    }

    pub(super) fn is_true(&self) -> bool {
        self.value.as_bool() == Some(true)
    }

    /// A list of so many numbers.
    pub(super) fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let numbers = self.items()?.map(|item| item.number()).collect::<Result<Vec<f64>>>()?;
        <[f64; N]>::try_from(numbers).map_err(|_| self.error(format!("{N} numbers")))
    }

    /// A matrix of a rotation and a translation: 3 or 4 rows of 4.
    pub(super) fn rigid(&self) -> Result<(DMat3, DVec3)> {
        let (matrix, translation) = self.affine()?;
        Ok((
            rotation(matrix).ok_or_else(|| self.error(format!("{ROTATION} in the first 3 x 3")))?,
            translation,
        ))
    }

    /// A matrix of a linear map and a translation: 3 or 4 rows of 4.
    pub(super) fn affine(&self) -> Result<(DMat3, DVec3)> {
        let rows = self.items()?.map(|row| row.numbers::<4>()).collect::<Result<Vec<[f64; 4]>>>()?;
        match rows[..] {
            [a, b, c] | [a, b, c, [0.0, 0.0, 0.0, 1.0]] => {
                let matrix = from_rows([a, b, c].map(|[x, y, z, _]| [x, y, z]));
                Ok((matrix, DVec3::new(a[3], b[3], c[3])))
            }
            _ => Err(self.error("3 rows of 4 numbers, or 4 of which the last is 0 0 0 1")),
        }
    }
}
