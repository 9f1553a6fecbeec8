//! Images in C's buffers: 8-bit, 16-bit and float, gray and color, with strides.

use super::status::{Failure, SKEP_ERR_NULL};
use crate::geometry::Camera;
use crate::image::Picture;
use crate::memory::require_memory;
use std::ffi::c_void;

/// Gray. A format is a layout of channels of 8 bits, plus SKEP_FORMAT_16 or SKEP_FORMAT_FLOAT for other
/// channels: SKEP_FORMAT_BGR is 8-bit BGR, SKEP_FORMAT_BGR + SKEP_FORMAT_16 is 16-bit BGR.
pub const SKEP_FORMAT_GRAY: u32 = 0;
/// Red, green, blue.
pub const SKEP_FORMAT_RGB: u32 = 1;
/// Blue, green, red: the order of OpenCV.
pub const SKEP_FORMAT_BGR: u32 = 2;
/// Red, green, blue, and a fourth channel that is ignored.
pub const SKEP_FORMAT_RGBA: u32 = 3;
/// Blue, green, red, and a fourth channel that is ignored.
pub const SKEP_FORMAT_BGRA: u32 = 4;
/// Added to a layout: channels of uint16_t in the machine's byte order, 0 to 65535.
pub const SKEP_FORMAT_16: u32 = 16;
/// Added to a layout: channels of float, 0 to 1; values outside are clamped, NaN is refused.
pub const SKEP_FORMAT_FLOAT: u32 = 32;

/// Pixels in the caller's memory, read during the call only. The layout of this struct is frozen.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct skep_image {
    /// Address of the top-left pixel; needs no alignment.
    pub data: *const c_void,
    /// Width in pixels, 1 to 32768.
    pub width: u32,
    /// Height in pixels, 1 to 32768.
    pub height: u32,
    /// Bytes from a row to the next, at least those of the pixels of a row.
    pub stride_bytes: usize,
    /// A SKEP_FORMAT_ layout, plus SKEP_FORMAT_16 or SKEP_FORMAT_FLOAT.
    pub format: u32,
}

/// How a format's channels lie: how many, and where red, green and blue are.
struct Layout {
    channels: usize,
    rgb: Option<[usize; 3]>,
}

#[derive(Clone, Copy)]
enum Depth {
    Byte,
    Short,
    Float,
}

impl Depth {
    fn bytes(self) -> usize {
        match self {
            Depth::Byte => 1,
            Depth::Short => 2,
            Depth::Float => 4,
        }
    }

    /// A channel's value, rounded to 8 bits; `None` for what is not a number.
    fn read(self, bytes: &[u8]) -> Option<u8> {
        match self {
            Depth::Byte => Some(bytes[0]),
            Depth::Short => {
                let value = u16::from_ne_bytes([bytes[0], bytes[1]]);
                Some(((u32::from(value) + 128) / 257) as u8)
            }
            Depth::Float => {
                let value = f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                (!value.is_nan()).then(|| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
            }
        }
    }
}

/// The layout and depth of the image called `name`.
fn format(format: u32, name: &str) -> Result<(Layout, Depth), Failure> {
    let layout = match format % 16 {
        SKEP_FORMAT_GRAY => Some(Layout { channels: 1, rgb: None }),
        SKEP_FORMAT_RGB => Some(Layout { channels: 3, rgb: Some([0, 1, 2]) }),
        SKEP_FORMAT_BGR => Some(Layout { channels: 3, rgb: Some([2, 1, 0]) }),
        SKEP_FORMAT_RGBA => Some(Layout { channels: 4, rgb: Some([0, 1, 2]) }),
        SKEP_FORMAT_BGRA => Some(Layout { channels: 4, rgb: Some([2, 1, 0]) }),
        _ => None,
    };
    let depth = match format / 16 * 16 {
        0 => Some(Depth::Byte),
        SKEP_FORMAT_16 => Some(Depth::Short),
        SKEP_FORMAT_FLOAT => Some(Depth::Float),
        _ => None,
    };
    layout.zip(depth).ok_or_else(|| {
        Failure::argument(
            &format!("{name}.format"),
            format,
            "a SKEP_FORMAT_ layout, plus SKEP_FORMAT_16 or SKEP_FORMAT_FLOAT",
        )
    })
}

/// The bytes of an image's rows, each without what lies between rows.
///
/// # Safety `data` is NULL or points to `height` rows of `row_bytes` readable bytes, `stride_bytes` apart,
/// that stay as they are for `'a`.
pub unsafe fn rows<'a>(
    data: *const c_void,
    row_bytes: usize,
    height: u32,
    stride_bytes: usize,
    name: &str,
) -> Result<impl Iterator<Item = &'a [u8]> + Clone + use<'a>, Failure> {
    check_rows(data, row_bytes, height, stride_bytes, name)?;
    let data = data.cast::<u8>();
    Ok((0..height as usize).map(move |row| {
        // SAFETY: the caller promised the bytes; `check_rows` that offset and length fit into an allocation.
        unsafe { std::slice::from_raw_parts(data.add(row * stride_bytes), row_bytes) }
    }))
}

/// Refuses NULL, rows that overlap, and buffers that no memory can hold.
pub fn check_rows(
    data: *const c_void,
    row_bytes: usize,
    height: u32,
    stride_bytes: usize,
    name: &str,
) -> Result<(), Failure> {
    if data.is_null() {
        return Err(Failure::new(SKEP_ERR_NULL, format!("{name} is NULL; expected {height} rows")));
    }
    if stride_bytes < row_bytes {
        let expected = format!("at least {row_bytes}, the bytes of a row");
        return Err(Failure::argument(&format!("stride_bytes of {name}"), stride_bytes, expected));
    }
    if stride_bytes.checked_mul(height as usize).is_none_or(|bytes| bytes > isize::MAX as usize) {
        return Err(Failure::argument(
            &format!("stride_bytes of {name}"),
            stride_bytes,
            "what fits into memory",
        ));
    }
    Ok(())
}

/// Refuses sizes that no image and no map has; `of` goes before the names of the sides.
pub fn check_size((width, height): (u32, u32), of: &str) -> Result<(), Failure> {
    for (name, side) in [("width", width), ("height", height)] {
        if side == 0 || side > Camera::MAX_SIDE {
            let expected = format!("1 to {} pixels", Camera::MAX_SIDE);
            return Err(Failure::argument(&format!("{of}{name}"), side, expected));
        }
    }
    Ok(())
}

impl skep_image {
    /// Refuses an image that [`Self::picture`] would refuse before it looks at a pixel.
    pub fn check(&self, name: &str) -> Result<(), Failure> {
        let (layout, depth) = format(self.format, name)?;
        check_size((self.width, self.height), &format!("{name}."))?;
        let row_bytes = self.width as usize * layout.channels * depth.bytes();
        check_rows(self.data, row_bytes, self.height, self.stride_bytes, &format!("{name}.data"))
    }

    /// A copy of the image; `name` is how an error calls it.
    ///
    /// # Safety
    /// `data` is NULL or points to an image as the fields describe it.
    pub unsafe fn picture(&self, name: &str) -> Result<Picture, Failure> {
        let (layout, depth) = format(self.format, name)?;
        check_size((self.width, self.height), &format!("{name}."))?;
        let pixel_bytes = layout.channels * depth.bytes();
        let row_bytes = self.width as usize * pixel_bytes;
        // SAFETY: as promised by the caller.
        let rows =
            unsafe { rows(self.data, row_bytes, self.height, self.stride_bytes, &format!("{name}.data")) }?;
        // The gray values, the colors, and these once more while they grow.
        let bytes = 8 * u64::from(self.width) * u64::from(self.height);
        require_memory(bytes, format!("a copy of {name}"))?;
        let pixels = rows.enumerate().flat_map(|(row, bytes)| {
            bytes.chunks_exact(pixel_bytes).enumerate().map(move |(column, pixel)| (column, row, pixel))
        });
        let channel = |(column, row, pixel): (usize, usize, &[u8]), channel: usize| {
            depth.read(&pixel[channel * depth.bytes()..]).ok_or_else(|| {
                let name = format!("{name}.data at column {column}, row {row}");
                Failure::argument(&name, "not a number", "numbers from 0 to 1")
            })
        };
        let (width, height) = (self.width, self.height);
        Ok(match layout.rgb {
            None => {
                let gray: Result<Vec<u8>, Failure> = pixels.map(|pixel| channel(pixel, 0)).collect();
                Picture::from_gray(width, height, gray?)?
            }
            Some([red, green, blue]) => {
                let color: Result<Vec<[u8; 3]>, Failure> = pixels
                    .map(|pixel| Ok([channel(pixel, red)?, channel(pixel, green)?, channel(pixel, blue)?]))
                    .collect();
                Picture::from_rgb(width, height, color?)?
            }
        })
    }
}
