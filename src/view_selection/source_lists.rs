//! The start set: views whose triangulation angle with the reference view lies in a band.

use crate::options::Options;
use crate::scene::{Scene, View};
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// The source views of every view.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SourceLists {
    /// For each view the indices of its source views: those in the band, smallest triangulation angle first, else
    /// those nearest to it.
    pub lists: Vec<Vec<u32>>,
    /// Views for which the band had to be left, and views without any source, in sentences.
    pub warnings: Vec<String>,
}

/// Angles by pair of views, the lower index first.
type SharedAngles = HashMap<(usize, usize), Vec<f64>>;

/// Fewer shared points than this say little: a false match has any angle.
const MIN_SHARED_POINTS: usize = 3;
/// The percentile of the angles at shared points that stands for the pair.
const ANGLE_PERCENTILE: f64 = 0.75;
/// Sources taken from outside the band when none lies in it: validation needs at least two.
const FALLBACK_SOURCES: usize = 2;

/// The start set of every view: all views that overlap with it and whose triangulation angle lies in the band of the
/// options, or the ones nearest to the band when none does.
pub fn source_lists(scene: &Scene, options: &Options) -> SourceLists {
    let shared = shared_angles(scene);
    let mut found = SourceLists::default();
    for (index, view) in scene.views().iter().enumerate() {
        if let Some(sources) = &view.sources {
            found.add(view, sources.clone(), options);
            continue;
        }
        let mut angles: Vec<(f64, u32)> = (0..scene.views().len())
            .filter(|&other| other != index)
            .filter_map(|other| Some((angle_of_pair(scene, &shared, index, other)?, other as u32)))
            .collect();
        angles.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (min, max) =
            (options.view_selection.min_triangulation_angle, options.view_selection.max_triangulation_angle);
        let in_band = |angle: f64| (min..=max).contains(&angle);
        let mut list: Vec<u32> = angles.iter().filter(|a| in_band(a.0)).map(|a| a.1).collect();
        if list.is_empty() {
            let distance = |angle: f64| (min - angle).max(angle - max);
            angles.sort_by(|a, b| distance(a.0).total_cmp(&distance(b.0)).then(a.1.cmp(&b.1)));
            angles.truncate(FALLBACK_SOURCES);
            found.warnings.push(describe_fallback(&view.name, &angles, options));
            list = angles.iter().map(|a| a.1).collect();
        }
        if options.view_selection.max_sources > 0 {
            list.truncate(options.view_selection.max_sources as usize);
        }
        found.add(view, list, options);
    }
    found
}

/// The triangulation angle between two views in degrees, as [`source_lists`] reckons it: the 75th percentile of the
/// angles at the sparse points both saw or, without enough of them, of those at the first view's middle depth; `None`
/// when they see nothing together.
pub fn triangulation_angle(scene: &Scene, reference: usize, source: usize) -> Option<f64> {
    angle_of_pair(scene, &shared_angles(scene), reference, source)
}

fn angle_of_pair(scene: &Scene, shared: &SharedAngles, reference: usize, source: usize) -> Option<f64> {
    match shared.get(&(reference.min(source), reference.max(source))) {
        Some(angles) if angles.len() >= MIN_SHARED_POINTS => percentile(angles.clone()),
        _ => percentile(angles_at_middle_depth(scene, reference, source)),
    }
}

impl SourceLists {
    /// The list of the next view, with a warning when it is too short for anything to be validated.
    fn add(&mut self, view: &View, list: Vec<u32>, options: &Options) {
        let needed = options.check.min_consistent_views as usize;
        if (1..needed).contains(&list.len()) {
            self.warnings.push(format!(
                "{} has {} source view(s), but {needed} must agree with a solution: nothing can be validated in it",
                view.name,
                list.len()
            ));
        }
        self.lists.push(list);
    }
}

fn describe_fallback(name: &str, taken: &[(f64, u32)], options: &Options) -> String {
    let (min, max) =
        (options.view_selection.min_triangulation_angle, options.view_selection.max_triangulation_angle);
    if taken.is_empty() {
        return format!("{name} overlaps with no other view: no depth can be found for it");
    }
    let angles: Vec<String> = taken.iter().map(|(angle, _)| format!("{angle:.1}")).collect();
    format!(
        "{name} has no source view with a triangulation angle of {min} to {max} degrees; the nearest were taken, at {} \
         degrees",
        angles.join(" and ")
    )
}

/// For each pair of views the angles, in degrees, at the sparse points both saw.
fn shared_angles(scene: &Scene) -> SharedAngles {
    let centers: Vec<DVec3> = scene.views().iter().map(|view| view.camera.center()).collect();
    let mut shared = SharedAngles::new();
    for point in scene.points() {
        let mut views: Vec<usize> = point.views.iter().map(|&view| view as usize).collect();
        views.sort_unstable();
        views.dedup();
        for (place, &a) in views.iter().enumerate() {
            for &b in &views[place + 1..] {
                let angle = (centers[a] - point.position).angle_between(centers[b] - point.position);
                shared.entry((a, b)).or_default().push(angle.to_degrees());
            }
        }
    }
    shared
}

/// Angles, in degrees, at points on rays of the reference view in the middle of its depth range that the other
/// view has in its image. Never between optical axes: parallel cameras would get none.
fn angles_at_middle_depth(scene: &Scene, reference: usize, other: usize) -> Vec<f64> {
    let camera = &scene.views()[reference].camera;
    let other = &scene.views()[other].camera;
    let range = scene.depth_range(reference);
    // The geometric mean: ranges given by hand are generous, and the harmonic one would lie at their near end.
    let depth = (range.near * range.far).sqrt();
    let steps = [0.1, 0.3, 0.5, 0.7, 0.9];
    let mut angles = Vec::new();
    for pixel in steps.iter().flat_map(|y| steps.map(|x| DVec2::new(x, *y))) {
        let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
        let point = camera.unproject(pixel * size, depth);
        let seen = other.project(point).and_then(|(pixel, _)| other.nearest_pixel(pixel));
        if seen.is_some() {
            angles.push((camera.center() - point).angle_between(other.center() - point).to_degrees());
        }
    }
    angles
}

fn percentile(mut angles: Vec<f64>) -> Option<f64> {
    angles.sort_by(f64::total_cmp);
    let last = angles.len().checked_sub(1)?;
    Some(angles[(last as f64 * ANGLE_PERCENTILE).round() as usize])
}
