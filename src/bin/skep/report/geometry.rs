//! The geometry of the capture: which views overlap, and the angles between their rays.

use super::run_files::RunFiles;
use glam::{DVec3, dvec2};
use serde_json::{Value, json};
use skep::geometry::Camera;
use std::collections::HashMap;

/// Views of a track that are paired with each other, at most: long tracks would take quadratic time.
const LONGEST_TRACK: usize = 32;
/// Width of the bins of the histogram of angles, in degrees.
const BIN: f64 = 2.0;
/// Number of bins; the last one has all larger angles.
const BINS: usize = 31;
/// Pairs in the graph of the page for each view: those with the most points.
const LINKS: usize = 6;
/// Pairs of each view whose angles count where the report names no source views.
const SOURCES: usize = 10;

/// A pair of views.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pair {
    /// Sparse points that both see.
    pub shared: u32,
    /// Sum of the angles between the rays at those points, in degrees.
    sum: f64,
}

impl Pair {
    /// The mean angle.
    fn angle(self) -> Option<f64> {
        (self.shared > 0).then(|| self.sum / f64::from(self.shared))
    }
}

/// What is known of the capture.
pub struct Geometry {
    /// By the lower and the higher view.
    pairs: HashMap<(u32, u32), Pair>,
    /// By view, its source views.
    pub sources: Vec<Vec<u32>>,
    /// By view, the mean angle to each source view, where it is known.
    pub angles: Vec<Vec<f64>>,
    /// By view, the number of sparse points that it sees.
    pub points: Vec<u32>,
    /// By view, the number of its part of the graph of shared points.
    pub parts: Vec<usize>,
    /// Whether the angles are at sparse points, not at the middle of the depths.
    pub has_tracks: bool,
    pub up: DVec3,
}

impl Geometry {
    /// Finds the pairs. `middles` are depths in the middle of each view's surface, where they are known.
    pub fn new(files: &RunFiles, middles: &[Option<f64>]) -> Geometry {
        let images = &files.model.images;
        let centers: Vec<DVec3> = images.iter().map(|image| image.camera.center()).collect();
        let mut pairs: HashMap<(u32, u32), Pair> = HashMap::new();
        let mut points = vec![0; images.len()];
        for point in &files.model.points {
            let step = point.views.len().div_ceil(LONGEST_TRACK).max(1);
            let views: Vec<u32> = point.views.iter().copied().step_by(step).collect();
            point.views.iter().for_each(|&view| points[view as usize] += 1);
            for (place, &first) in views.iter().enumerate() {
                for &second in &views[place + 1..] {
                    let pair = pairs.entry((first.min(second), first.max(second))).or_default();
                    pair.shared += 1;
                    pair.sum += angle(point.position, centers[first as usize], centers[second as usize]);
                }
            }
        }
        let sources = sources(files, &pairs);
        let angle_of = |view: usize, source: u32| {
            let key = ((view as u32).min(source), (view as u32).max(source));
            let at_middle = || {
                let camera = &images[view].camera;
                let point = camera.unproject(center_pixel(camera), middles[view]?);
                Some(angle(point, centers[view], centers[source as usize]))
            };
            pairs.get(&key).and_then(|pair| pair.angle()).or_else(at_middle)
        };
        let angles = sources
            .iter()
            .enumerate()
            .map(|(view, sources)| sources.iter().filter_map(|&source| angle_of(view, source)).collect())
            .collect();
        let parts = parts(images.len(), pairs.keys().copied());
        let ups: DVec3 = images.iter().map(|image| -image.camera.rotation.row(1)).sum();
        // Cameras all around look up nowhere in common.
        let up = if ups.length() > 0.2 * images.len() as f64 { ups.normalize() } else { DVec3::NEG_Y };
        Geometry { has_tracks: !pairs.is_empty(), pairs, sources, angles, points, parts, up }
    }

    /// The angles of a view in ascending order.
    pub fn sorted_angles(&self, view: usize) -> Vec<f64> {
        let mut sorted = self.angles[view].clone();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted
    }

    /// What the page shows of it.
    pub fn facts(&self) -> Value {
        let mut bins = [0_u64; BINS];
        for angle in self.angles.iter().flatten() {
            bins[((angle / BIN) as usize).min(BINS - 1)] += 1;
        }
        let mut links: Vec<(u32, u32, u32, f64)> = Vec::new();
        let mut by_view: Vec<Vec<(u32, u32)>> = vec![Vec::new(); self.sources.len()];
        for (&(first, second), pair) in &self.pairs {
            by_view[first as usize].push((pair.shared, second));
            by_view[second as usize].push((pair.shared, first));
        }
        for (view, others) in by_view.iter_mut().enumerate() {
            others.sort_unstable_by(|a, b| b.cmp(a));
            for &(shared, other) in others.iter().take(LINKS) {
                let key = ((view as u32).min(other), (view as u32).max(other));
                let angle = self.pairs[&key].angle().unwrap_or_default();
                links.push((key.0, key.1, shared, (angle * 10.0).round() / 10.0));
            }
        }
        links.sort_unstable_by_key(|link| (link.0, link.1));
        links.dedup_by_key(|link| (link.0, link.1));
        json!({
            "bin": BIN,
            "bins": bins,
            "links": links,
            "has_tracks": self.has_tracks,
            "parts": self.parts.iter().max().map_or(0, |last| last + 1),
        })
    }
}

fn center_pixel(camera: &Camera) -> glam::DVec2 {
    dvec2(f64::from(camera.width - 1) / 2.0, f64::from(camera.height - 1) / 2.0)
}

/// The angle at a point between two others, in degrees.
fn angle(at: DVec3, first: DVec3, second: DVec3) -> f64 {
    (first - at).angle_between(second - at).to_degrees()
}

/// The source views that the report names; without it, the views with the most shared points.
fn sources(files: &RunFiles, pairs: &HashMap<(u32, u32), Pair>) -> Vec<Vec<u32>> {
    let images = &files.model.images;
    let numbers: HashMap<&str, u32> =
        images.iter().zip(0..).map(|(image, number)| (image.name.as_str(), number)).collect();
    let mut lists = vec![Vec::new(); images.len()];
    for (&(first, second), pair) in pairs {
        lists[first as usize].push((pair.shared, second));
        lists[second as usize].push((pair.shared, first));
    }
    let of_view = |(view, mut strongest): (usize, Vec<(u32, u32)>)| {
        let named = files.view_report(view).and_then(|report| report["sources"].as_array());
        if let Some(names) = named {
            let number = |name: &Value| numbers.get(name.as_str()?).copied();
            return names.iter().filter_map(number).collect();
        }
        strongest.sort_unstable_by(|a, b| b.cmp(a));
        strongest.into_iter().take(SOURCES).map(|(_, view)| view).collect()
    };
    lists.into_iter().enumerate().map(of_view).collect()
}

/// By view, the number of the part of the graph that it is in.
fn parts(views: usize, pairs: impl Iterator<Item = (u32, u32)>) -> Vec<usize> {
    let mut neighbors = vec![Vec::new(); views];
    for (first, second) in pairs {
        neighbors[first as usize].push(second as usize);
        neighbors[second as usize].push(first as usize);
    }
    let mut parts = vec![usize::MAX; views];
    let mut count = 0;
    for start in 0..views {
        if parts[start] != usize::MAX {
            continue;
        }
        let mut waiting = vec![start];
        parts[start] = count;
        while let Some(view) = waiting.pop() {
            for &other in &neighbors[view] {
                if parts[other] == usize::MAX {
                    parts[other] = count;
                    waiting.push(other);
                }
            }
        }
        count += 1;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_the_graph_are_numbered_by_their_first_view() {
        assert_eq!(parts(5, [(0, 2), (3, 4), (2, 4)].into_iter()), [0, 1, 0, 0, 0]);
        assert_eq!(parts(0, std::iter::empty()), [0; 0]);
    }

    #[test]
    fn angles_are_those_between_the_rays() {
        let at = DVec3::new(0.0, 0.0, 5.0);
        assert!((angle(at, DVec3::ZERO, DVec3::new(5.0, 0.0, 0.0)) - 45.0).abs() < 1e-9);
    }
}
