//! Pictures handed in by the host, and their reduction to half size.

use crate::error::{Error, Result};
use std::sync::Arc;

/// A photograph: grey values for matching and, when there are any, colours for the points. Clones share the pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    grey: Arc<Vec<u8>>,
    colour: Option<Arc<Vec<[u8; 3]>>>,
}

impl Picture {
    /// From grey values, row by row, `width * height` of them.
    pub fn from_grey(width: u32, height: u32, grey: Vec<u8>) -> Result<Picture> {
        check_size("picture.grey", width, height, grey.len())?;
        Ok(Picture { width, height, grey: Arc::new(grey), colour: None })
    }

    /// From red, green and blue, row by row, `width * height` of them. Grey is their luma (ITU-R BT.601).
    pub fn from_rgb(width: u32, height: u32, colour: Vec<[u8; 3]>) -> Result<Picture> {
        check_size("picture.colour", width, height, colour.len())?;
        let luma = |&[r, g, b]: &[u8; 3]| {
            ((u32::from(r) * 299 + u32::from(g) * 587 + u32::from(b) * 114 + 500) / 1000) as u8
        };
        let grey = Arc::new(colour.iter().map(luma).collect());
        Ok(Picture { width, height, grey, colour: Some(Arc::new(colour)) })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Grey values row by row.
    pub fn grey(&self) -> &[u8] {
        &self.grey
    }

    /// Red, green and blue row by row, when it has colours.
    pub fn colour(&self) -> Option<&[[u8; 3]]> {
        self.colour.as_ref().map(|colour| &colour[..])
    }

    /// Red, green and blue of the pixel with this index (row * width + column); grey thrice without colours.
    pub fn rgb(&self, pixel: usize) -> [u8; 3] {
        match &self.colour {
            Some(colour) => colour[pixel],
            None => [self.grey[pixel]; 3],
        }
    }

    /// The grey picture at half size: the rounded mean of 2 x 2 pixels, the last column and row repeated when a
    /// side is odd.
    pub fn halved(&self) -> Picture {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let at = |x: u32, y: u32| {
            let (x, y) = (x.min(self.width - 1), y.min(self.height - 1));
            u32::from(self.grey[y as usize * self.width as usize + x as usize])
        };
        let mut grey = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            for x in 0..width {
                let sum =
                    at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1);
                grey.push(((sum + 2) / 4) as u8);
            }
        }
        Picture { width, height, grey: Arc::new(grey), colour: None }
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
