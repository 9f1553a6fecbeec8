//! The source list of each view: the views whose triangulation angle with it lies in a range.

use super::shared_angles::{SharedAngles, quantile};
use crate::options::Options;
use crate::scene::{MAX_VIEWS_FOR_ALL_PAIRS, Scene, View, nearest_views};
use glam::{DVec2, DVec3};

/// The source lists of all views.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct SourceLists {
    /// For each view the indices of its source views: those with a triangulation angle in the range, smallest
    /// angle first; where there are none, those with the angles nearest to the range.
    pub lists: Vec<Vec<u32>>,
    /// One sentence for each view with source views outside the range, and for each one with too few source
    /// views.
    pub warnings: Vec<String>,
}

/// Number of source views taken from outside the range when none lies in it: validation needs at least two.
const FALLBACK_SOURCES: usize = 2;
/// The angle of the most useful source view, in degrees, and the spread of the logarithms of useful ones.
const BEST_ANGLE: f64 = 10.0;
const ANGLE_SPREAD: f64 = 0.8;
/// Angle between two source views, seen from the surface, in degrees, from which on they add to each other.
const SAME_DIRECTION: f64 = 2.0;
/// Largest ratio of an angle outside the range to the nearest one in it, of source views that are added.
const MAX_DISTANCE: f64 = 4.0;
/// Columns and rows of the points that stand for an image when there are no shared points, as fractions of
/// its sides.
const GRID_FRACTIONS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// The source list of every view: the one given with the scene, or else all views that overlap with it at a
/// triangulation angle in the range of the options; where there are none, those with the angles nearest to
/// the range.
///
/// All pairs of views are tried in a scene of at most 1,000 views. In a larger one a view is tried with those
/// that share sparse points with it, and with the 256 that have the nearest cameras.
pub(crate) fn source_lists(scene: &Scene, options: &Options) -> SourceLists {
    let are_given = scene.views().iter().all(|view| view.sources.is_some());
    let shared = if are_given { SharedAngles::default() } else { SharedAngles::new(scene) };
    source_lists_by_angle(scene, &shared, options)
}

/// [`source_lists`] for angles that are known.
pub(crate) fn source_lists_by_angle(scene: &Scene, shared: &SharedAngles, options: &Options) -> SourceLists {
    let centers: Vec<DVec3> = scene.views().iter().map(|view| view.camera.center()).collect();
    let mut lists = SourceLists::default();
    for (index, view) in scene.views().iter().enumerate() {
        if let Some(sources) = &view.sources {
            lists.add(view, sources.clone(), options);
            continue;
        }
        let pairs: Vec<Pair> = tried(&centers, shared, index)
            .into_iter()
            .filter_map(|other| Pair::new(scene, shared, index, other as usize))
            .collect();
        let list = select(scene, index, pairs, options);
        let inside = list.iter().filter(|pair| pair.is_inside(options)).count();
        if inside < list.len().min(2) || list.is_empty() {
            lists.warnings.push(describe_fallback(&view.name, &list, options));
        }
        let list = list.iter().map(|pair| pair.source).collect();
        lists.add(view, list, options);
    }
    lists
}

/// The triangulation angle of two views in degrees, as [`source_lists`] uses it: the 75th percentile of the
/// angles at the sparse points that both saw or, where these are fewer than three, at points in the middle of
/// the reference view's depth range; `None` where no such point is in both images.
pub(crate) fn triangulation_angle(
    scene: &Scene,
    shared: &SharedAngles,
    reference: usize,
    source: usize,
) -> Option<f64> {
    let at_middle_depth = || quantile(&mut angles_at_middle_depth(scene, reference, source), 1);
    shared.angle(reference, source).or_else(at_middle_depth)
}

/// The views that are tried as source views of a view.
fn tried(centers: &[DVec3], shared: &SharedAngles, view: usize) -> Vec<u32> {
    let mut tried = nearest_views(centers, view);
    if centers.len() > MAX_VIEWS_FOR_ALL_PAIRS {
        tried.extend(shared.partners(view));
        tried.sort_unstable();
        tried.dedup();
    }
    tried
}

impl SourceLists {
    /// Adds the list of the next view, with a warning where it is too short for any pixel to be validated.
    fn add(&mut self, view: &View, list: Vec<u32>, options: &Options) {
        let needed = options.check.min_consistent_views as usize;
        let is_few = list.len() <= options.check.few_views as usize;
        if (1..needed).contains(&list.len()) && !is_few {
            self.warnings.push(format!(
                "{} has {} source view(s), but {needed} must agree with a depth: none of its pixels can be \
                 validated",
                view.name,
                list.len()
            ));
        }
        self.lists.push(list);
    }
}

/// A reference view and a possible source view.
#[derive(Debug, Clone, Copy)]
struct Pair {
    source: u32,
    /// Triangulation angle in degrees.
    angle: f64,
}

impl Pair {
    fn new(scene: &Scene, shared: &SharedAngles, reference: usize, source: usize) -> Option<Pair> {
        let angle = triangulation_angle(scene, shared, reference, source)?;
        Some(Pair { source: source as u32, angle })
    }

    fn is_inside(&self, options: &Options) -> bool {
        self.distance(options) <= 1.0
    }

    /// The ratio of the angle to the nearest one in the range of the options.
    fn distance(&self, options: &Options) -> f64 {
        let options = &options.view_selection;
        (options.min_triangulation_angle / self.angle)
            .max(self.angle / options.max_triangulation_angle)
            .max(1.0)
    }

    /// How useful the source view is beside no other one.
    fn weight(&self) -> f64 {
        let ratio = (self.angle / BEST_ANGLE).ln() / ANGLE_SPREAD;
        (-0.5 * ratio * ratio).exp()
    }
}

/// The pairs whose source views are taken: those in the range of the options and, where these are too few,
/// the nearest outside; of too many, those that are the most useful beside each other. Inside before outside,
/// then by angle.
fn select(scene: &Scene, reference: usize, mut pairs: Vec<Pair>, options: &Options) -> Vec<Pair> {
    let rules = &options.view_selection;
    pairs.sort_by(|a, b| {
        let by_distance = a.distance(options).total_cmp(&b.distance(options));
        by_distance.then(a.angle.total_cmp(&b.angle)).then(a.source.cmp(&b.source))
    });
    let inside = pairs.iter().filter(|pair| pair.is_inside(options)).count();
    let most = if rules.max_sources == 0 { usize::MAX } else { rules.max_sources as usize };
    if inside <= most {
        let near = pairs.iter().filter(|pair| pair.distance(options) <= MAX_DISTANCE).count();
        let wanted = near.min(rules.min_sources as usize);
        let least = if inside == 0 { FALLBACK_SOURCES } else { inside };
        pairs.truncate(wanted.max(least).min(most));
        return pairs;
    }
    pairs.truncate(inside);
    let camera = &scene.views()[reference].camera;
    let range = scene.depth_range(reference);
    let center = camera.unproject(
        DVec2::new(f64::from(camera.width), f64::from(camera.height)) * 0.5,
        (range.near * range.far).sqrt(),
    );
    let direction = |pair: &Pair| scene.views()[pair.source as usize].camera.center() - center;
    let mut rest: Vec<(usize, f64)> = pairs.iter().map(Pair::weight).enumerate().collect();
    let mut selected = Vec::new();
    while selected.len() < most {
        // Of equal gains the last is the first in the list.
        let best = rest.iter().enumerate().rev().max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1));
        let Some((place, _)) = best else { break };
        let (best, _) = rest.remove(place);
        selected.push(best);
        for (other, gain) in &mut rest {
            let angle = direction(&pairs[*other]).angle_between(direction(&pairs[best])).to_degrees();
            // No number for a camera at the center itself: as if in the same direction.
            let apart = if angle.is_finite() { angle / SAME_DIRECTION } else { 0.0 };
            *gain *= 1.0 - (-0.5 * apart * apart).exp();
        }
    }
    selected.sort_unstable();
    selected.into_iter().map(|place| pairs[place]).collect()
}

fn describe_fallback(name: &str, fallback: &[Pair], options: &Options) -> String {
    let (min, max) =
        (options.view_selection.min_triangulation_angle, options.view_selection.max_triangulation_angle);
    if fallback.is_empty() {
        return format!("{name} overlaps with no other view: no depth can be estimated for it");
    }
    let count = match fallback.iter().any(|pair| pair.is_inside(options)) {
        true => "only one",
        false => "no",
    };
    let angles: Vec<String> = fallback.iter().map(|pair| format!("{:.1}", pair.angle)).collect();
    format!(
        "{name} has {count} source view with a triangulation angle of {min} to {max} degrees; those with the \
         nearest angles are used: {} degrees",
        angles.join(" and ")
    )
}

/// Triangulation angles, in degrees, at points on a grid of rays of the reference view, in the middle of its
/// depth range; only at points inside the other view's image. The angle of the optical axes will not do: it
/// is 0 for parallel cameras.
fn angles_at_middle_depth(scene: &Scene, reference: usize, source: usize) -> Vec<f64> {
    let camera = &scene.views()[reference].camera;
    let source = &scene.views()[source].camera;
    let range = scene.depth_range(reference);
    // The geometric mean: user-defined ranges are generous, and the harmonic mean lies at their near end.
    let depth = (range.near * range.far).sqrt();
    let mut angles = Vec::new();
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    for position in GRID_FRACTIONS.iter().flat_map(|y| GRID_FRACTIONS.map(|x| DVec2::new(x, *y))) {
        let point = camera.unproject(position * size, depth);
        let pixel = source.project(point).and_then(|(pixel, _)| source.nearest_pixel(pixel));
        if pixel.is_some() {
            angles.push((camera.center() - point).angle_between(source.center() - point).to_degrees());
        }
    }
    angles
}
