//! A cloud as a photograph shows it.

use skep::geometry::Camera;
use skep::image::Picture;

/// Half the side of the square of pixels that a disc of radius 1.5 pixels covers: the corners are nearer.
const REACH: i64 = 1;
/// Depths up to this are at the camera.
const LEAST_DEPTH: f64 = 1e-9;
/// Difference of gray values, in parts of white, above which they do not agree.
const TOLERANCE: f64 = 0.06;
/// Keeps the ratio of dark gray values finite.
const DARKEST: f64 = 1e-3;

/// The nearest points of a cloud in a photograph.
pub struct Rendering {
    width: usize,
    height: usize,
    /// Infinite where there is no point.
    depth: Vec<f64>,
    color: Vec<[u8; 3]>,
}

/// How a rendering agrees with a photograph.
pub struct Agreement {
    /// Share of pixels that carry a point.
    pub covered: f64,
    /// Share of pixels that carry one and agree.
    pub right: f64,
    /// Whether each pixel agrees.
    pub agrees: Vec<bool>,
}

impl Rendering {
    /// Projects points into a camera.
    pub fn new(camera: &Camera, positions: &[[f64; 3]], colors: &[[u8; 3]]) -> Rendering {
        let (width, height) = (camera.width as usize, camera.height as usize);
        let mut rendering = Rendering {
            width,
            height,
            depth: vec![f64::INFINITY; width * height],
            color: vec![[0; 3]; width * height],
        };
        for (&position, &color) in positions.iter().zip(colors) {
            let point = camera.to_camera(position.into());
            if point.z <= LEAST_DEPTH {
                continue;
            }
            let Some(place) = camera.project_camera(point) else { continue };
            // Conversions saturate; places far outside stay outside.
            let (column, row) = (place.x.round_ties_even() as i64, place.y.round_ties_even() as i64);
            rendering.draw(column, row, point.z, color);
        }
        rendering
    }

    fn draw(&mut self, column: i64, row: i64, depth: f64, color: [u8; 3]) {
        let (columns, rows) = (self.width as i64, self.height as i64);
        let span = |center: i64, side: i64| {
            center.saturating_sub(REACH).max(0)..center.saturating_add(REACH).saturating_add(1).min(side)
        };
        for row in span(row, rows) {
            for column in span(column, columns) {
                let pixel = (row * columns + column) as usize;
                if depth < self.depth[pixel] {
                    self.depth[pixel] = depth;
                    self.color[pixel] = color;
                }
            }
        }
    }

    /// Compares with the photograph, which has the size of the camera.
    pub fn compare(&self, photograph: &Picture) -> Agreement {
        let is_covered: Vec<bool> = self.depth.iter().map(|depth| depth.is_finite()).collect();
        let pixels = is_covered.len();
        let covered = is_covered.iter().filter(|is_covered| **is_covered).count();
        if covered == 0 {
            return Agreement { covered: 0.0, right: 0.0, agrees: vec![false; pixels] };
        }
        // Means of the covered pixels among 3x3, so that borders of holes do not count.
        let weights = self.means(|pixel| f64::from(u8::from(is_covered[pixel])));
        let means = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let sums = self.means(|pixel| if is_covered[pixel] { value(pixel) } else { 0.0 });
            sums.iter().zip(&weights).map(|(sum, weight)| sum / weight.max(1e-9)).collect()
        };
        let shown = means(&|pixel| gray(self.color[pixel]));
        let seen = means(&|pixel| gray(photograph.rgb(pixel)));
        let ratios = (0..pixels)
            .filter(|&pixel| is_covered[pixel])
            .map(|pixel| (seen[pixel] + DARKEST) / (shown[pixel] + DARKEST));
        let gain = super::scores::median(ratios.collect()).unwrap_or(1.0);
        let agrees: Vec<bool> = (0..pixels)
            .map(|pixel| is_covered[pixel] && (shown[pixel] * gain - seen[pixel]).abs() < TOLERANCE)
            .collect();
        let right = agrees.iter().filter(|agrees| **agrees).count();
        let share = |count: usize| count as f64 / pixels as f64;
        Agreement { covered: share(covered), right: share(right), agrees }
    }

    /// The mean of 3x3 pixels around each; at the borders pixels of the border count again.
    fn means(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        let values: Vec<f64> = (0..self.width * self.height).map(value).collect();
        let around =
            |center: usize, side: usize| [center.saturating_sub(1), center, (center + 1).min(side - 1)];
        let mut means = Vec::with_capacity(values.len());
        for row in 0..self.height {
            let rows = around(row, self.height);
            for column in 0..self.width {
                let columns = around(column, self.width);
                let of_row = |row: &usize| -> f64 {
                    columns.iter().map(|column| values[row * self.width + column]).sum()
                };
                means.push(rows.iter().map(of_row).sum::<f64>() / 9.0);
            }
        }
        means
    }

    /// The photograph, the rendering and the pixels that agree (white), beside each other.
    pub fn picture(&self, photograph: &Picture, agreement: &Agreement) -> skep::Result<Picture> {
        let mut pixels = Vec::with_capacity(3 * self.depth.len());
        for row in 0..self.height {
            let places = row * self.width..(row + 1) * self.width;
            pixels.extend(places.clone().map(|pixel| photograph.rgb(pixel)));
            pixels.extend_from_slice(&self.color[places.clone()]);
            pixels.extend(agreement.agrees[places].iter().map(|agrees| [if *agrees { 255 } else { 0 }; 3]));
        }
        Picture::from_rgb(3 * self.width as u32, self.height as u32, pixels)
    }
}

/// The luma of ITU-R BT.601, 1 for white.
fn gray([red, green, blue]: [u8; 3]) -> f64 {
    (0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue)) / 255.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    const CAMERA: Camera = Camera {
        width: 8,
        height: 6,
        fx: 4.0,
        fy: 4.0,
        cx: 3.0,
        cy: 2.0,
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    };

    #[test]
    fn the_nearest_point_is_in_front_of_nine_pixels() {
        let positions = [[0.0, 0.0, 2.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [f64::MAX, 0.0, 1.0]];
        let rendering = Rendering::new(&CAMERA, &positions, &[[9; 3], [200; 3], [1; 3], [2; 3]]);
        let covered = rendering.depth.iter().filter(|depth| depth.is_finite()).count();
        assert_eq!((covered, rendering.color[2 * 8 + 3]), (9, [200; 3]));
    }

    #[test]
    fn one_gain_for_the_view_makes_exposures_equal() {
        let positions = [[0.0, 0.0, 1.0]];
        let photograph = Picture::from_gray(8, 6, vec![120; 48]).unwrap();
        let agreement = Rendering::new(&CAMERA, &positions, &[[60; 3]]).compare(&photograph);
        assert_eq!((agreement.covered, agreement.right), (9.0 / 48.0, 9.0 / 48.0));
        let empty = Rendering::new(&CAMERA, &[], &[]).compare(&photograph);
        assert_eq!((empty.covered, empty.right), (0.0, 0.0));
    }
}
