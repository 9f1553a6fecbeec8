//! Photographs from PNG and JPEG files, and to PNG files.

use super::files::{cannot_be_read, write_file};
use super::jpeg_end::has_end;
use crate::error::{Error, Result};
use crate::geometry::Camera;
use crate::image::Picture;
use crate::memory::require_memory;
use image::codecs::png::PngEncoder;
use image::{
    ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageFormat,
    ImageReader, Limits,
};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Seek};
use std::path::Path;

/// What a file that is no photograph should be.
const EXPECTED: &str = "expected 8 or 16 bits a channel, in PNG, JPEG, TIFF, BMP, WebP or PNM";

/// Reads a PNG or JPEG file, color or gray, 8 or 16 bits (16 are rounded to 8). An alpha channel is dropped;
/// nothing else is applied, neither an orientation nor a color profile: the calibration refers to the stored
/// pixels.
///
/// # Errors
/// A file that is missing, damaged or truncated.
pub fn read_picture(path: &Path) -> Result<Picture> {
    decode(open(path)?, path)
}

/// The picture in the bytes of a file, like [`read_picture`]; errors name the file.
pub(crate) fn picture_from_bytes(bytes: &[u8], path: &Path) -> Result<Picture> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    decode(limited(reader.map_err(|error| cannot_be_read(path, error))?), path)
}

fn decode<R: BufRead + Seek>(reader: ImageReader<R>, path: &Path) -> Result<Picture> {
    let decoder = decoder(reader, path)?;
    let image = DynamicImage::from_decoder(decoder).map_err(|error| not_decoded(path, &error))?;
    let (width, height) = (image.width(), image.height());
    if is_gray(&image) {
        return Picture::from_gray(width, height, image.into_luma8().into_raw());
    }
    Picture::from_rgb(width, height, image.into_rgb8().pixels().map(|pixel| pixel.0).collect())
}

/// Returns an error for a truncated JPEG file, which the decoder would fill with gray.
fn whole<R: BufRead + Seek>(reader: ImageReader<R>, path: &Path) -> Result<ImageReader<R>> {
    if reader.format() != Some(ImageFormat::Jpeg) {
        return Ok(reader);
    }
    let mut file = reader.into_inner();
    let found = file.rewind().and_then(|()| has_end(&mut file));
    let is_whole = found.and_then(|is_whole| file.rewind().map(|()| is_whole));
    match is_whole.map_err(|error| cannot_be_read(path, error))? {
        true => Ok(limited(ImageReader::with_format(file, ImageFormat::Jpeg))),
        false => Err(cannot_be_read(
            path,
            "truncated: the JPEG file ends within the image; copy the photograph again",
        )),
    }
}

/// Width and height of a PNG or JPEG file, from its header.
pub fn picture_size(path: &Path) -> Result<(u32, u32)> {
    open(path)?.into_dimensions().map_err(|error| not_decoded(path, &error))
}

/// Writes a picture as PNG, in color when it has colors.
pub fn write_picture(path: &Path, picture: &Picture) -> Result<()> {
    let (bytes, color) = match picture.color() {
        Some(color) => (color.as_flattened(), ExtendedColorType::Rgb8),
        None => (picture.gray(), ExtendedColorType::L8),
    };
    write_file(path, |out| {
        let encoder = PngEncoder::new(out);
        encoder.write_image(bytes, picture.width(), picture.height(), color).map_err(io::Error::other)
    })
}

/// The decoder of a file, if there is memory for its pixels, their gray values and colors.
pub(super) fn decoder<'a, R: BufRead + Seek + 'a>(
    reader: ImageReader<R>,
    path: &Path,
) -> Result<Box<dyn ImageDecoder + 'a>> {
    let opened = whole(reader, path)?.into_decoder().and_then(|mut decoder| {
        decoder.set_limits(limits())?;
        Ok(decoder)
    });
    let decoder = opened.map_err(|error| not_decoded(path, &error))?;
    if matches!(decoder.color_type(), ColorType::Rgb32F | ColorType::Rgba32F) {
        return Err(cannot_be_read(path, format!("its pixels are floating-point numbers; {EXPECTED}")));
    }
    let (width, height) = decoder.dimensions();
    let bytes = decoder.total_bytes().saturating_add(4 * u64::from(width) * u64::from(height));
    require_memory(bytes, format!("the photograph {}", path.display()))?;
    Ok(Box::new(decoder))
}

/// The error of a decoder; of kinds of pixels that it does not know, with what is read.
pub(super) fn not_decoded(path: &Path, error: &ImageError) -> Error {
    match error {
        ImageError::Unsupported(_) => cannot_be_read(path, format!("{error}; {EXPECTED}")),
        _ => cannot_be_read(path, error),
    }
}

pub(super) fn is_gray(image: &DynamicImage) -> bool {
    matches!(image.color(), ColorType::L8 | ColorType::La8 | ColorType::L16 | ColorType::La16)
}

/// The format is detected from the content, not from the name.
fn open(path: &Path) -> Result<ImageReader<BufReader<File>>> {
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    Ok(limited(reader.map_err(|error| cannot_be_read(path, error))?))
}

pub(super) fn limited<R: BufRead + Seek>(mut reader: ImageReader<R>) -> ImageReader<R> {
    reader.limits(limits());
    reader
}

/// The memory is asked for before it is allocated.
fn limits() -> Limits {
    let mut limits = Limits::no_limits();
    limits.max_image_width = Some(Camera::MAX_SIDE);
    limits.max_image_height = Some(Camera::MAX_SIDE);
    limits
}
