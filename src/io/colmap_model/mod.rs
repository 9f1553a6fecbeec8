//! COLMAP's sparse models: cameras, poses and points, in its text and its binary layout.

mod binary;
mod camera_models;
mod records;
mod text;

use crate::error::{Error, Result};
use crate::geometry::{Camera, Distortion};
use crate::memory::require_memory;
use crate::scene::SparsePoint;
use records::{Files, Records};
use std::path::Path;

/// An image of a model: its name, calibration and pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelImage {
    /// The image's path below the folder of images, parts separated by `/`.
    pub name: String,
    /// Calibration and pose, in the crate's convention (COLMAP's pixel centers lie half a pixel further).
    pub camera: Camera,
}

/// A sparse model without distortion.
///
/// # Examples
/// ```no_run
/// let model = skep::io::ColmapModel::read("SCENE/sparse".as_ref())?;
/// for image in &model.images {
///     println!("{} was taken at {}", image.name, image.camera.center());
/// }
/// # Ok::<(), skep::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ColmapModel {
    /// The images in the order of the file; consistency graphs and `fused.ply.vis` index this list.
    pub images: Vec<ModelImage>,
    /// The points, with the indices of the images that saw them in ascending order. Colors, errors and
    /// features are not kept.
    pub points: Vec<SparsePoint>,
}

/// Bytes that a model takes in memory for each byte of its files, at most: the binary records of points with
/// short tracks.
const MEMORY_PER_BYTE: u64 = 3;

impl ColmapModel {
    /// Whether the folder holds the files of a model, binary or text.
    pub fn is_in(folder: &Path) -> bool {
        Files::find(folder).is_some()
    }

    /// Reads `cameras`, `images` and, if it exists, `points3D` from a folder: the `.bin` files, else the
    /// `.txt` files, in COLMAP's order of precedence. Without a file of points the model has none.
    ///
    /// # Errors
    /// No model in the folder; a camera model with distortion; ids or names that occur twice; ids that do not
    /// exist; names that lead outside the folder of images; sizes of 0 and numbers that are not finite; a
    /// zero quaternion; truncated files and files with trailing bytes; a model without images.
    pub fn read(folder: &Path) -> Result<ColmapModel> {
        let (files, records) = read_records(folder)?;
        records.require_pinhole(&files)?;
        Ok(records.resolve(&files)?.0)
    }

    /// Like [`ColmapModel::read`], for any lens: gives the distortion of each image beside the model, in
    /// which the cameras are those without their lenses.
    ///
    /// # Errors
    /// The errors of [`ColmapModel::read`], but for the distortion.
    pub fn read_with_lenses(folder: &Path) -> Result<(ColmapModel, Vec<Option<Distortion>>)> {
        let (files, records) = read_records(folder)?;
        records.resolve(&files)
    }
    /// Writes `cameras.txt`, `images.txt` and `points3D.txt`. Points get the projections of their positions
    /// as features, gray as color and 0 as error.
    ///
    /// # Panics
    /// A point names an image that does not exist.
    pub fn write_text(&self, folder: &Path) -> Result<()> {
        text::write(self, folder)
    }

    /// Writes `cameras.bin`, `images.bin` and `points3D.bin` with the same content as
    /// [`ColmapModel::write_text`].
    pub fn write_binary(&self, folder: &Path) -> Result<()> {
        binary::write(self, folder)
    }
}

/// Reads the files of a model.
fn read_records(folder: &Path) -> Result<(Files, Records)> {
    let Some(files) = Files::find(folder) else {
        let wanted = "neither cameras.bin and images.bin nor cameras.txt and images.txt are in this folder";
        return Err(Error::file(folder, format!("no COLMAP model: {wanted}")));
    };
    require_memory(
        files.bytes().saturating_mul(MEMORY_PER_BYTE),
        format!("the model in {}", folder.display()),
    )?;
    let records = if files.binary { binary::read(&files)? } else { text::read(&files)? };
    Ok((files, records))
}
