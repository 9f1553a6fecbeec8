//! Observation masks and ground planes of the DTU data set, in MATLAB files of version 5.

use matfile::{Array, MatFile, NumericData};
use skep::{Error, Result};
use std::path::Path;

/// Distances beyond this do not count, in millimeters.
pub const MAX_DISTANCE: f64 = 20.0;
/// Spacing that the cloud is thinned to, in millimeters.
pub const SPACING: f64 = 0.2;

/// The part of space that was observed, in voxels.
pub struct Mask {
    is_observed: Vec<bool>,
    size: [usize; 3],
    /// Center of the first voxel.
    origin: [f64; 3],
    /// Side of a voxel.
    resolution: f64,
}

/// Reads `ObsMask` (voxels), `BB` (two corners) and `Res` (side of a voxel).
///
/// # Errors
/// A file that is missing, damaged, of version 7.3, or lacks one of them.
pub fn read_mask(path: &Path) -> Result<Mask> {
    let file = open(path)?;
    let (mask, corners, resolution) = (array(path, &file, "ObsMask")?, array(path, &file, "BB")?, "Res");
    let resolution = numbers(array(path, &file, resolution)?);
    let wrong = |name: &str, found: &Array, expected: &str| {
        Err(Error::file(path, format!("{name} is an array of {:?}; expected {expected}", found.size())))
    };
    let values = numbers(mask);
    let Ok(size) = <[usize; 3]>::try_from(mask.size().clone()) else {
        return wrong("ObsMask", mask, "three dimensions of voxels");
    };
    if Some(values.len()) != size.iter().try_fold(1usize, |product, side| product.checked_mul(*side)) {
        return wrong("ObsMask", mask, "as many values as its size says");
    }
    let corner = numbers(corners);
    if corners.size() != &[2, 3] || !corner.iter().all(|number| number.is_finite()) {
        return wrong("BB", corners, "2 x 3 finite numbers");
    }
    let resolution = match resolution[..] {
        [resolution] if resolution.is_finite() && resolution > 0.0 => resolution,
        _ => return Err(Error::file(path, format!("Res is {resolution:?}; expected a number above 0"))),
    };
    Ok(Mask {
        is_observed: values.iter().map(|value| *value != 0.0).collect(),
        size,
        // MATLAB stores columns one after the other.
        origin: [corner[0], corner[2], corner[4]],
        resolution,
    })
}

impl Mask {
    /// Whether a point lies in a voxel that was observed.
    pub fn contains(&self, point: &[f64; 3]) -> bool {
        let mut index = 0;
        for axis in (0..3).rev() {
            let place = ((point[axis] - self.origin[axis]) / self.resolution).round();
            if !(place >= 0.0 && place < self.size[axis] as f64) {
                return false;
            }
            index = index * self.size[axis] + place as usize;
        }
        self.is_observed[index]
    }
}

/// Reads `P`, the plane `P . (x, y, z, 1) = 0` of the table.
///
/// # Errors
/// A file that is missing, damaged, of version 7.3, or lacks it.
pub fn read_plane(path: &Path) -> Result<[f64; 4]> {
    let file = open(path)?;
    let found = array(path, &file, "P")?;
    match <[f64; 4]>::try_from(numbers(found)) {
        Ok(plane) if plane.iter().all(|number| number.is_finite()) => Ok(plane),
        _ => {
            Err(Error::file(path, format!("P is an array of {:?}; expected 4 finite numbers", found.size())))
        }
    }
}

/// Whether a point lies above the plane.
pub fn is_above(plane: &[f64; 4], point: &[f64; 3]) -> bool {
    plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] + plane[3] > 0.0
}

fn open(path: &Path) -> Result<MatFile> {
    let bytes = std::fs::read(path).map_err(|error| Error::file(path, format!("cannot be read: {error}")))?;
    if bytes.starts_with(b"MATLAB 7.3") {
        let problem = "a MATLAB file of version 7.3; expected version 5 (in MATLAB: save -v7)";
        return Err(Error::file(path, problem));
    }
    MatFile::parse(bytes.as_slice())
        .map_err(|error| Error::file(path, format!("expected a MATLAB file of version 5: {error}")))
}

fn array<'a>(path: &Path, file: &'a MatFile, name: &str) -> Result<&'a Array> {
    file.find_by_name(name).ok_or_else(|| {
        let names: Vec<&str> = file.arrays().iter().map(Array::name).collect();
        Error::file(path, format!("no array of numbers {name}; it has: {}", names.join(", ")))
    })
}

/// The values of an array, column after column.
fn numbers(array: &Array) -> Vec<f64> {
    match array.data() {
        NumericData::Int8 { real, .. } => real.iter().map(|value| f64::from(*value)).collect(),
        NumericData::UInt8 { real, .. } => real.iter().map(|value| f64::from(*value)).collect(),
        NumericData::Int16 { real, .. } => real.iter().map(|value| f64::from(*value)).collect(),
        NumericData::UInt16 { real, .. } => real.iter().map(|value| f64::from(*value)).collect(),
        NumericData::Int32 { real, .. } => real.iter().map(|value| f64::from(*value)).collect(),
        NumericData::UInt32 { real, .. } => real.iter().map(|value| f64::from(*value)).collect(),
        NumericData::Int64 { real, .. } => real.iter().map(|value| *value as f64).collect(),
        NumericData::UInt64 { real, .. } => real.iter().map(|value| *value as f64).collect(),
        NumericData::Single { real, .. } => real.iter().map(|value| f64::from(*value)).collect(),
        NumericData::Double { real, .. } => real.clone(),
    }
}
