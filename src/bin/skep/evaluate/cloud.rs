//! Clouds against true ones.

use super::arguments::{DistanceArguments, Outliers, Thinning};
use super::kd_tree::KdTree;
use super::scores::{Histogram, Rates};
use super::thinning::thin;
use super::work::Work;
use serde::Serialize;
use skep::{Error, Result};

/// Points whose neighbors are looked for at a time.
const CHUNK: usize = 1 << 14;

/// How distances are measured and counted.
pub struct Settings {
    /// Ascending distances below which a point is right.
    pub distances: Vec<f64>,
    pub max_distance: Option<f64>,
    pub outliers: Outliers,
    /// Spacings of the cloud and of the truth.
    pub voxels: [Option<f64>; 2],
    pub thinning: Thinning,
}

/// Values where the arguments say nothing.
pub struct Defaults {
    pub max_distance: Option<f64>,
    pub outliers: Outliers,
    pub voxel: Option<f64>,
    /// Whether the truth is thinned as the cloud is.
    pub thins_truth: bool,
    pub thinning: Thinning,
}

impl Settings {
    /// Checks the arguments.
    ///
    /// # Errors
    /// Distances and spacings that are not above 0.
    pub fn new(arguments: &DistanceArguments, defaults: &Defaults) -> Result<Settings> {
        let DistanceArguments { distances, max_distance, outliers, voxel, truth_voxel, thinning } = arguments;
        let numbers = [("--max-distance", max_distance), ("--voxel", voxel), ("--truth-voxel", truth_voxel)];
        let given = numbers.iter().filter_map(|(name, value)| value.map(|value| (*name, value)));
        for (name, value) in given.chain(distances.iter().map(|value| ("--distances", *value))) {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::argument(name, value, "a finite number above 0"));
            }
        }
        let mut distances = distances.clone();
        distances.sort_by(f64::total_cmp);
        let voxel = voxel.or(defaults.voxel);
        Ok(Settings {
            distances,
            max_distance: max_distance.or(defaults.max_distance),
            outliers: outliers.unwrap_or(defaults.outliers),
            voxels: [voxel, truth_voxel.or(if defaults.thins_truth { voxel } else { None })],
            thinning: thinning.unwrap_or(defaults.thinning),
        })
    }

    /// Thins a cloud to its spacing (0: that of the cloud, 1: that of the truth).
    pub fn thin(&self, work: &Work, points: Vec<[f64; 3]>, which: usize) -> Result<Vec<[f64; 3]>> {
        work.check()?;
        Ok(match self.voxels[which] {
            Some(size) => work.on_threads(|| thin(points, self.thinning, size)),
            None => points,
        })
    }

    /// The mean of the distances; `None` if none counts.
    fn mean(&self, distances: &[f64]) -> Option<f64> {
        let most = self.max_distance.unwrap_or(f64::INFINITY);
        let (mut sum, mut count) = (0.0, 0usize);
        for &distance in distances {
            if distance < most || self.outliers == Outliers::Clamp {
                sum += distance.min(most);
                count += 1;
            }
        }
        (count > 0 && sum.is_finite()).then(|| sum / count as f64)
    }
}

/// The points that are compared.
pub struct Sides<'a> {
    /// Points of the cloud whose distances to the truth count.
    pub judged: &'a [[f64; 3]],
    /// Points of the cloud that the truth is compared with.
    pub cloud: &'a [[f64; 3]],
    /// Points of the truth whose distances to the cloud count.
    pub wanted: &'a [[f64; 3]],
    /// Points of the truth that the cloud is compared with.
    pub truth: &'a [[f64; 3]],
}

/// The scores of a cloud.
#[derive(Serialize)]
pub struct CloudScores {
    /// Points in the file.
    pub points: usize,
    /// Points that were judged, after thinning and masks.
    pub judged_points: usize,
    /// Points of the truth that count, after thinning and masks.
    pub truth_points: usize,
    /// Mean distance from the cloud to the truth.
    pub accuracy: Option<f64>,
    /// Mean distance from the truth to the cloud.
    pub completeness: Option<f64>,
    /// The mean of both.
    pub overall: Option<f64>,
    pub thresholds: Vec<Rates>,
    /// Distances to the truth and to the cloud.
    #[serde(skip)]
    pub distances: [Histogram; 2],
}

/// Measures all distances.
///
/// # Errors
/// The user asked to stop.
pub fn compare(work: &Work, points: usize, sides: &Sides, settings: &Settings) -> Result<CloudScores> {
    let to_truth = nearest(work, "distances to the truth", sides.judged, sides.truth)?;
    let to_cloud = nearest(work, "distances to the cloud", sides.wanted, sides.cloud)?;
    let rate = |distances: &[f64], threshold: f64| {
        let right = distances.iter().filter(|distance| **distance < threshold).count();
        right as f64 / distances.len().max(1) as f64
    };
    let rates =
        |&threshold: &f64| Rates::new(threshold, rate(&to_cloud, threshold), rate(&to_truth, threshold));
    // Nothing judged is as far from the truth as counts.
    let clamped = settings.max_distance.filter(|_| settings.outliers == Outliers::Clamp);
    let accuracy = settings.mean(&to_truth).or(clamped.filter(|_| to_truth.is_empty()));
    let completeness = settings.mean(&to_cloud);
    let overall = accuracy.zip(completeness).map(|(accuracy, completeness)| (accuracy + completeness) / 2.0);
    let start = decade(&to_truth, &to_cloud) - 4;
    let histogram = |distances: &[f64]| {
        let mut histogram = Histogram::new(start, 5, 10);
        distances.iter().for_each(|distance| histogram.add(*distance));
        histogram
    };
    Ok(CloudScores {
        points,
        judged_points: sides.judged.len(),
        truth_points: sides.wanted.len(),
        accuracy,
        completeness,
        overall,
        thresholds: settings.distances.iter().map(rates).collect(),
        distances: [histogram(&to_truth), histogram(&to_cloud)],
    })
}

/// The distance of each point to the nearest of others; infinite if there are none.
fn nearest(work: &Work, what: &str, points: &[[f64; 3]], others: &[[f64; 3]]) -> Result<Vec<f64>> {
    work.check()?;
    if others.is_empty() {
        return Ok(vec![f64::INFINITY; points.len()]);
    }
    let tree = work.on_threads(|| KdTree::new(others.to_vec()));
    let chunks: Vec<&[[f64; 3]]> = points.chunks(CHUNK).collect();
    let distances = work.map(what, &chunks, |chunk| {
        Ok(chunk.iter().map(|point| tree.distance(point)).collect::<Vec<f64>>())
    })?;
    Ok(distances.concat())
}

/// The power of ten at or above most of the distances.
fn decade(to_truth: &[f64], to_cloud: &[f64]) -> i32 {
    let mut finite: Vec<f64> =
        to_truth.iter().chain(to_cloud).copied().filter(|distance| distance.is_finite()).collect();
    let place = finite.len() * 99 / 100;
    if finite.is_empty() {
        return 0;
    }
    let (_, most, _) = finite.select_nth_unstable_by(place, f64::total_cmp);
    if *most > 0.0 { most.log10().ceil() as i32 } else { 0 }
}

impl CloudScores {
    /// The lines to print.
    pub fn lines(&self, settings: &Settings) -> Vec<String> {
        let CloudScores { points, judged_points, truth_points, .. } = self;
        let number = |value: Option<f64>| value.map_or("none".to_owned(), |value| format!("{value:.4}"));
        let beyond = match (settings.max_distance, settings.outliers) {
            (None, _) => String::new(),
            (Some(most), Outliers::Clamp) => format!("  (distances above {most} count as {most})"),
            (Some(most), Outliers::Drop) => format!("  (without distances of {most} and more)"),
        };
        let mut lines = vec![
            format!("cloud: {points} points, of which {judged_points} count; truth: {truth_points} points"),
            format!("  accuracy {}", number(self.accuracy)),
            format!("  completeness {}", number(self.completeness)),
            format!("  overall {}{beyond}", number(self.overall)),
        ];
        if !self.thresholds.is_empty() {
            lines.push(Rates::header("within"));
            lines.extend(self.thresholds.iter().map(Rates::row));
        }
        lines
    }
}
