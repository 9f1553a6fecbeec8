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
/// Added to a layout: channels of uint16_t in the machine's byte order, 0 to 65535. Scale samples of fewer
/// bits to that range, or most of the gray values are lost: 12 bits, 0 to 4095, by 65535 / 4095.
pub const SKEP_FORMAT_16: u32 = 16;
/// Added to a layout: channels of float, 0 (black) to 1 (white). Values up to 1/255 outside, as interpolation
/// leaves them, are clamped; others and NaN are refused, so scale pixels of 0 to 255 by 1/255.
pub const SKEP_FORMAT_FLOAT: u32 = 32;

/// How far floats may lie outside 0 to 1, in which they are clamped: a step of 8 bits.
const FLOAT_TOLERANCE: f32 = 1.0 / 255.0;

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

    /// A channel's value, rounded to 8 bits; a float that is no gray value as the error.
    fn read(self, bytes: &[u8]) -> Result<u8, f32> {
        match self {
            Depth::Byte => Ok(bytes[0]),
            Depth::Short => {
                let value = u16::from_ne_bytes([bytes[0], bytes[1]]);
                Ok(((u32::from(value) + 128) / 257) as u8)
            }
            Depth::Float => {
                let value = f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                // NaN is in no range.
                match (-FLOAT_TOLERANCE..=1.0 + FLOAT_TOLERANCE).contains(&value) {
                    true => Ok((value.clamp(0.0, 1.0) * 255.0).round() as u8),
                    false => Err(value),
                }
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
            depth.read(&pixel[channel * depth.bytes()..]).map_err(|value| {
                let name = format!("{name}.data at column {column}, row {row}");
                let expected = "floats from 0 (black) to 1 (white): scale by 1 / the value of white";
                Failure::argument(&name, value, expected)
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

#[cfg(test)]
mod tests {
    use super::super::status::{SKEP_ERR_ARGUMENT, guard, skep_last_error};
    use super::*;
    use std::ffi::CStr;

    fn float(value: f32) -> Result<u8, f32> {
        Depth::Float.read(&value.to_ne_bytes())
    }

    #[test]
    fn floats_just_outside_0_to_1_are_clamped_and_others_refused() {
        assert_eq!([float(0.0), float(0.5), float(1.0)], [Ok(0), Ok(128), Ok(255)]);
        assert_eq!([float(-0.003), float(1.003)], [Ok(0), Ok(255)]);
        for refused in [-0.005, 1.005, 254.0, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(float(refused), Err(refused));
        }
        assert!(float(f32::NAN).is_err_and(f32::is_nan));
    }

    #[test]
    fn a_float_that_is_refused_is_named_with_its_place() {
        let pixels: [f32; 4] = [0.0, 0.5, 1.0, 200.0];
        let image = skep_image {
            data: pixels.as_ptr().cast(),
            width: 2,
            height: 2,
            stride_bytes: 8,
            format: SKEP_FORMAT_GRAY + SKEP_FORMAT_FLOAT,
        };
        // SAFETY: the fields describe `pixels`, which outlive the call.
        assert_eq!(guard(|| unsafe { image.picture("image") }.map(drop)), SKEP_ERR_ARGUMENT);
        let mut text = [0; 200];
        // SAFETY: the buffer has room for as many bytes.
        unsafe { skep_last_error(text.as_mut_ptr(), text.len()) };
        // SAFETY: the text ends in NUL.
        let text = unsafe { CStr::from_ptr(text.as_ptr()) }.to_str().unwrap();
        assert!(text.contains("image.data at column 1, row 1 is 200"), "{text}");
    }
}
