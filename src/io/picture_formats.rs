//! What photographs of any format hold besides eight bits of gray or color: sixteen bits, transparency; and
//! how changed photographs and masks are written.

use super::files::{cannot_be_read, write_file};
use super::pictures::{decoder, is_gray, limited, not_decoded};
use crate::error::{Error, Result};
use crate::image::Picture;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageReader};
use std::io::{self, Cursor, Write};
use std::path::Path;

/// Quality of changed photographs that are JPEG files: what is lost is less than what the camera lost.
const JPEG_QUALITY: u8 = 98;

/// What a photograph's header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PictureHeader {
    pub size: (u32, u32),
    /// Whether it has 16 bits a channel.
    pub is_deep: bool,
    pub has_alpha: bool,
}

/// Reads the header of a photograph.
///
/// # Errors
/// A file that cannot be read or is of no known format.
pub(crate) fn picture_header(path: &Path) -> Result<PictureHeader> {
    let read = || -> image::ImageResult<PictureHeader> {
        let decoder = limited(ImageReader::open(path)?.with_guessed_format()?).into_decoder()?;
        let color = decoder.color_type();
        Ok(PictureHeader {
            size: decoder.dimensions(),
            is_deep: color.bytes_per_pixel() / color.channel_count() > 1,
            has_alpha: color.has_alpha(),
        })
    };
    read().map_err(|error| cannot_be_read(path, error))
}

/// The largest value of a photograph with 16 bits a channel, its alpha channel excepted; errors name the
/// file.
pub(crate) fn largest_value(bytes: &[u8], path: &Path) -> Result<u16> {
    let image = decoded(bytes, path)?;
    Ok(match image {
        DynamicImage::ImageLuma16(_) | DynamicImage::ImageLumaA16(_) => {
            image.into_luma16().into_raw().into_iter().max().unwrap_or(0)
        }
        _ => image.into_rgb16().into_raw().into_iter().max().unwrap_or(0),
    })
}

/// A picture from the bytes of a file, of which values of 16 bits are divided so that `white` becomes 255.
pub(crate) fn deep_picture_from_bytes(bytes: &[u8], path: &Path, white: u16) -> Result<Picture> {
    let image = decoded(bytes, path)?;
    let (width, height) = (image.width(), image.height());
    let white = u32::from(white.max(1));
    let eight_bits = |value: u16| ((u32::from(value) * 255 + white / 2) / white).min(255) as u8;
    if is_gray(&image) {
        let gray = image.into_luma16().into_raw().into_iter().map(eight_bits).collect();
        return Picture::from_gray(width, height, gray);
    }
    let color = image.into_rgb16().pixels().map(|pixel| pixel.0.map(eight_bits)).collect();
    Picture::from_rgb(width, height, color)
}

/// Whether each pixel of a photograph is not fully transparent; `None` where it has no alpha channel.
///
/// # Errors
/// A file that cannot be decoded; another size than `size`.
pub(crate) fn opaque_pixels(bytes: &[u8], path: &Path, size: (u32, u32)) -> Result<Option<Vec<bool>>> {
    let image = decoded(bytes, path)?;
    if (image.width(), image.height()) != size {
        return Err(Error::file(path, "changed while it was read"));
    }
    let has_alpha = image.color().has_alpha();
    Ok(has_alpha.then(|| image.into_rgba16().pixels().map(|pixel| pixel.0[3] > 0).collect()))
}

/// Reads a mask: `true` where its gray value is not 0.
///
/// # Errors
/// A file that cannot be read; another size than `size`.
pub(crate) fn read_mask(path: &Path, size: (u32, u32)) -> Result<Vec<bool>> {
    let bytes = std::fs::read(path).map_err(|error| cannot_be_read(path, error))?;
    let image = decoded(&bytes, path)?;
    if (image.width(), image.height()) != size {
        let (width, height) = (image.width(), image.height());
        let expected = format!("{}x{}, the size of its photograph", size.0, size.1);
        return Err(Error::file(path, format!("the mask is {width}x{height}; expected {expected}")));
    }
    Ok(image.into_luma16().into_raw().into_iter().map(|gray| gray > 0).collect())
}

/// Writes a mask as a gray PNG file: 255 where it is `true`, else 0.
pub(crate) fn write_mask(path: &Path, mask: &[bool], (width, height): (u32, u32)) -> Result<()> {
    let gray: Vec<u8> = mask.iter().map(|&is_set| if is_set { 255 } else { 0 }).collect();
    write_file(path, |out| {
        let encoder = PngEncoder::new(out);
        encoder.write_image(&gray, width, height, ExtendedColorType::L8).map_err(io::Error::other)
    })
}

/// Writes a changed photograph in the format of its name's ending: JPEG, TIFF, BMP, or else PNG.
pub(crate) fn write_photograph(path: &Path, picture: &Picture) -> Result<()> {
    let (bytes, color) = match picture.color() {
        Some(color) => (color.as_flattened(), ExtendedColorType::Rgb8),
        None => (picture.gray(), ExtendedColorType::L8),
    };
    let (width, height) = (picture.width(), picture.height());
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    write_file(path, |out| {
        let mut encoded = Cursor::new(Vec::new());
        let written = match ending.as_str() {
            "jpg" | "jpeg" => JpegEncoder::new_with_quality(&mut encoded, JPEG_QUALITY)
                .write_image(bytes, width, height, color),
            "tif" | "tiff" => {
                image::codecs::tiff::TiffEncoder::new(&mut encoded).write_image(bytes, width, height, color)
            }
            "bmp" => {
                image::codecs::bmp::BmpEncoder::new(&mut encoded).write_image(bytes, width, height, color)
            }
            _ => PngEncoder::new_with_quality(&mut encoded, CompressionType::Fast, FilterType::Adaptive)
                .write_image(bytes, width, height, color),
        };
        written.map_err(io::Error::other)?;
        out.write_all(encoded.get_ref())
    })
}

fn decoded(bytes: &[u8], path: &Path) -> Result<DynamicImage> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let decoder = decoder(limited(reader.map_err(|error| cannot_be_read(path, error))?), path)?;
    DynamicImage::from_decoder(decoder).map_err(|error| not_decoded(path, &error))
}
