//! Text files of words between white space.

use crate::error::{Error, Result};
use crate::io::cannot_be_read;
use crate::memory::require_memory;
use std::path::Path;
use std::str::FromStr;

/// Memory for a byte of a file of short words: the word, its line and its text.
const MEMORY_PER_BYTE: u64 = 16;

/// A whole text file.
pub(super) fn read(path: &Path) -> Result<String> {
    let bytes = std::fs::metadata(path).map_err(|error| cannot_be_read(path, error))?.len();
    require_memory(bytes.saturating_mul(MEMORY_PER_BYTE), format!("the file {}", path.display()))?;
    std::fs::read_to_string(path).map_err(|error| cannot_be_read(path, error))
}

/// The words of a text, read one after another.
pub(super) struct Words<'a> {
    path: &'a Path,
    /// With their lines, counted from 1.
    words: Vec<(usize, &'a str)>,
    next: usize,
}

impl<'a> Words<'a> {
    pub(super) fn new(path: &'a Path, text: &'a str) -> Words<'a> {
        let words = text
            .lines()
            .enumerate()
            .flat_map(|(index, line)| line.split_whitespace().map(move |word| (index + 1, word)))
            .collect();
        Words { path, words, next: 0 }
    }

    /// An error that names the file and the line of the word that was read last.
    pub(super) fn error(&self, problem: impl std::fmt::Display) -> Error {
        let line = self.words.get(self.next.saturating_sub(1)).map_or(1, |&(line, _)| line);
        Error::line(self.path, line, problem)
    }

    /// The words not read yet.
    pub(super) fn remaining(&self) -> usize {
        self.words.len() - self.next
    }

    pub(super) fn word(&mut self, what: &str) -> Result<&'a str> {
        let Some(&(_, word)) = self.words.get(self.next) else {
            return Err(self.error(format!("the file ends here; expected {what}")));
        };
        self.next += 1;
        Ok(word)
    }

    /// Reads a word that must be this one.
    pub(super) fn keyword(&mut self, keyword: &str) -> Result<()> {
        match self.word(keyword)? {
            word if word.eq_ignore_ascii_case(keyword) => Ok(()),
            word => Err(self.error(format!("found {word:?}; expected the word {keyword}"))),
        }
    }

    fn parse<T: FromStr>(&mut self, what: &str, kind: &str) -> Result<T> {
        let word = self.word(what)?;
        word.parse().map_err(|_| self.error(format!("{what} is {word:?}; expected {kind}")))
    }

    pub(super) fn count(&mut self, what: &str) -> Result<usize> {
        self.parse(what, "a whole number of 0 or more")
    }

    /// A finite number.
    pub(super) fn number(&mut self, what: &str) -> Result<f64> {
        let value: f64 = self.parse(what, "a number")?;
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.error(format!("{what} is {value}; expected a finite number")))
    }

    pub(super) fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.number(what)?;
        }
        Ok(values)
    }
}
