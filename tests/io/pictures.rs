//! Photographs and previews.

use crate::assert_refused;
use image::{ExtendedColorType, ImageBuffer, Luma, Rgb, save_buffer};
use skep::io::{picture_size, read_picture, write_depth_preview, write_normal_preview, write_views_preview};
use std::path::Path;
use tempfile::tempdir;

#[test]
fn gray_and_color_of_8_and_16_bits_are_read() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("picture.png");
    let read = |width, height, bytes: &[u8], kind| {
        save_buffer(&path, bytes, width, height, kind).unwrap();
        read_picture(&path).unwrap()
    };
    let deep = |values: &[u16]| values.iter().flat_map(|value| value.to_ne_bytes()).collect::<Vec<_>>();

    let gray = read(2, 1, &[7, 250], ExtendedColorType::L8);
    assert_eq!((gray.width(), gray.height(), gray.gray()), (2, 1, [7, 250].as_slice()));
    assert_eq!(gray.rgb(1), [250; 3]);
    // 16 bits are rounded: 128.5 / 257 is the border between 0 and 1.
    let gray = read(3, 2, &deep(&[128, 129, 65535, 65406, 65407, 257]), ExtendedColorType::L16);
    assert_eq!(gray.gray(), [0, 1, 255, 254, 255, 1]);
    assert_eq!(read(1, 1, &[9, 0], ExtendedColorType::La8).gray(), [9], "alpha is dropped");

    let color = read(1, 2, &[1, 2, 3, 90, 80, 70], ExtendedColorType::Rgb8);
    assert_eq!((color.rgb(0), color.rgb(1)), ([1, 2, 3], [90, 80, 70]));
    assert_eq!(read(1, 1, &deep(&[257, 514, 65535]), ExtendedColorType::Rgb16).rgb(0), [1, 2, 255]);
    assert_eq!(read(1, 1, &[5, 6, 7, 0], ExtendedColorType::Rgba8).rgb(0), [5, 6, 7], "alpha is dropped");
}

#[test]
fn jpeg_is_read_whatever_its_name() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("picture.jpg");
    let image: ImageBuffer<Luma<u8>, _> = ImageBuffer::from_raw(8, 8, vec![100u8; 64]).unwrap();
    image.save(&path).unwrap();
    let renamed = folder.path().join("picture.png");
    std::fs::rename(&path, &renamed).unwrap();
    let picture = read_picture(&renamed).unwrap();
    assert_eq!(picture_size(&renamed).unwrap(), (8, 8));
    assert!(picture.gray().iter().all(|gray| gray.abs_diff(100) <= 1));
}

#[test]
fn a_truncated_jpeg_is_refused_and_trailing_bytes_are_not() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("picture.jpg");
    let image: ImageBuffer<Luma<u8>, _> = ImageBuffer::from_fn(64, 64, |x, y| Luma([(x * y * 37) as u8]));
    image.save(&path).unwrap();
    crate::rewrite(&path, |bytes| bytes.extend_from_slice(b"\0\0trailer"));
    let whole = read_picture(&path).unwrap();
    crate::rewrite(&path, |bytes| bytes.truncate(bytes.len() * 2 / 5));
    assert_refused(read_picture(&path), &["picture.jpg", "truncated"]);
    assert_eq!(whole.width(), 64);
}

#[test]
fn floating_point_pixels_are_refused_with_what_is_read() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("picture.tif");
    let colors: ImageBuffer<Rgb<f32>, _> = ImageBuffer::from_pixel(3, 2, Rgb([0.5, 1.5, 300.0]));
    colors.save(&path).unwrap();
    assert_refused(
        read_picture(&path),
        &["picture.tif", "floating-point", "expected 8 or 16 bits a channel"],
    );
    #[cfg(feature = "tiff")]
    {
        let file = std::fs::File::create(&path).unwrap();
        let mut encoder = tiff::encoder::TiffEncoder::new(file).unwrap();
        encoder.write_image::<tiff::encoder::colortype::Gray32Float>(3, 2, &[0.5; 6]).unwrap();
        assert_refused(read_picture(&path), &["picture.tif", "expected 8 or 16 bits a channel"]);
    }
}

#[test]
fn what_is_no_picture_is_refused() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("picture.png");
    assert_refused(read_picture(&path), &["picture.png", "cannot be read"]);
    std::fs::write(&path, "text").unwrap();
    assert_refused(read_picture(&path), &["picture.png", "cannot be read"]);
    let image: ImageBuffer<Luma<u8>, _> = ImageBuffer::from_fn(64, 64, |x, y| Luma([(x * y * 37) as u8]));
    image.save(&path).unwrap();
    crate::rewrite(&path, |bytes| bytes.truncate(bytes.len() / 2));
    assert_refused(read_picture(&path), &["picture.png", "cannot be read"]);
}

/// Red, green and blue of each pixel.
fn pixels(path: &Path) -> Vec<[u8; 3]> {
    image::open(path).unwrap().into_rgb8().pixels().map(|pixel| pixel.0).collect()
}

#[test]
fn depth_previews_are_bright_where_near_and_black_without_estimate() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("preview/0001.png.depth.png");
    write_depth_preview(&path, 2, 2, &[1.0, 2.0, 0.0, 4.0]).unwrap();
    let sums: Vec<u32> = pixels(&path).iter().map(|rgb| rgb.iter().map(|&c| u32::from(c)).sum()).collect();
    assert!(sums[0] > sums[1] && sums[1] > sums[3] && sums[3] > 0, "{sums:?}");
    assert_eq!(sums[2], 0);
    // Neither a map of one depth nor an empty one has a spread.
    write_depth_preview(&path, 2, 1, &[3.0, 3.0]).unwrap();
    write_depth_preview(&path, 2, 1, &[0.0, 0.0]).unwrap();
    assert_eq!(pixels(&path), [[0; 3]; 2]);
}

#[test]
fn normal_previews_are_bluish_where_the_surface_faces_the_camera() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("normal.png");
    write_normal_preview(&path, 2, 2, &[[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0; 3]])
        .unwrap();
    assert_eq!(pixels(&path), [[128, 128, 255], [255, 128, 128], [128, 255, 128], [0, 0, 0]]);
}

#[test]
fn view_previews_are_white_where_all_sources_were_used() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("views.png");
    write_views_preview(&path, 3, 1, 2, |pixel| pixel).unwrap();
    assert_eq!(pixels(&path), [[0; 3], [127; 3], [255; 3]]);
    write_views_preview(&path, 1, 1, 0, |_| 0).unwrap();
    assert_eq!(pixels(&path), [[0; 3]]);
}
