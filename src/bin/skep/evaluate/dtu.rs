//! Observation masks and ground planes of the DTU data set, in MATLAB files of version 5.

use super::matlab::{self, Array};
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
    let arrays = matlab::read(path)?;
    let (mask, corners) = (array(path, &arrays, "ObsMask")?, array(path, &arrays, "BB")?);
    let resolution = &array(path, &arrays, "Res")?.values;
    let wrong = |found: &Array, expected: &str| {
        let Array { name, size, .. } = found;
        Err(Error::file(path, format!("{name} is an array of {size:?}; expected {expected}")))
    };
    let Ok(size) = <[usize; 3]>::try_from(mask.size.clone()) else {
        return wrong(mask, "three dimensions of voxels");
    };
    let corner = &corners.values;
    if corners.size != [2, 3] || !corner.iter().all(|number| number.is_finite()) {
        return wrong(corners, "2 x 3 finite numbers");
    }
    let resolution = match resolution[..] {
        [resolution] if resolution.is_finite() && resolution > 0.0 => resolution,
        _ => return Err(Error::file(path, format!("Res is {resolution:?}; expected a number above 0"))),
    };
    Ok(Mask {
        is_observed: mask.values.iter().map(|value| *value != 0.0).collect(),
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
    let arrays = matlab::read(path)?;
    let Array { size, values, .. } = array(path, &arrays, "P")?;
    match values[..] {
        [a, b, c, d] if values.iter().all(|number| number.is_finite()) => Ok([a, b, c, d]),
        _ => Err(Error::file(path, format!("P is an array of {size:?}; expected 4 finite numbers"))),
    }
}

/// Whether a point lies above the plane.
pub fn is_above(plane: &[f64; 4], point: &[f64; 3]) -> bool {
    plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] + plane[3] > 0.0
}

fn array<'a>(path: &Path, arrays: &'a [Array], name: &str) -> Result<&'a Array> {
    arrays.iter().find(|array| array.name == name).ok_or_else(|| {
        let names: Vec<&str> = arrays.iter().map(|array| array.name.as_str()).collect();
        Error::file(path, format!("no array of numbers {name}; it has: {}", names.join(", ")))
    })
}
