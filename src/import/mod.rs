//! Scenes as people bring them: from several programs, with lenses that distort, and larger than wanted.
//!
//! A [`SourceScene`] is what a file of such a program says. `prepare.rs` makes a COLMAP workspace of it,
//! whose photographs have neither distortion nor more pixels than wanted; everything else reads only that.
//!
//! | step | file |
//! |---|---|
//! | find out what a path is, and read it | `formats.rs`, one file for each format |
//! | choose the photographs | `selection.rs`, `source_lists.rs`, `depth_ranges.rs` |
//! | undistort, reduce and mask a photograph | `photograph.rs` |
//! | write the workspace, once | `prepare.rs` |
//! | or take all into memory | `memory.rs` |

mod changes;
mod chosen;
mod depth_ranges;
mod formats;
mod memory;
mod photograph;
mod prepare;
mod record;
mod selection;
mod source_lists;

use crate::geometry::{DepthRange, Lens};
use crate::io::SceneFolder;
use crate::scene::SparsePoint;
pub use formats::read;
pub use memory::read_scene;
pub(crate) use prepare::{Extra, Prepared, prepare};
use std::path::PathBuf;

/// A calibrated scene of any program.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceScene {
    /// What it was read from, in words, such as `the COLMAP model in SCENE/sparse`.
    pub origin: String,
    /// The photographs in the order of their file.
    pub photographs: Vec<SourcePhotograph>,
    /// Points on the surfaces, with the indices of the photographs that saw them, where the file says that.
    pub points: Vec<SparsePoint>,
    /// Photographs and model, where they are those of a COLMAP workspace.
    pub workspace: Option<SceneFolder>,
    /// What was left out or guessed, as sentences.
    pub warnings: Vec<String>,
}

/// A photograph of a [`SourceScene`].
#[derive(Debug, Clone, PartialEq)]
pub struct SourcePhotograph {
    /// Its name in the results: a path below the folder of images with `/` between its parts, unique.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// Calibration, lens and pose. The size is that of the file's pixels.
    pub lens: Lens,
    /// An image of the same size that is 0 where nothing is to be estimated.
    pub mask: Option<PathBuf>,
    /// The depths of its surfaces, where the file says so.
    pub depth_range: Option<DepthRange>,
    /// The photographs to match it with, as indices, the best first, where the file says so.
    pub sources: Option<Vec<u32>>,
    /// Whether it gets maps; others are only source views.
    pub is_reference: bool,
}

impl SourcePhotograph {
    /// A photograph of which nothing else is known.
    pub fn new(name: String, path: PathBuf, lens: Lens) -> SourcePhotograph {
        SourcePhotograph {
            name,
            path,
            lens,
            mask: None,
            depth_range: None,
            sources: None,
            is_reference: true,
        }
    }
}
