//! What was imported into a folder, so that it is not done again.

use crate::error::Result;
use crate::io::Fingerprint;
use crate::io::write_file;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The imported photographs by name.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Record {
    /// The program that made them.
    version: String,
    photographs: BTreeMap<String, Entry>,
}

/// An imported photograph.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// Of everything that it depends on.
    pub made_from: Fingerprint,
    pub image: Fingerprint,
    pub mask: Option<Fingerprint>,
}

/// Another version may change photographs in another way.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("SKEP_SOURCE_FINGERPRINT"));

impl Record {
    pub(super) fn new(photographs: impl Iterator<Item = (String, Entry)>) -> Record {
        Record { version: VERSION.to_owned(), photographs: photographs.collect() }
    }

    /// The record in a folder; empty where there is none of this version.
    pub(super) fn read(folder: &Path) -> Record {
        let read = std::fs::read(path(folder)).ok();
        let record: Option<Record> = read.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        record.filter(|record| record.version == VERSION).unwrap_or_default()
    }

    pub(super) fn get(&self, name: &str) -> Option<&Entry> {
        self.photographs.get(name)
    }

    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        write_file(&path(folder), |out| Ok(serde_json::to_writer_pretty(out, self)?))
    }
}

fn path(folder: &Path) -> PathBuf {
    folder.join("run").join("import.json")
}
