//! Photographs that are in memory, or decoded whenever they are needed.

use super::Picture;
use crate::error::Result;
use std::fmt::Debug;
use std::sync::Arc;

/// Where a photograph is decoded from, for scenes that do not fit into memory. Calls may come from several
/// threads at once and must give the same pixels every time.
pub trait PictureSource: Debug + Send + Sync {
    /// Width and height in pixels.
    fn size(&self) -> (u32, u32);

    /// Decodes the picture.
    ///
    /// # Errors
    /// What cannot be read, with the name of the file.
    fn load(&self) -> Result<Picture>;
}

/// A photograph: its pixels, or where to decode them from.
#[derive(Debug, Clone)]
pub enum Photograph {
    /// In memory.
    Decoded(Picture),
    /// Decoded by every [`Photograph::load`].
    Deferred(Arc<dyn PictureSource>),
}

impl Photograph {
    /// Width and height in pixels; decodes nothing.
    pub fn size(&self) -> (u32, u32) {
        match self {
            Photograph::Decoded(picture) => (picture.width(), picture.height()),
            Photograph::Deferred(source) => source.size(),
        }
    }

    /// The picture, where it is in memory.
    pub fn decoded(&self) -> Option<&Picture> {
        match self {
            Photograph::Decoded(picture) => Some(picture),
            Photograph::Deferred(_) => None,
        }
    }

    /// The picture; one in memory is shared, not copied.
    ///
    /// # Errors
    /// A deferred picture that cannot be read.
    pub fn load(&self) -> Result<Picture> {
        match self {
            Photograph::Decoded(picture) => Ok(picture.clone()),
            Photograph::Deferred(source) => source.load(),
        }
    }
}

impl From<Picture> for Photograph {
    fn from(picture: Picture) -> Photograph {
        Photograph::Decoded(picture)
    }
}
