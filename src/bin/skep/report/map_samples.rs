//! Samples of COLMAP's maps on a coarse grid: only the rows that are needed are read, so that the pictures of
//! a large map take neither its memory nor its time.

use skep::geometry::Camera;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes in which the header of a map ends.
const LONGEST_HEADER: u64 = 64;

/// A grid of samples of an image: the pixel at the center of each of its cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleGrid {
    /// Columns of the grid.
    pub columns: u32,
    /// Rows of the grid.
    pub rows: u32,
}

impl SampleGrid {
    /// The grid of an image that is `width` wide at most; of an image that is much higher than wide it has
    /// fewer columns.
    pub fn new(camera: &Camera, width: u32) -> SampleGrid {
        let (columns, rows) = (f64::from(camera.width), f64::from(camera.height));
        // As many samples as a square picture has.
        let largest = (f64::from(width).powi(2) * 2.0 / (columns * rows)).sqrt();
        let scale = (f64::from(width) / columns).min(largest).min(1.0);
        let scaled = |side: f64| (side * scale).round().max(1.0) as u32;
        SampleGrid { columns: scaled(columns), rows: scaled(rows) }
    }

    /// Number of samples.
    pub fn len(self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// The pixel of the image in the center of a cell.
    pub fn pixel(self, camera: &Camera, (column, row): (u32, u32)) -> (u32, u32) {
        (center(column, self.columns, camera.width), center(row, self.rows, camera.height))
    }

    /// The sample of the cell that a pixel lies in.
    pub fn index(self, camera: &Camera, (x, y): (u32, u32)) -> usize {
        let cell =
            |pixel: u32, cells: u32, pixels: u32| u64::from(pixel) * u64::from(cells) / u64::from(pixels);
        let row = cell(y, self.rows, camera.height);
        (row * u64::from(self.columns) + cell(x, self.columns, camera.width)) as usize
    }
}

/// The pixel in the center of a cell.
fn center(cell: u32, cells: u32, pixels: u32) -> u32 {
    ((2 * u64::from(cell) + 1) * u64::from(pixels) / (2 * u64::from(cells))) as u32
}

/// Reads the samples of a map with so many channels, channel after channel; what is not finite becomes 0.
///
/// # Errors
/// A file that cannot be read; another size or number of channels.
pub fn read(path: &Path, channels: usize, camera: &Camera, grid: SampleGrid) -> io::Result<Vec<f32>> {
    let mut file = File::open(path)?;
    let mut start = Vec::new();
    file.by_ref().take(LONGEST_HEADER).read_to_end(&mut start)?;
    let header = format!("{}&{}&{channels}&", camera.width, camera.height);
    let bytes = header.len() as u64 + 4 * camera.pixels() as u64 * channels as u64;
    if !start.starts_with(header.as_bytes()) || file.metadata()?.len() != bytes {
        return Err(io::Error::other("not a map of this size"));
    }
    let columns: Vec<usize> =
        (0..grid.columns).map(|column| 4 * center(column, grid.columns, camera.width) as usize).collect();
    let mut row_bytes = vec![0; 4 * camera.width as usize];
    let mut samples = Vec::with_capacity(grid.len() * channels);
    for row in 0..channels as u64 * u64::from(grid.rows) {
        let (channel, row) = (row / u64::from(grid.rows), (row % u64::from(grid.rows)) as u32);
        let row = channel * u64::from(camera.height) + u64::from(center(row, grid.rows, camera.height));
        file.seek(SeekFrom::Start(header.len() as u64 + row * row_bytes.len() as u64))?;
        file.read_exact(&mut row_bytes)?;
        let sample = |&column: &usize| -> f32 {
            let bytes: [u8; 4] = row_bytes[column..column + 4].try_into().unwrap_or_default();
            Some(f32::from_le_bytes(bytes)).filter(|value| value.is_finite()).unwrap_or_default()
        };
        samples.extend(columns.iter().map(sample));
    }
    Ok(samples)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skep::geometry::Camera;

    fn camera(width: u32, height: u32) -> Camera {
        let (rotation, translation) = (glam::DMat3::IDENTITY, glam::DVec3::ZERO);
        Camera { width, height, fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0, rotation, translation }
    }

    #[test]
    fn samples_are_the_pixels_in_the_centers_of_the_cells() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.bin");
        let camera = camera(6, 4);
        let values: Vec<f32> = (0..24).map(|value| value as f32).collect();
        skep::io::write_depth_map(&path, 6, 4, &values).unwrap();
        let grid = SampleGrid { columns: 3, rows: 2 };
        assert_eq!(read(&path, 1, &camera, grid).unwrap(), [7.0, 9.0, 11.0, 19.0, 21.0, 23.0]);
        assert_eq!(grid.pixel(&camera, (1, 1)), (3, 3));
        assert_eq!((grid.index(&camera, (3, 3)), grid.index(&camera, (5, 0))), (4, 2));
        let whole = SampleGrid::new(&camera, 640);
        assert_eq!(read(&path, 1, &camera, whole).unwrap(), values);
        assert!(read(&path, 3, &camera, grid).is_err(), "another number of channels");
    }

    #[test]
    fn grids_keep_the_shape_of_the_image_and_bound_the_samples() {
        assert_eq!(SampleGrid::new(&camera(4000, 3000), 240), SampleGrid { columns: 240, rows: 180 });
        assert_eq!(SampleGrid::new(&camera(100, 50), 240), SampleGrid { columns: 100, rows: 50 });
        let slim = SampleGrid::new(&camera(10, 30_000), 240);
        assert!(slim.len() < 240 * 500 && slim.columns >= 1, "{slim:?}");
    }
}
