//! A photograph as the workspace has it: without distortion, and not larger than wanted.

use crate::error::{Error, Result};
use crate::geometry::{Camera, Lens};
use crate::image::Picture;
use glam::DVec2;
use image::imageops::{FilterType, resize};
use image::{GrayImage, ImageBuffer, RgbImage};
use rayon::prelude::*;

/// Bytes of a photograph for each pixel while it is changed: of the file, decoded, as a picture, undistorted,
/// reduced and encoded.
const BYTES_PER_PIXEL: u64 = 32;

/// How a photograph is changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Change {
    lens: Lens,
    /// After undistortion, at full size.
    undistorted: Camera,
    /// After reduction.
    pub camera: Camera,
}

impl Change {
    /// Removes the distortion, and reduces the longer side to `max_size` pixels if it has more; 0 keeps all.
    ///
    /// # Errors
    /// A lens whose distortion is not valid in the whole image, or that spreads it over too many pixels;
    /// `name` names it.
    pub(super) fn new(lens: Lens, max_size: u32, name: &str) -> Result<Change> {
        let undistorted = lens.undistorted(name)?;
        undistorted.check(&format!("the undistorted camera of {name}"))?;
        Ok(Change { lens, undistorted, camera: limited(undistorted, max_size) })
    }

    /// Bytes that the change of a photograph takes, from its file to that of the changed one.
    pub(super) fn memory(&self) -> u64 {
        BYTES_PER_PIXEL * self.lens.camera.pixels().max(self.undistorted.pixels()) as u64
    }

    /// Whether the photograph stays as it is.
    pub(super) fn is_none(&self) -> bool {
        self.lens.distortion.is_none() && self.camera == self.lens.camera
    }

    /// The changed photograph, on the threads of the current pool.
    ///
    /// # Errors
    /// A picture that is not of the lens' size.
    pub(super) fn apply(&self, picture: &Picture) -> Result<Picture> {
        let size = (self.lens.camera.width, self.lens.camera.height);
        if (picture.width(), picture.height()) != size {
            let value = format!("{}x{}", picture.width(), picture.height());
            return Err(Error::argument("picture", value, format!("{}x{} pixels", size.0, size.1)));
        }
        let Camera { width, height, .. } = self.camera;
        match picture.color() {
            None => {
                let full = self.undistort(picture.gray().iter().map(|&gray| [gray]).collect());
                let (side, other) = (self.undistorted.width, self.undistorted.height);
                let image = GrayImage::from_raw(side, other, full.into_flattened()).unwrap_or_default();
                Picture::from_gray(width, height, self.reduce(image).into_raw())
            }
            Some(color) => {
                let full = self.undistort(color.to_vec());
                let (side, other) = (self.undistorted.width, self.undistorted.height);
                let image = RgbImage::from_raw(side, other, full.into_flattened()).unwrap_or_default();
                let colors = self.reduce(image).pixels().map(|pixel| pixel.0).collect();
                Picture::from_rgb(width, height, colors)
            }
        }
    }

    /// The mask of the changed photograph, from that of the photograph if there is one: `true` where the
    /// photograph shows something that is not ignored. A pixel that shows any ignored one is ignored.
    pub(super) fn mask(&self, mask: Option<&[bool]>) -> Vec<bool> {
        let Camera { width, height, .. } = self.camera;
        let (scale_x, scale_y) = (
            f64::from(self.undistorted.width) / f64::from(width),
            f64::from(self.undistorted.height) / f64::from(height),
        );
        let source = &self.lens.camera;
        let is_known = |x: f64, y: f64| {
            let shown = self.lens.pixel_of(&self.undistorted, DVec2::new(x, y));
            let Some((x, y)) = shown.and_then(|shown| source.nearest_pixel(shown)) else { return false };
            mask.is_none_or(|mask| mask[y as usize * source.width as usize + x as usize])
        };
        let pixel = |index: usize| {
            let (x, y) = (index as u32 % width, index as u32 / width);
            // The corners of the pixel, a little inside.
            let place = |at: u32, offset: f64, scale: f64| (f64::from(at) + 0.5 + offset) * scale - 0.5;
            [(-0.4, -0.4), (0.4, -0.4), (-0.4, 0.4), (0.4, 0.4)]
                .iter()
                .all(|&(dx, dy)| is_known(place(x, dx, scale_x), place(y, dy, scale_y)))
        };
        (0..self.camera.pixels()).into_par_iter().with_min_len(1 << 12).map(pixel).collect()
    }

    /// Pixels by bilinear interpolation, black where the photograph shows nothing.
    fn undistort<const N: usize>(&self, pixels: Vec<[u8; N]>) -> Vec<[u8; N]> {
        if self.lens.distortion.is_none() {
            return pixels;
        }
        let (source, target) = (&self.lens.camera, &self.undistorted);
        let (width, height) = (source.width as usize, source.height as usize);
        let pixel = |index: usize| {
            let place =
                DVec2::new((index as u32 % target.width).into(), (index as u32 / target.width).into());
            let Some(shown) = self.lens.pixel_of(target, place) else { return [0; N] };
            let (right, bottom) = (width as f64 - 1.0, height as f64 - 1.0);
            if !((0.0..=right).contains(&shown.x) && (0.0..=bottom).contains(&shown.y)) {
                return [0; N];
            }
            let (x, y) = (shown.x as usize, shown.y as usize);
            let (x1, y1) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
            let (u, v) = (shown.x - x as f64, shown.y - y as f64);
            let at = |x: usize, y: usize, channel: usize| f64::from(pixels[y * width + x][channel]);
            std::array::from_fn(|channel| {
                let top = at(x, y, channel) * (1.0 - u) + at(x1, y, channel) * u;
                let bottom = at(x, y1, channel) * (1.0 - u) + at(x1, y1, channel) * u;
                (top * (1.0 - v) + bottom * v).round() as u8
            })
        };
        (0..target.pixels()).into_par_iter().with_min_len(1 << 12).map(pixel).collect()
    }

    fn reduce<P: image::Pixel<Subpixel = u8> + 'static>(
        &self,
        full: ImageBuffer<P, Vec<u8>>,
    ) -> ImageBuffer<P, Vec<u8>> {
        let Camera { width, height, .. } = self.camera;
        match full.dimensions() == (width, height) {
            true => full,
            // Averages over the area of a pixel: no aliasing.
            false => resize(&full, width, height, FilterType::Triangle),
        }
    }
}

/// The camera of an image whose longer side is reduced to `max_size` pixels.
fn limited(camera: Camera, max_size: u32) -> Camera {
    let longer = camera.width.max(camera.height);
    if max_size == 0 || longer <= max_size {
        return camera;
    }
    let scale = f64::from(max_size) / f64::from(longer);
    let side = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    let (width, height) = (side(camera.width), side(camera.height));
    let (scale_x, scale_y) =
        (f64::from(width) / f64::from(camera.width), f64::from(height) / f64::from(camera.height));
    Camera {
        width,
        height,
        fx: camera.fx * scale_x,
        fy: camera.fy * scale_y,
        cx: (camera.cx + 0.5) * scale_x - 0.5,
        cy: (camera.cy + 0.5) * scale_y - 0.5,
        ..camera
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Distortion;
    use crate::testing;

    fn lens(distortion: Option<Distortion>) -> Lens {
        let own = testing::camera(0.0, (96, 72));
        Lens { camera: Camera { fx: 90.0, fy: 90.0, cx: 47.5, cy: 35.5, ..own }, distortion }
    }

    /// A picture whose gray values are a linear function of the ideal rays, as a lens shows them.
    fn photographed(lens: &Lens) -> Picture {
        let camera = &lens.camera;
        let gray = |index: u32| {
            let pixel = DVec2::new(f64::from(index % camera.width), f64::from(index / camera.width));
            let shown = camera.ray(pixel).truncate();
            let ideal =
                lens.distortion.map_or(Some(shown), |distortion| distortion.undistort(shown)).unwrap();
            (128.0 + 90.0 * ideal.x + 60.0 * ideal.y).round() as u8
        };
        let pixels = (0..camera.width * camera.height).map(gray).collect();
        Picture::from_gray(camera.width, camera.height, pixels).unwrap()
    }

    #[test]
    fn an_undistorted_and_reduced_photograph_shows_the_rays_of_its_camera() {
        let brown = Distortion::brown(&[-0.08, 0.02], [1e-3, -1e-3]);
        for (distortion, max_size) in [(Some(brown), 0), (Some(brown), 50), (None, 31)] {
            let change = Change::new(lens(distortion), max_size, "camera").unwrap();
            let changed = change.apply(&photographed(&lens(distortion))).unwrap();
            let camera = &change.camera;
            assert_eq!((changed.width(), changed.height()), (camera.width, camera.height));
            assert!(max_size == 0 || camera.width == max_size);
            let mask = change.mask(None);
            assert!(mask.iter().filter(|&&known| known).count() > mask.len() * 9 / 10);
            // The border of a reduced image is an average over less.
            for y in 2..camera.height - 2 {
                for x in 2..camera.width - 2 {
                    let ray = camera.ray(DVec2::new(x.into(), y.into()));
                    let expected = 128.0 + 90.0 * ray.x + 60.0 * ray.y;
                    let found = f64::from(changed.gray()[(y * camera.width + x) as usize]);
                    assert!((found - expected).abs() < 1.6, "{found} instead of {expected} at {x}, {y}");
                }
            }
        }
    }

    #[test]
    fn colors_are_changed_like_gray_values() {
        let lens = lens(Some(Distortion::brown(&[0.05], [0.0; 2])));
        let gray = photographed(&lens);
        let color = gray.gray().iter().map(|&gray| [gray; 3]).collect();
        let color = Picture::from_rgb(gray.width(), gray.height(), color).unwrap();
        let change = Change::new(lens, 40, "camera").unwrap();
        let (gray, color) = (change.apply(&gray).unwrap(), change.apply(&color).unwrap());
        assert!(color.color().unwrap().iter().zip(gray.gray()).all(|(color, gray)| color == &[*gray; 3]));
    }

    #[test]
    fn a_photograph_without_distortion_that_is_small_enough_stays_as_it_is() {
        assert!(Change::new(lens(None), 0, "camera").unwrap().is_none());
        assert!(Change::new(lens(None), 96, "camera").unwrap().is_none());
        assert!(!Change::new(lens(None), 95, "camera").unwrap().is_none());
    }

    #[test]
    fn a_pixel_that_shows_an_ignored_one_is_ignored() {
        let change = Change::new(lens(None), 48, "camera").unwrap();
        let ignored = 10 * 96 + 21;
        let mask: Vec<bool> = (0..96 * 72).map(|pixel| pixel != ignored).collect();
        let reduced = change.mask(Some(&mask));
        let out: Vec<usize> = (0..reduced.len()).filter(|&pixel| !reduced[pixel]).collect();
        assert_eq!(out, [5 * 48 + 10]);
    }
}
