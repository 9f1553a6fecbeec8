//! Pictures handed in by the host, and their downscale to half size.

use crate::error::{Error, Result};
use std::sync::Arc;

/// A photograph: gray values for matching and, when there are any, colors for the points. Clones share the pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    gray: Arc<Vec<u8>>,
    color: Option<Arc<Vec<[u8; 3]>>>,
}

impl Picture {
    /// From gray values, row by row, `width * height` of them.
    pub fn from_gray(width: u32, height: u32, gray: Vec<u8>) -> Result<Picture> {
        check_size("picture.gray", width, height, gray.len())?;
        Ok(Picture { width, height, gray: Arc::new(gray), color: None })
    }

    /// From red, green and blue, row by row, `width * height` of them. Gray is their luma (ITU-R BT.601).
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

    /// Gray values row by row.
    pub fn gray(&self) -> &[u8] {
        &self.gray
    }

    /// Red, green and blue row by row, when it has colors.
    pub fn color(&self) -> Option<&[[u8; 3]]> {
        self.color.as_ref().map(|color| &color[..])
    }

    /// Red, green and blue of the pixel with this index (row * width + column); gray thrice without colors.
    pub fn rgb(&self, pixel: usize) -> [u8; 3] {
        match &self.color {
            Some(color) => color[pixel],
            None => [self.gray[pixel]; 3],
        }
    }

    /// The gray picture at half size: the rounded mean of 2 x 2 pixels, the last column and row repeated when a
    /// side is odd.
    pub fn halved(&self) -> Picture {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let at = |x: u32, y: u32| {
            let (x, y) = (x.min(self.width - 1), y.min(self.height - 1));
            u32::from(self.gray[y as usize * self.width as usize + x as usize])
        };
        let mut gray = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                let sum =
                    at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1);
                gray.push(((sum + 2) / 4) as u8);
            }
        }
        Picture { width, height, gray: Arc::new(gray), color: None }
    }
}

fn check_size(name: &str, width: u32, height: u32, count: usize) -> Result<()> {
    let expected = width as usize * height as usize;
    if width == 0 || height == 0 || count != expected {
        let value = format!("{count} values for {width} x {height} pixels");
        return Err(Error::argument(name, value, format!("{expected} values and no side of 0")));
    }
    Ok(())
}
