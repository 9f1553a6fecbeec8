//! The points that the page shows: a sample of the fused cloud, quantised.

use super::cloud_files::{self, SampledPoint};
use super::map_samples::SampleGrid;
use super::thumbnails::{Samples, Thumbnails};
use glam::DVec3;
use serde_json::{Value, json};
use skep::geometry::Camera;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// Largest relative difference between a point's depth in a view and the depth sample there whose confidence
/// it takes.
const SAME_DEPTH: f64 = 0.03;
/// Bytes of a point: three coordinates of two bytes, three of color, two of the normal, and one each for the
/// number of views and the confidence.
pub const POINT_BYTES: usize = 13;
/// Steps of confidences; 0 stands for none.
const CONFIDENCE_STEPS: f64 = 254.0;

/// The points of the page.
pub struct Cloud {
    points: Vec<SampledPoint>,
    /// Points of the cloud that they are a sample of.
    of: u64,
    /// `fused`, or `views` for validated pixels of the views that are finished.
    source: &'static str,
    has_views: bool,
    /// By point, the sum of the confidences in its views, in thousandths, and their number.
    confidences: Vec<[AtomicU32; 2]>,
}

impl Cloud {
    /// Reads a sample of a fused cloud.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(path: &Path, most: usize) -> io::Result<Cloud> {
        let mut found = cloud_files::sample(path, most)?;
        // Clouds of other programs may have such points, which would leave no box for the others.
        found.points.retain(|point| DVec3::from(point.position).is_finite());
        let confidences = found.points.iter().map(|_| Default::default()).collect();
        Ok(Cloud {
            points: found.points,
            of: found.of,
            source: "fused",
            has_views: found.has_views,
            confidences,
        })
    }

    /// A cloud of the samples of views, while there is no fused one.
    pub fn of_views() -> Cloud {
        Cloud { points: Vec::new(), of: 0, source: "views", has_views: true, confidences: Vec::new() }
    }

    /// Whether it is a sample of the fused cloud.
    pub fn is_fused(&self) -> bool {
        self.source == "fused"
    }

    /// By view, its points.
    pub fn points_by_view(&self, views: usize) -> Vec<Vec<u32>> {
        let mut lists = vec![Vec::new(); views];
        for (index, point) in self.points.iter().enumerate() {
            for &view in &point.views {
                if let Some(list) = lists.get_mut(view as usize) {
                    list.push(index as u32);
                }
            }
        }
        lists
    }

    /// Adds the confidences of a view to some points that it sees.
    pub fn add_confidences(&self, points: &[u32], camera: &Camera, grid: SampleGrid, samples: &Samples) {
        if samples.confidence.is_empty() || samples.depth.is_empty() {
            return;
        }
        for &point in points {
            let Some((pixel, depth)) = camera.project(DVec3::from(self.points[point as usize].position))
            else {
                continue;
            };
            let Some(pixel) = camera.nearest_pixel(pixel) else { continue };
            let index = grid.index(camera, pixel);
            let own = f64::from(samples.depth[index]);
            if (own - depth).abs() <= SAME_DEPTH * depth {
                let [sum, count] = &self.confidences[point as usize];
                sum.fetch_add((samples.confidence[index] * 1000.0).round() as u32, Ordering::Relaxed);
                count.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// Adds at most `most` validated samples of a view as points.
    pub fn add_samples(&mut self, view: u32, camera: &Camera, thumbnails: &Thumbnails, most: usize) {
        let Thumbnails { grid, samples, .. } = thumbnails;
        let valid: Vec<usize> =
            (0..samples.depth.len()).filter(|&index| samples.depth[index] > 0.0).collect();
        let to_world = camera.rotation.transpose();
        for place in cloud_files::places(valid.len() as u64, most) {
            let index = valid[place as usize];
            let cell = ((index % grid.columns as usize) as u32, (index / grid.columns as usize) as u32);
            let (x, y) = grid.pixel(camera, cell);
            let position = camera.unproject(glam::dvec2(x.into(), y.into()), samples.depth[index].into());
            let component = |axis: usize| samples.normal.get(axis * grid.len() + index).copied();
            let normal = std::array::from_fn(|axis| f64::from(component(axis).unwrap_or_default()));
            let count = samples.sources.get(index).map_or(0, |&count| usize::from(count));
            self.points.push(SampledPoint {
                position: position.to_array(),
                normal: (to_world * DVec3::from(normal)).to_array().map(|component| component as f32),
                color: samples.color.get(index).copied().unwrap_or([128; 3]),
                // Which they are does not matter here.
                views: vec![view; count],
            });
            let confidence = samples.confidence.get(index);
            let sum = confidence.map_or(0, |confidence| (confidence * 1000.0).round() as u32);
            self.confidences.push([sum.into(), u32::from(confidence.is_some()).into()]);
        }
        self.of += valid.len() as u64;
    }

    /// Keeps so many points at most.
    pub fn thin(&mut self, most: usize) {
        let places = cloud_files::places(self.points.len() as u64, most);
        if places.len() == self.points.len() {
            return;
        }
        self.points = places.iter().map(|&place| std::mem::take(&mut self.points[place as usize])).collect();
        self.confidences =
            places.iter().map(|&place| std::mem::take(&mut self.confidences[place as usize])).collect();
    }

    /// What the page needs to know of the points, and the points: all coordinates, all colors, all normals,
    /// all numbers of views, all confidences.
    pub fn encode(&self, up: DVec3) -> (Value, Vec<u8>) {
        let positions = || self.points.iter().map(|point| DVec3::from(point.position));
        let min = positions().fold(DVec3::INFINITY, DVec3::min);
        let max = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
        let (min, size) = if self.points.is_empty() { (DVec3::ZERO, DVec3::ZERO) } else { (min, max - min) };
        let mut bytes = Vec::with_capacity(POINT_BYTES * self.points.len());
        for position in positions() {
            for axis in 0..3 {
                let share = (position[axis] - min[axis]) / size[axis].max(f64::MIN_POSITIVE);
                bytes.extend(((share * 65535.0).round() as u16).to_le_bytes());
            }
        }
        bytes.extend(self.points.iter().flat_map(|point| point.color));
        bytes.extend(self.points.iter().flat_map(|point| octahedral(point.normal)));
        bytes.extend(self.points.iter().map(|point| point.views.len().min(255) as u8));
        bytes.extend(self.confidences.iter().map(confidence_number));
        let facts = json!({
            "points": self.points.len(),
            "of": self.of,
            "source": self.source,
            "min": min.to_array(),
            "size": size.to_array(),
            "up": up.to_array(),
            "has_views": self.has_views && self.points.iter().any(|point| !point.views.is_empty()),
            "has_confidence": self.confidences.iter().any(|known| known[1].load(Ordering::Relaxed) > 0),
        });
        (facts, bytes)
    }
}

/// 0 for none, else 1 and the steps of the mean.
fn confidence_number([sum, count]: &[AtomicU32; 2]) -> u8 {
    let (sum, count) = (sum.load(Ordering::Relaxed), count.load(Ordering::Relaxed));
    if count == 0 {
        return 0;
    }
    let mean = f64::from(sum) / 1000.0 / f64::from(count);
    1 + (mean.clamp(0.0, 1.0) * CONFIDENCE_STEPS).round() as u8
}

/// A unit normal in the octahedral encoding, two bytes; the zero vector gives the direction of z.
fn octahedral([x, y, z]: [f32; 3]) -> [u8; 2] {
    let length = (x.abs() + y.abs() + z.abs()).max(f32::MIN_POSITIVE);
    let (mut u, mut v) = (x / length, y / length);
    if z < 0.0 {
        let sign = |value: f32| if value < 0.0 { -1.0 } else { 1.0 };
        (u, v) = ((1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v));
    }
    [u, v].map(|value| (value * 127.0 + 128.0).round().clamp(1.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octahedral_normals_are_read_back_within_a_degree() {
        let decoded = |[u, v]: [u8; 2]| {
            let (u, v) = ((f64::from(u) - 128.0) / 127.0, (f64::from(v) - 128.0) / 127.0);
            let z = 1.0 - u.abs() - v.abs();
            let fold = (-z).max(0.0);
            DVec3::new(u - fold * u.signum(), v - fold * v.signum(), z).normalize()
        };
        for index in 0..500 {
            let turn = f64::from(index);
            let z = (turn * 0.37).sin();
            let (x, y) = ((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin());
            let normal = DVec3::new(x, y, z);
            let found = decoded(octahedral(normal.to_array().map(|component| component as f32)));
            assert!(found.dot(normal) > 1f64.to_radians().cos(), "{normal} became {found}");
        }
    }

    #[test]
    fn points_are_quantised_in_their_box_and_thinned_evenly() {
        let mut cloud = Cloud::of_views();
        for index in 0..1000 {
            let position = [f64::from(index), 2.0, -f64::from(index) * 2.0];
            cloud.points.push(SampledPoint { position, ..SampledPoint::default() });
            cloud.confidences.push([AtomicU32::new(1500), AtomicU32::new(2)]);
        }
        cloud.thin(100);
        let (facts, bytes) = cloud.encode(DVec3::Z);
        assert_eq!((facts["points"].as_u64(), bytes.len()), (Some(100), 100 * POINT_BYTES));
        assert_eq!(facts["has_views"], false);
        assert!(facts["size"][0].as_f64().unwrap() > 950.0 && facts["size"][1] == 0.0);
        let coordinate = |offset: usize| u16::from_le_bytes([bytes[offset], bytes[offset + 1]]);
        assert_eq!((coordinate(0), coordinate(99 * 6), coordinate(4)), (0, 65535, 65535));
        assert_eq!(bytes[12 * 100], 1 + 191, "the mean of the confidences, 0.75");
    }
}
