//! COLMAP's dense maps: `W&H&C&` and planar little-endian f32, and consistency graphs.

use super::files::{FileReader, write_file};
use crate::error::{Error, Result};
use crate::fusion::PointViews;
use crate::memory::require_memory;
use std::io::{self, Write};
use std::path::Path;

/// One value for each pixel, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<T> {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` values.
    pub values: Vec<T>,
}

/// Writes a depth map: depths in world units, 0 where there is none.
///
/// # Examples
/// ```
/// use skep::io::{read_depth_map, write_depth_map};
///
/// let folder = tempfile::tempdir().unwrap();
/// let path = folder.path().join("a.jpg.geometric.bin");
/// write_depth_map(&path, 3, 2, &[1.0, 1.5, 0.0, 1.0, 1.5, 2.0])?;
/// assert_eq!(read_depth_map(&path)?.values[1], 1.5);
/// // A map that does not fit its size is refused, and nothing is written.
/// let error = write_depth_map(&path, 3, 2, &[1.0]).unwrap_err();
/// assert_eq!(error.to_string(), "depth map is 1 values; expected one for each of 3 x 2 pixels");
/// # Ok::<(), skep::Error>(())
/// ```
pub fn write_depth_map(path: &Path, width: u32, height: u32, depth: &[f32]) -> Result<()> {
    check_length("depth map", width, height, depth.len())?;
    write_map(path, width, height, 1, |_, pixel| depth[pixel])
}

/// Writes a normal map: unit normals in the camera frame, zeros where there is none.
pub fn write_normal_map(path: &Path, width: u32, height: u32, normal: &[[f32; 3]]) -> Result<()> {
    check_length("normal map", width, height, normal.len())?;
    write_map(path, width, height, 3, |channel, pixel| normal[pixel][channel])
}

fn write_map(
    path: &Path,
    width: u32,
    height: u32,
    channels: usize,
    value: impl Fn(usize, usize) -> f32,
) -> Result<()> {
    write_file(path, |out| {
        write!(out, "{width}&{height}&{channels}&")?;
        for channel in 0..channels {
            for pixel in 0..width as usize * height as usize {
                out.write_all(&value(channel, pixel).to_le_bytes())?;
            }
        }
        Ok(())
    })
}

/// Reads a depth map.
///
/// # Errors
/// A number of channels other than 1; a size that does not match the header; a depth that is negative or not
/// finite, which neither COLMAP nor this crate writes.
pub fn read_depth_map(path: &Path) -> Result<Grid<f32>> {
    let (mut file, width, height) = open_map(path, 1)?;
    let mut values = vec![0.0; width as usize * height as usize];
    for (pixel, value) in values.iter_mut().enumerate() {
        *value = f32::from_le_bytes(file.bytes("depths")?);
        if !(value.is_finite() && *value >= 0.0) {
            let (column, row) = (pixel % width as usize, pixel / width as usize);
            let problem = format!("the depth at column {column}, row {row} is {value}; expected 0 or above");
            return Err(file.error(problem));
        }
    }
    file.finish()?;
    Ok(Grid { width, height, values })
}

/// Reads a normal map.
///
/// # Errors
/// A number of channels other than 3; a size that does not match the header; a normal that is not finite.
pub fn read_normal_map(path: &Path) -> Result<Grid<[f32; 3]>> {
    let (mut file, width, height) = open_map(path, 3)?;
    let mut values = vec![[0.0; 3]; width as usize * height as usize];
    for channel in 0..3 {
        for (pixel, value) in values.iter_mut().enumerate() {
            let component = f32::from_le_bytes(file.bytes("normals")?);
            if !component.is_finite() {
                let (column, row) = (pixel % width as usize, pixel / width as usize);
                let place = format!("the normal at column {column}, row {row}");
                return Err(
                    file.error(format!("{place} has the component {component}; expected a finite one"))
                );
            }
            value[channel] = component;
        }
    }
    file.finish()?;
    Ok(Grid { width, height, values })
}

/// Width and height of a map with so many channels, from its header and the size of the file.
pub(crate) fn map_size(path: &Path, channels: u32) -> Result<(u32, u32)> {
    open_sized(path, channels).map(|(_, width, height)| (width, height))
}

/// Opens a map whose values are about to be read.
fn open_map(path: &Path, channels: u32) -> Result<(FileReader, u32, u32)> {
    let opened = open_sized(path, channels)?;
    require_memory(opened.0.remaining(), format!("the map {}", path.display()))?;
    Ok(opened)
}

/// Opens a map and checks its size against the header.
fn open_sized(path: &Path, channels: u32) -> Result<(FileReader, u32, u32)> {
    let (file, width, height) = open_header(path, channels)?;
    // The product of three 32-bit numbers and 4 fits into 128 bits.
    let expected = u128::from(width) * u128::from(height) * u128::from(channels) * 4;
    if expected != u128::from(file.remaining()) {
        return Err(file.error(format!(
            "{} bytes follow the header {width}&{height}&{channels}&; expected {width} x {height} x \
             {channels} x 4",
            file.remaining()
        )));
    }
    Ok((file, width, height))
}

/// Reads `W&H&C&` and checks the number of channels.
fn open_header(path: &Path, channels: u32) -> Result<(FileReader, u32, u32)> {
    let mut file = FileReader::open(path)?;
    let mut numbers = [0u32; 3];
    for number in &mut numbers {
        let mut digits = String::new();
        loop {
            match file.bytes("the header W&H&C&")? {
                [b'&'] if !digits.is_empty() => break,
                [digit @ b'0'..=b'9'] if digits.len() < 10 => digits.push(char::from(digit)),
                _ => return Err(file.error("does not start with a header like 640&480&1&")),
            }
        }
        *number = digits.parse().map_err(|_| file.error(format!("{digits} in the header is too large")))?;
    }
    let [width, height, found] = numbers;
    if width == 0 || height == 0 || found != channels {
        let expected = format!("a width and height of at least 1 and {channels} channel(s)");
        return Err(file.error(format!("the header is {width}&{height}&{found}&; expected {expected}")));
    }
    Ok((file, width, height))
}

/// The source views of the pixels that have an estimate.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConsistencyGraph {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Column and row of each listed pixel.
    pub pixels: Vec<[u32; 2]>,
    /// The views of each listed pixel, as indices into the images in the order of the model's file.
    pub views: PointViews,
}

/// Writes a consistency graph; `views_of` gives a pixel's views by its index (row * width + column), as
/// indices into the images in the order of the model's file. A pixel without views is not listed.
pub fn write_consistency_graph<Views: Iterator<Item = u32>>(
    path: &Path,
    width: u32,
    height: u32,
    views_of: impl Fn(usize) -> Views,
) -> Result<()> {
    write_file(path, |out| {
        write!(out, "{width}&{height}&1&")?;
        let mut views = Vec::new();
        for row in 0..height {
            for column in 0..width {
                views.clear();
                views.extend(views_of(row as usize * width as usize + column as usize));
                if !views.is_empty() {
                    write_u32s(out, &[column, row, views.len() as u32])?;
                    write_u32s(out, &views)?;
                }
            }
        }
        Ok(())
    })
}

fn write_u32s(out: &mut impl Write, numbers: &[u32]) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

/// Reads a consistency graph.
///
/// # Errors
/// A file that ends within an entry; a pixel outside the image; a negative number.
pub fn read_consistency_graph(path: &Path) -> Result<ConsistencyGraph> {
    let (mut file, width, height) = open_header(path, 1)?;
    let mut graph = ConsistencyGraph { width, height, pixels: Vec::new(), views: PointViews::default() };
    let mut views = Vec::new();
    while file.remaining() > 0 {
        let (column, row) = (file.u32("a pixel's column")?, file.u32("a pixel's row")?);
        if column >= width || row >= height {
            let expected = format!("below {width} and {height}");
            return Err(
                file.error(format!("an entry has the column {column} and row {row}; expected {expected}"))
            );
        }
        let count = file.u32("a pixel's number of views")?;
        file.require(count.into(), 4, "a pixel's views")?;
        views.clear();
        for _ in 0..count {
            let view = file.u32("a pixel's views")?;
            if view > i32::MAX as u32 {
                return Err(file.error(format!("a view is {}; expected an index from 0", view as i32)));
            }
            views.push(view);
        }
        graph.pixels.push([column, row]);
        graph.views.push(&views);
    }
    Ok(graph)
}

/// Returns an error unless a buffer has one value for each pixel.
pub(super) fn check_length(name: &str, width: u32, height: u32, length: usize) -> Result<()> {
    if width as usize * height as usize == length {
        return Ok(());
    }
    Err(Error::argument(
        name,
        format!("{length} values"),
        format!("one for each of {width} x {height} pixels"),
    ))
}
