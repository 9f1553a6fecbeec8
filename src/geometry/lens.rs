//! Real cameras: a pinhole camera behind a lens that distorts.

use super::{Camera, Distortion};
use crate::error::{Error, Result};
use glam::DVec2;

/// A calibrated camera with its lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Size, focal lengths, principal point and pose.
    pub camera: Camera,
    /// How the lens distorts; `None` for an ideal one.
    pub distortion: Option<Distortion>,
}

/// Bounds of the factor by which undistorting changes the sides of an image.
const MIN_SCALE: f64 = 0.2;
const MAX_SCALE: f64 = 2.0;

impl Lens {
    /// Returns an error unless every field is in its valid range; `name` names the camera in the error.
    pub fn check(&self, name: &str) -> Result<()> {
        self.camera.check(name)?;
        match self.distortion {
            Some(distortion) if !distortion.is_finite() => Err(Error::argument(
                format!("{name}.distortion"),
                format!("{distortion:?}"),
                "finite numbers",
            )),
            _ => Ok(()),
        }
    }

    /// The pixel of the photograph that shows the ray of a pixel of a pinhole camera with the same pose;
    /// `None` where the lens shows none.
    pub fn pixel_of(&self, pinhole: &Camera, pixel: DVec2) -> Option<DVec2> {
        let ideal = pinhole.ray(pixel).truncate();
        let shown = match self.distortion {
            None => ideal,
            Some(distortion) if distortion.is_regular(ideal) => distortion.distort(ideal),
            Some(_) => return None,
        };
        Some(self.to_pixel(shown))
    }

    /// The pinhole camera of the undistorted photograph: with the focal lengths of this one, and the largest
    /// size without pixels that the photograph does not show, as `colmap image_undistorter` chooses it.
    ///
    /// # Errors
    /// A distortion for which there is no such size.
    pub fn undistorted(&self, name: &str) -> Result<Camera> {
        let Some(distortion) = self.distortion else { return Ok(self.camera) };
        let camera = &self.camera;
        let (right, bottom) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
        // Where the undistorted borders come closest to the principal point.
        let ideal = |x: f64, y: f64| {
            let shown = DVec2::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy);
            let failed = || {
                let value = format!("one that shows nothing at column {x}, row {y}");
                Error::argument(format!("{name}.distortion"), value, "one that is valid in the whole image")
            };
            distortion.undistort(shown).map(|ideal| self.to_pixel(ideal)).ok_or_else(failed)
        };
        let rows = || (0..camera.height).map(f64::from);
        let columns = || (0..camera.width).map(f64::from);
        let left_most = largest(rows().map(|y| Ok(ideal(0.0, y)?.x)))?;
        let right_least = -largest(rows().map(|y| Ok(-ideal(right, y)?.x)))?;
        let top_most = largest(columns().map(|x| Ok(ideal(x, 0.0)?.y)))?;
        let bottom_least = -largest(columns().map(|x| Ok(-ideal(x, bottom)?.y)))?;
        // Distances of the borders from the principal point, here measured from the outer edge of the image.
        let (cx, cy) = (camera.cx + 0.5, camera.cy + 0.5);
        let scale = |center: f64, side: u32, first: f64, last: f64| {
            let before = center / (center - (first + 0.5));
            let after = (f64::from(side) - 0.5 - center) / (last + 0.5 - center);
            let scale = 1.0 / before.max(after);
            if scale.is_finite() && scale > 0.0 { scale.clamp(MIN_SCALE, MAX_SCALE) } else { MIN_SCALE }
        };
        let width =
            (scale(cx, camera.width, left_most, right_least) * f64::from(camera.width)).max(1.0) as u32;
        let height =
            (scale(cy, camera.height, top_most, bottom_least) * f64::from(camera.height)).max(1.0) as u32;
        Ok(Camera {
            width,
            height,
            cx: cx * f64::from(width) / f64::from(camera.width) - 0.5,
            cy: cy * f64::from(height) / f64::from(camera.height) - 0.5,
            ..*camera
        })
    }

    fn to_pixel(self, point: DVec2) -> DVec2 {
        let Camera { fx, fy, cx, cy, .. } = self.camera;
        DVec2::new(fx * point.x + cx, fy * point.y + cy)
    }
}

fn largest(mut values: impl Iterator<Item = Result<f64>>) -> Result<f64> {
    values.try_fold(f64::NEG_INFINITY, |largest, value| Ok(largest.max(value?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn lens(distortion: Option<Distortion>) -> Lens {
        let own = testing::camera(0.0, (640, 480));
        Lens { camera: Camera { fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5, ..own }, distortion }
    }

    #[test]
    fn an_ideal_lens_needs_no_other_camera() {
        let lens = lens(None);
        assert_eq!(lens.undistorted("camera"), Ok(lens.camera));
        let pixel = DVec2::new(17.5, 300.25);
        assert!(lens.pixel_of(&lens.camera, pixel).unwrap().distance(pixel) < 1e-9);
    }

    #[test]
    fn the_undistorted_camera_shows_only_what_the_photograph_shows() {
        for k in [-0.1, -0.05, 0.1] {
            let lens = lens(Some(Distortion::brown(&[k], [0.0; 2])));
            let pinhole = lens.undistorted("camera").unwrap();
            assert_eq!((pinhole.fx, pinhole.fy), (lens.camera.fx, lens.camera.fy));
            let (right, bottom) = (f64::from(pinhole.width) - 1.0, f64::from(pinhole.height) - 1.0);
            let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
            let middles =
                [(right / 2.0, 0.0), (0.0, bottom / 2.0), (right, bottom / 2.0), (right / 2.0, bottom)];
            for (x, y) in corners.into_iter().chain(middles) {
                let shown = lens.pixel_of(&pinhole, DVec2::new(x, y)).unwrap();
                let is_inside = (-1.0..=640.0).contains(&shown.x) && (-1.0..=480.0).contains(&shown.y);
                assert!(is_inside, "{k}: {shown} at {x}, {y}");
            }
        }
    }

    #[test]
    fn a_distortion_that_shows_nothing_at_the_border_is_refused() {
        let lens = lens(Some(Distortion::brown(&[-9.0], [0.0; 2])));
        let error = lens.undistorted("camera 3").unwrap_err().to_string();
        assert!(
            error.contains("camera 3.distortion") && error.contains("valid in the whole image"),
            "{error}"
        );
    }
}
