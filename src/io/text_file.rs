//! Text files that people write or that arguments name.

use super::cannot_be_read;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes of a file, at most: a report of ten thousand views has less.
const MOST_BYTES: u64 = 256 << 20;

/// Reads a text file of at most 256 MiB.
///
/// # Errors
/// A file that cannot be read, is larger, or is not UTF-8.
pub fn read_text(file: &Path) -> Result<String> {
    let mut text = String::new();
    let read = File::open(file).and_then(|opened| opened.take(MOST_BYTES).read_to_string(&mut text));
    match read {
        Ok(bytes) if bytes as u64 == MOST_BYTES => {
            Err(Error::file(file, "cannot be read: larger than any file of this kind"))
        }
        Ok(_) => Ok(text),
        Err(error) => Err(cannot_be_read(file, error)),
    }
}

#[cfg(target_os = "linux")]
#[cfg(test)]
mod tests {
    #[test]
    fn a_file_without_end_is_refused() {
        let error = super::read_text("/dev/zero".as_ref()).unwrap_err().to_string();
        assert!(error.contains("/dev/zero") && error.contains("larger"), "{error}");
    }
}
