//! Photographs in memory.

use crate::error::{Error, Result};
use std::sync::Arc;

/// A photograph: gray values for matching and, optionally, colors for the point cloud. Clones share the
/// pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    gray: Arc<Vec<u8>>,
    color: Option<Arc<Vec<[u8; 3]>>>,
}

impl Picture {
    /// A picture from `width * height` gray values, row by row.
    pub fn from_gray(width: u32, height: u32, gray: Vec<u8>) -> Result<Picture> {
        check_size("picture.gray", width, height, gray.len())?;
        Ok(Picture { width, height, gray: Arc::new(gray), color: None })
    }

    /// A picture from `width * height` values of red, green and blue, row by row. Gray values are the luma of
    /// ITU-R BT.601.
    pub fn from_rgb(width: u32, height: u32, color: Vec<[u8; 3]>) -> Result<Picture> {
        check_size("picture.color", width, height, color.len())?;
        let luma = |&[r, g, b]: &[u8; 3]| {
            ((u32::from(r) * 299 + u32::from(g) * 587 + u32::from(b) * 114 + 500) / 1000) as u8
        };
        let gray = Arc::new(color.iter().map(luma).collect());
        Ok(Picture { width, height, gray, color: Some(Arc::new(color)) })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Gray values, row by row.
    pub fn gray(&self) -> &[u8] {
        &self.gray
    }

    /// Red, green and blue, row by row; `None` for a gray picture.
    pub fn color(&self) -> Option<&[[u8; 3]]> {
        self.color.as_ref().map(|color| &color[..])
    }

    /// Red, green and blue of the pixel with index `row * width + column`; three times the gray value in a
    /// gray picture.
    pub fn rgb(&self, pixel: usize) -> [u8; 3] {
        match &self.color {
            Some(color) => color[pixel],
            None => [self.gray[pixel]; 3],
        }
    }
}

fn check_size(name: &str, width: u32, height: u32, count: usize) -> Result<()> {
    let expected = width as usize * height as usize;
    if width == 0 || height == 0 || count != expected {
        let value = format!("{count} values for {width} x {height} pixels");
        return Err(Error::argument(
            name,
            value,
            format!("{expected} values, a width and height of at least 1"),
        ));
    }
    Ok(())
}
