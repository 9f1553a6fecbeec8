//! Fingerprints of contents: what changed by accident has another one. They do not protect against intent.

use super::files::cannot_be_read;
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

/// Length and XXH3 (64 bits) of a content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Fingerprint {
    pub bytes: u64,
    pub xxh3: String,
}

/// The fingerprint of some bytes.
pub(crate) fn fingerprint(bytes: &[u8]) -> Fingerprint {
    Fingerprint { bytes: bytes.len() as u64, xxh3: text(xxh3_64(bytes)) }
}

/// The fingerprint of a file's content.
///
/// # Errors
/// A file that cannot be read.
pub(crate) fn fingerprint_file(path: &Path) -> Result<Fingerprint> {
    let error = |error| cannot_be_read(path, error);
    let mut file = File::open(path).map_err(error)?;
    let (mut hash, mut bytes, mut buffer) = (Xxh3::new(), 0, vec![0; 1 << 16]);
    loop {
        let read = file.read(&mut buffer).map_err(error)?;
        if read == 0 {
            return Ok(Fingerprint { bytes, xxh3: text(hash.digest()) });
        }
        bytes += read as u64;
        hash.update(&buffer[..read]);
    }
}

/// Sixteen hexadecimal digits.
pub(crate) fn text(hash: u64) -> String {
    format!("{hash:016x}")
}
