//! Photographs in files, decoded when they are needed and compared with their fingerprint each time.

use crate::error::{Error, Result};
use crate::image::{Picture, PictureSource};
use crate::io::{Fingerprint, fingerprint};
use crate::io::{cannot_be_read, picture_from_bytes};
use std::path::PathBuf;

/// A photograph in a file.
#[derive(Debug)]
pub(super) struct FilePhotograph {
    pub path: PathBuf,
    pub size: (u32, u32),
    /// Of the file's content when the run was planned.
    pub fingerprint: Fingerprint,
}

impl PictureSource for FilePhotograph {
    fn size(&self) -> (u32, u32) {
        self.size
    }

    fn load(&self) -> Result<Picture> {
        let bytes = std::fs::read(&self.path).map_err(|error| cannot_be_read(&self.path, error))?;
        if fingerprint(&bytes) != self.fingerprint {
            let problem = "the photograph changed since the run began; run `skep reconstruct` or `skep plan` \
                           again to begin anew with it";
            return Err(Error::file(&self.path, problem));
        }
        let picture = picture_from_bytes(&bytes, &self.path)?;
        match (picture.width(), picture.height()) == self.size {
            true => Ok(picture),
            false => Err(Error::file(&self.path, "not of its camera's size")),
        }
    }
}
