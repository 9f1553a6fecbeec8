//! The error type: what was wrong, and what was expected.

use crate::memory::format_bytes;
use std::fmt;
use std::path::PathBuf;

/// The error of every fallible call of the crate.
///
/// # Examples
/// ```
/// let error = skep::Options::default().set("check.depth_tolerance", "2").unwrap_err();
/// assert!(matches!(&error, skep::Error::Argument { value, .. } if value == "2"));
/// assert!(error.to_string().contains("check.depth_tolerance is 2; expected"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// An argument is wrong.
    Argument {
        /// The argument, for example `views[3].camera.fx`.
        name: String,
        /// Its value.
        value: String,
        /// What was expected instead.
        expected: String,
    },
    /// A file cannot be read, parsed or written.
    File {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, when the file is text.
        line: Option<usize>,
        /// What is wrong and what was expected.
        problem: String,
    },
    /// There is not enough memory for a call.
    Memory {
        /// What it needs, in bytes.
        bytes: u64,
        /// What needs it.
        purpose: String,
    },
    /// The progress function returned `Break`.
    Cancelled,
}

/// `Result` with the crate's error.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An argument is wrong; `expected` describes the valid values.
    pub fn argument(name: impl Into<String>, value: impl fmt::Display, expected: impl Into<String>) -> Self {
        Error::Argument { name: name.into(), value: value.to_string(), expected: expected.into() }
    }

    /// A file cannot be used.
    pub fn file(path: impl Into<PathBuf>, problem: impl fmt::Display) -> Self {
        Error::File { path: path.into(), line: None, problem: problem.to_string() }
    }

    /// A line of a text file cannot be used; lines count from 1.
    pub fn line(path: impl Into<PathBuf>, line: usize, problem: impl fmt::Display) -> Self {
        Error::File { path: path.into(), line: Some(line), problem: problem.to_string() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Argument { name, value, expected } => write!(f, "{name} is {value}; expected {expected}"),
            Error::File { path, line: Some(line), problem } => {
                write!(f, "{}, line {line}: {problem}", path.display())
            }
            Error::File { path, line: None, problem } => write!(f, "{}: {problem}", path.display()),
            Error::Memory { bytes, purpose } => {
                write!(f, "not enough memory: {purpose} needs {}", format_bytes(*bytes))
            }
            Error::Cancelled => write!(f, "cancelled"),
        }
    }
}

impl std::error::Error for Error {}
