//! Previews: maps as PNG pictures. Pixels without an estimate are black.

use super::colmap_maps::check_length;
use super::files::write_file;
use crate::error::Result;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io;
use std::path::Path;

/// Colors from far to near, in even steps of lightness.
const COLORS: [[f32; 3]; 6] = [
    [48.0, 18.0, 94.0],
    [58.0, 64.0, 158.0],
    [26.0, 118.0, 172.0],
    [24.0, 168.0, 138.0],
    [134.0, 206.0, 72.0],
    [252.0, 236.0, 84.0],
];
/// Percentiles of the inverse depths at the ends of the color scale: outliers do not stretch it.
const PERCENTILES: (f64, f64) = (0.02, 0.98);

/// Writes depths as colors over inverse depth: near is bright.
pub fn write_depth_preview(path: &Path, width: u32, height: u32, depth: &[f32]) -> Result<()> {
    check_length("depth map", width, height, depth.len())?;
    let mut inverse: Vec<f32> = depth.iter().filter(|depth| **depth > 0.0).map(|depth| 1.0 / depth).collect();
    inverse.sort_unstable_by(f32::total_cmp);
    let percentile = |share: f64| {
        let index = (inverse.len().saturating_sub(1) as f64 * share).round() as usize;
        inverse.get(index).copied().unwrap_or_default()
    };
    let (far, near) = (percentile(PERCENTILES.0), percentile(PERCENTILES.1));
    let scale = 1.0 / (near - far).max(f32::MIN_POSITIVE);
    write_rgb(path, width, height, |pixel| match depth[pixel] {
        depth if depth > 0.0 => color((1.0 / depth - far) * scale),
        _ => [0; 3],
    })
}

/// The color at a fraction of the scale from far (0) to near (1), linear between those of the table.
fn color(share: f32) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (COLORS.len() - 1) as f32;
    let index = (place as usize).min(COLORS.len() - 2);
    let part = place - index as f32;
    std::array::from_fn(|channel| {
        let (from, to) = (COLORS[index][channel], COLORS[index + 1][channel]);
        (from + (to - from) * part).round() as u8
    })
}

/// Writes normals as colors: right is red, up is green, towards the camera is blue.
pub fn write_normal_preview(path: &Path, width: u32, height: u32, normal: &[[f32; 3]]) -> Result<()> {
    check_length("normal map", width, height, normal.len())?;
    let byte = |component: f32| ((component * 0.5 + 0.5) * 255.0).round() as u8;
    write_rgb(path, width, height, |pixel| match normal[pixel] {
        [0.0, 0.0, 0.0] => [0; 3],
        [x, y, z] => [byte(x), byte(-y), byte(-z)],
    })
}

/// Writes the number of source views of each pixel as brightness, white for all `sources`. `count` gives the
/// number by the pixel's index (row * width + column).
pub fn write_views_preview(
    path: &Path,
    width: u32,
    height: u32,
    sources: usize,
    count: impl Fn(usize) -> usize,
) -> Result<()> {
    let pixels = width as usize * height as usize;
    let bytes: Vec<u8> =
        (0..pixels).map(|pixel| (count(pixel) * 255 / sources.max(1)).min(255) as u8).collect();
    write_png(path, width, height, &bytes, ExtendedColorType::L8)
}

/// Writes a fraction of each pixel as brightness, white for 1.
pub fn write_fraction_preview(
    path: &Path,
    width: u32,
    height: u32,
    fraction: impl Fn(usize) -> f32,
) -> Result<()> {
    let pixels = width as usize * height as usize;
    let bytes: Vec<u8> = (0..pixels).map(|pixel| (fraction(pixel) * 255.0).round() as u8).collect();
    write_png(path, width, height, &bytes, ExtendedColorType::L8)
}

/// Writes a small number of each pixel, as it is, into an 8-bit gray picture.
pub(super) fn write_numbers(
    path: &Path,
    width: u32,
    height: u32,
    number: impl Fn(usize) -> u8,
) -> Result<()> {
    let bytes: Vec<u8> = (0..width as usize * height as usize).map(number).collect();
    write_png(path, width, height, &bytes, ExtendedColorType::L8)
}

fn write_rgb(path: &Path, width: u32, height: u32, color: impl Fn(usize) -> [u8; 3]) -> Result<()> {
    let bytes: Vec<[u8; 3]> = (0..width as usize * height as usize).map(color).collect();
    write_png(path, width, height, bytes.as_flattened(), ExtendedColorType::Rgb8)
}

fn write_png(path: &Path, width: u32, height: u32, bytes: &[u8], kind: ExtendedColorType) -> Result<()> {
    write_file(path, |out| {
        PngEncoder::new(out).write_image(bytes, width, height, kind).map_err(io::Error::other)
    })
}

#[cfg(test)]
mod tests {
    use super::color;

    #[test]
    fn nearer_is_lighter_all_along_the_colors() {
        let luma = |share: f32| {
            let [r, g, b] = color(share).map(f32::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        let steps: Vec<f32> = (0..=50).map(|step| luma(step as f32 / 50.0)).collect();
        assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
    }
}
