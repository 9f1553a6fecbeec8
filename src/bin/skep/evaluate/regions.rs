//! Which points count: alignment, boxes and polygons.

use super::arguments::RegionArguments;
use glam::{DMat4, DVec3};
use serde::Deserialize;
use skep::{Error, Result};
use std::path::Path;

/// What the arguments say about places, except for DTU's masks.
pub struct Region {
    transform: Option<DMat4>,
    corners: Option<(DVec3, DVec3)>,
    volume: Option<Volume>,
}

/// A prism above a polygon, in the layout of Open3D's selections.
#[derive(Deserialize)]
struct Volume {
    orthogonal_axis: String,
    axis_min: f64,
    axis_max: f64,
    bounding_polygon: Vec<[f64; 3]>,
}

impl Region {
    /// Reads the files that the arguments name.
    ///
    /// # Errors
    /// A box without volume; a file that is missing or holds something else.
    pub fn read(arguments: &RegionArguments) -> Result<Region> {
        Ok(Region {
            transform: arguments.transform.as_deref().map(read_matrix).transpose()?,
            corners: arguments.crop_box.as_deref().map(corners).transpose()?,
            volume: arguments.crop.as_deref().map(read_volume).transpose()?,
        })
    }

    /// Moves the points of the cloud into the frame of the truth.
    pub fn align(&self, points: &mut [[f64; 3]]) {
        let Some(transform) = self.transform else { return };
        points.iter_mut().for_each(|point| *point = transform.transform_point3((*point).into()).into());
    }

    /// Leaves out the points that do not count.
    pub fn crop(&self, points: &mut Vec<[f64; 3]>) {
        points.retain(|&point| {
            let place = DVec3::from(point);
            let in_box =
                self.corners.is_none_or(|(min, max)| place.cmpge(min).all() && place.cmple(max).all());
            in_box && self.volume.as_ref().is_none_or(|volume| volume.contains(point))
        });
    }
}

fn corners(numbers: &[f64]) -> Result<(DVec3, DVec3)> {
    let (min, max) = (DVec3::from_slice(numbers), DVec3::from_slice(&numbers[3..]));
    if !(min.is_finite() && max.is_finite() && min.cmplt(max).all()) {
        let value = numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        return Err(Error::argument("--crop-box", value, "finite corners, the first below the second"));
    }
    Ok((min, max))
}

/// A matrix of four rows; lines that begin with `#` do not count.
fn read_matrix(path: &Path) -> Result<DMat4> {
    let text = skep::io::read_text(path)?;
    let words =
        text.lines().filter(|line| !line.trim_start().starts_with('#')).flat_map(str::split_whitespace);
    let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
    let numbers = numbers.and_then(|numbers| <[f64; 16]>::try_from(numbers).ok());
    let is_affine = |numbers: &[f64; 16]| {
        numbers.iter().all(|number| number.is_finite()) && numbers[12..] == [0.0, 0.0, 0.0, 1.0]
    };
    match numbers.filter(is_affine) {
        Some(rows) => Ok(DMat4::from_cols_array(&rows).transpose()),
        None => Err(Error::file(path, "expected the 16 numbers of a 4x4 matrix whose last row is 0 0 0 1")),
    }
}

fn read_volume(path: &Path) -> Result<Volume> {
    let volume: Volume = serde_json::from_str(&skep::io::read_text(path)?)
        .map_err(|error| Error::file(path, format!("{error}; expected a selection volume of Open3D")))?;
    if !["X", "Y", "Z"].contains(&volume.orthogonal_axis.as_str()) {
        let problem = format!("orthogonal_axis is {:?}; expected X, Y or Z", volume.orthogonal_axis);
        return Err(Error::file(path, problem));
    }
    if volume.bounding_polygon.len() < 3 {
        let corners = volume.bounding_polygon.len();
        return Err(Error::file(path, format!("bounding_polygon has {corners} corners; expected 3 or more")));
    }
    Ok(volume)
}

impl Volume {
    fn contains(&self, point: [f64; 3]) -> bool {
        let (u, v, along) = match self.orthogonal_axis.as_str() {
            "X" => (1, 2, 0),
            "Y" => (0, 2, 1),
            _ => (0, 1, 2),
        };
        let in_range = point[along] >= self.axis_min && point[along] <= self.axis_max;
        // Inside: a ray along u crosses the polygon an odd number of times.
        let corners = &self.bounding_polygon;
        let edges = corners.iter().zip(corners.iter().cycle().skip(1));
        let crossed = edges.filter(|(a, b)| {
            let is_beside = (a[v] > point[v]) != (b[v] > point[v]);
            is_beside && point[u] < a[u] + (point[v] - a[v]) / (b[v] - a[v]) * (b[u] - a[u])
        });
        in_range && crossed.count() % 2 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prism_holds_the_points_above_its_polygon() {
        let corners = vec![[0.0, 9.0, 0.0], [2.0, 9.0, 0.0], [2.0, 9.0, 2.0], [0.0, 9.0, 2.0]];
        let volume = Volume {
            orthogonal_axis: "Y".to_owned(),
            axis_min: -1.0,
            axis_max: 1.0,
            bounding_polygon: corners,
        };
        assert!(volume.contains([1.0, 0.0, 1.0]));
        assert!(!volume.contains([1.0, 1.5, 1.0]) && !volume.contains([3.0, 0.0, 1.0]));
        assert!(!volume.contains([1.0, 0.0, -0.1]));
    }

    #[test]
    fn a_matrix_is_read_by_rows() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matrix.txt");
        std::fs::write(&path, "# moved\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n").unwrap();
        let moved = read_matrix(&path).unwrap().transform_point3(DVec3::ZERO);
        assert_eq!(moved, DVec3::new(5.0, 6.0, 7.0));
        std::fs::write(&path, "1 0 0 5\n0 1 0 6\n0 0 1 7\n").unwrap();
        assert!(read_matrix(&path).unwrap_err().to_string().contains("16 numbers"));
    }
}
