//! Depth maps against true ones.

use super::scores::{Histogram, Rates, median, share};
use super::truth::Truth;
use super::view_sets::ViewSets;
use super::work::Work;
use serde::Serialize;
use skep::io::{Grid, MapKind, ModelImage, Workspace, read_depth_map, read_normal_map};
use skep::{Error, Result};
use std::path::Path;

/// Relative error of depths whose normals are compared.
const NORMAL_THRESHOLD: f64 = 0.01;

/// The scores of all maps.
#[derive(Serialize)]
pub struct DepthScores {
    /// Maps that are there, of views with true depths.
    pub maps: usize,
    /// Pixels with true depth that have an estimate.
    pub fill: f64,
    pub thresholds: Vec<Rates>,
    /// Degrees, over the depths within 1 %.
    pub median_normal_angle: Option<f64>,
    /// The source views of the pixels, where the workspace has consistency graphs.
    pub view_sets: Option<ViewSets>,
    pub views: Vec<ViewScores>,
    #[serde(skip)]
    pub tally: Tally,
}

/// The scores of a view.
#[derive(Serialize)]
pub struct ViewScores {
    pub name: String,
    /// Whether the workspace has its map.
    pub has_map: bool,
    pub fill: f64,
    pub thresholds: Vec<Rates>,
}

/// Counts of pixels.
#[derive(Clone)]
pub struct Tally {
    /// Pixels with true depth.
    pub truth: u64,
    /// Pixels with an estimate.
    pub estimated: u64,
    /// Pixels with both.
    pub both: u64,
    /// Right pixels for each threshold.
    right: Vec<u64>,
    /// Relative errors of the pixels with both.
    pub errors: Histogram,
}

impl Tally {
    fn new(thresholds: &[f64]) -> Tally {
        let right = vec![0; thresholds.len()];
        Tally { truth: 0, estimated: 0, both: 0, right, errors: Histogram::new(-5, 5, 10) }
    }

    fn add(&mut self, other: &Tally) {
        self.truth += other.truth;
        self.estimated += other.estimated;
        self.both += other.both;
        self.right.iter_mut().zip(&other.right).for_each(|(own, other)| *own += other);
        self.errors.merge(&other.errors);
    }

    fn rates(&self, thresholds: &[f64]) -> Vec<Rates> {
        let rates = |(&threshold, &right): (&f64, &u64)| {
            Rates::new(threshold, share(right, self.truth), share(right, self.estimated))
        };
        thresholds.iter().zip(&self.right).map(rates).collect()
    }
}

/// What a view contributes.
struct View {
    has_map: bool,
    tally: Tally,
    angles: Vec<f64>,
}

/// Compares the maps of all views that have true ones; a map that is missing counts as empty.
///
/// # Errors
/// Damaged maps; maps of other sizes than the true ones; no true map; the user asked to stop.
pub fn score(
    work: &Work,
    workspace: &Workspace,
    kind: MapKind,
    images: &[ModelImage],
    truth: &Truth,
    thresholds: &[f64],
) -> Result<DepthScores> {
    let found = work
        .map("depth maps compared", images, |image| view(workspace, kind, &image.name, truth, thresholds))?;
    let mut tally = Tally::new(thresholds);
    let (mut angles, mut views, mut maps) = (Vec::new(), Vec::new(), 0);
    for (image, view) in images.iter().zip(found) {
        let Some(view) = view else { continue };
        tally.add(&view.tally);
        angles.extend(view.angles);
        maps += usize::from(view.has_map);
        views.push(ViewScores {
            name: image.name.clone(),
            has_map: view.has_map,
            fill: share(view.tally.both, view.tally.truth),
            thresholds: view.tally.rates(thresholds),
        });
    }
    if views.is_empty() {
        let problem = format!(
            "no map of a view; expected names like {}.png",
            Path::new(&images[0].name).with_extension("").display()
        );
        return Err(Error::file(truth.folder(), problem));
    }
    Ok(DepthScores {
        maps,
        fill: share(tally.both, tally.truth),
        thresholds: tally.rates(thresholds),
        median_normal_angle: median(angles),
        view_sets: None,
        views,
        tally,
    })
}

/// Compares the maps of one view; `None` if it has no true depths.
fn view(
    workspace: &Workspace,
    kind: MapKind,
    name: &str,
    truth: &Truth,
    thresholds: &[f64],
) -> Result<Option<View>> {
    let Some(expected) = truth.depth(name)? else { return Ok(None) };
    let mut tally = Tally::new(thresholds);
    tally.truth = expected.values.iter().filter(|depth| **depth > 0.0).count() as u64;
    let path = workspace.depth_map(name, kind);
    if !path.is_file() {
        return Ok(Some(View { has_map: false, tally, angles: Vec::new() }));
    }
    let found = read_depth_map(&path)?;
    require_size(&path, &found, &expected)?;
    // NaN where one of the two is missing, which no threshold takes.
    let mut errors = vec![f64::NAN; found.values.len()];
    for ((error, &depth), &expected) in errors.iter_mut().zip(&found.values).zip(&expected.values) {
        if depth <= 0.0 {
            continue;
        }
        tally.estimated += 1;
        if expected > 0.0 {
            *error = (f64::from(depth) - f64::from(expected)).abs() / f64::from(expected);
            tally.both += 1;
            tally.errors.add(*error);
            for (right, threshold) in tally.right.iter_mut().zip(thresholds) {
                *right += u64::from(*error < *threshold);
            }
        }
    }
    let angles = angles(&workspace.normal_map(name, kind), truth, name, &errors)?;
    Ok(Some(View { has_map: true, tally, angles }))
}

/// The angles between estimated and true normals of the pixels whose depths are right, in degrees.
fn angles(path: &Path, truth: &Truth, name: &str, errors: &[f64]) -> Result<Vec<f64>> {
    let Some(expected) = truth.normals(name)? else { return Ok(Vec::new()) };
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let found = read_normal_map(path)?;
    require_size(path, &found, &expected)?;
    if found.values.len() != errors.len() {
        return Err(Error::file(path, "the map has another size than the depth map"));
    }
    let pairs = found.values.iter().zip(&expected.values).zip(errors);
    let right = pairs.filter(|(_, error)| **error < NORMAL_THRESHOLD);
    Ok(right.map(|((&found, &expected), _)| angle(found, expected)).collect())
}

fn angle(a: [f32; 3], b: [f32; 3]) -> f64 {
    let (a, b) = (glam::Vec3::from(a).as_dvec3(), glam::Vec3::from(b).as_dvec3());
    let cosine = a.dot(b) / (a.length() * b.length()).max(1e-9);
    cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

fn require_size<A, B>(path: &Path, found: &Grid<A>, expected: &Grid<B>) -> Result<()> {
    if (found.width, found.height) == (expected.width, expected.height) {
        return Ok(());
    }
    let expected = format!("{}x{}, the size of the true map", expected.width, expected.height);
    Err(Error::file(path, format!("the map is {}x{}; expected {expected}", found.width, found.height)))
}

impl DepthScores {
    /// The lines to print.
    pub fn lines(&self, kind: MapKind) -> Vec<String> {
        let (views, kind) = (self.views.len(), kind.colmap_name());
        let mut lines = vec![
            format!("depth maps: {} {kind} ones, of {views} views with true depths", self.maps),
            format!("  fill {:.4}", self.fill),
            Rates::header("within"),
        ];
        lines.extend(self.thresholds.iter().map(Rates::row));
        if let Some(angle) = self.median_normal_angle {
            lines.push(format!("  normals: median angle {angle:.3} degrees, of depths within 1 %"));
        }
        if let Some(ViewSets { precision, recall }) = self.view_sets {
            lines.push(format!("  source views: precision {precision:.4}, recall {recall:.4}"));
        }
        lines
    }
}
