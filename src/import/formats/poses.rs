//! Rotations as files round them, and poses that are meant the other way round.

use crate::error::{Error, Result};
use crate::geometry::Lens;
use crate::import::SourceScene;
use crate::scene::SparsePoint;
use glam::{DMat3, DVec2, DVec3};
use std::path::Path;

/// Largest deviation of `R R^T` from the identity that rounding in a file explains.
const ROUNDING: f64 = 1e-3;
/// Points of a scene that are projected to judge its poses.
const SAMPLE: usize = 2000;
/// Poses are taken to be meant otherwise if less than the first share of the projections is as expected with
/// them, and more than the second one with the other meaning.
const DOUBTED: f64 = 0.5;
const CONVINCING: f64 = 0.8;

/// The axes of a camera in OpenGL: y up, z backward.
const FLIP: DMat3 = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));

/// How a format has its poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Convention {
    /// World to camera; y down, z forward.
    WorldToCamera,
    /// Camera to world; y up, z backward.
    CameraToWorldOpenGl,
}

/// A pose of the crate: world to camera.
type Pose = (DMat3, DVec3);

/// The name of a convention, and what makes the pose that was meant of the one that was understood.
type Alternative = (&'static str, fn(Pose) -> Pose);

/// The matrix of these rows.
pub(super) fn from_rows(rows: [[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(&rows).transpose()
}

/// The rotation that a matrix is up to the rounding of its numbers; `None` of one that is none.
pub(super) fn rotation(matrix: DMat3) -> Option<DMat3> {
    let deviation = |matrix: DMat3| {
        let difference = matrix * matrix.transpose() - DMat3::IDENTITY;
        difference.to_cols_array().iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
    };
    if !(matrix.is_finite() && deviation(matrix) < ROUNDING && matrix.determinant() > 0.0) {
        return None;
    }
    let mut rotation = matrix;
    // Newton's iteration for the nearest orthonormal matrix; it squares the deviation.
    while deviation(rotation) > 1e-14 {
        let next = rotation * 1.5 - rotation * rotation.transpose() * rotation * 0.5;
        if deviation(next) >= deviation(rotation) {
            break;
        }
        rotation = next;
    }
    Some(rotation)
}

/// What [`rotation`] expects, for error texts.
pub(super) const ROTATION: &str = "a rotation (orthonormal within 0.001, determinant 1)";

/// Looks at where the points of a scene project: if hardly any is where it should be, and nearly all were if
/// the poses had another convention than the format's, they were given in that one by mistake.
///
/// # Errors
/// Poses that were given in another convention. Where no convention explains the points, the scene gets a
/// warning.
pub(super) fn check(path: &Path, scene: &mut SourceScene, convention: Convention) -> Result<()> {
    let lenses: Vec<Lens> = scene.photographs.iter().map(|photograph| photograph.lens).collect();
    let points: Vec<&SparsePoint> = sample(&scene.points).collect();
    let share = |change: fn(Pose) -> Pose| {
        let changed: Vec<Lens> = lenses.iter().map(|lens| with_pose(lens, change)).collect();
        share_in_view(&changed, points.iter().copied())
    };
    let Some(given) = share(|pose| pose) else { return Ok(()) };
    if given >= DOUBTED {
        return Ok(());
    }
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let (expected, others) = convention.alternatives();
    for (meaning, change) in others {
        if let Some(found) = share(change).filter(|&found| found > CONVINCING) {
            return Err(Error::file(
                path,
                format!(
                    "the poses look like {meaning}; expected {expected}: as given, {} of the sparse points \
                     project into the photographs that should show them, and {} if they are {meaning}",
                    percent(given),
                    percent(found)
                ),
            ));
        }
    }
    scene.warnings.push(format!(
        "only {} of the sparse points project into the photographs that should show them; are the poses and \
         the points of the same scene, and the poses {expected}?",
        percent(given)
    ));
    Ok(())
}

impl Convention {
    /// Its name, and those it is mistaken for.
    fn alternatives(self) -> (&'static str, [Alternative; 3]) {
        match self {
            Convention::WorldToCamera => (
                "world-to-camera with y down and z forward",
                [
                    ("camera-to-world", inverse),
                    ("world-to-camera with OpenGL's axes (y up, z backward)", flipped),
                    ("camera-to-world with OpenGL's axes (y up, z backward)", |pose| flipped(inverse(pose))),
                ],
            ),
            Convention::CameraToWorldOpenGl => (
                "camera-to-world with OpenGL's axes (y up, z backward)",
                [
                    ("camera-to-world with OpenCV's axes (y down, z forward)", flipped),
                    ("world-to-camera", |pose| inverse(flipped(pose))),
                    ("world-to-camera with OpenGL's axes", |pose| flipped(inverse(flipped(pose)))),
                ],
            ),
        }
    }
}

fn inverse((rotation, translation): Pose) -> Pose {
    (rotation.transpose(), -(rotation.transpose() * translation))
}

/// The pose whose camera has the other axes.
fn flipped((rotation, translation): Pose) -> Pose {
    (FLIP * rotation, FLIP * translation)
}

/// The pose of a camera-to-world matrix with OpenGL's axes.
pub(super) fn from_open_gl(rotation: DMat3, center: DVec3) -> (DMat3, DVec3) {
    flipped(inverse((rotation, center)))
}

fn with_pose(lens: &Lens, change: fn(Pose) -> Pose) -> Lens {
    let (rotation, translation) = change((lens.camera.rotation, lens.camera.translation));
    Lens { camera: crate::geometry::Camera { rotation, translation, ..lens.camera }, ..*lens }
}

fn sample(points: &[SparsePoint]) -> impl Iterator<Item = &SparsePoint> {
    points.iter().step_by(points.len().div_ceil(SAMPLE).max(1))
}

/// The share of a scene's points that project into two photographs or more.
pub(super) fn share_in_two(scene: &SourceScene, transform: impl Fn(DVec3) -> DVec3) -> Option<f64> {
    let lenses: Vec<Lens> = scene.photographs.iter().map(|photograph| photograph.lens).collect();
    let moved = |point: &SparsePoint| SparsePoint { position: transform(point.position), views: Vec::new() };
    let points: Vec<SparsePoint> = sample(&scene.points).map(moved).collect();
    share_in_view(&lenses, points.iter())
}

/// The share of the views of points that show them; of points without views, the share that two photographs
/// show. `None` without points.
fn share_in_view<'a>(lenses: &[Lens], points: impl Iterator<Item = &'a SparsePoint>) -> Option<f64> {
    let (mut found, mut all) = (0_usize, 0_usize);
    let (mut found_without, mut all_without) = (0_usize, 0_usize);
    for point in points {
        if point.views.is_empty() {
            all_without += 1;
            let showing = lenses.iter().filter(|lens| shows(lens, point.position)).take(2);
            found_without += usize::from(showing.count() == 2);
        }
        for &view in &point.views {
            all += 1;
            found += usize::from(shows(&lenses[view as usize], point.position));
        }
    }
    let share = |found: usize, all: usize| (all > 0).then(|| found as f64 / all as f64);
    share(found, all).or(share(found_without, all_without))
}

/// Whether a photograph shows a point, or the surroundings of its border: calibrations are not exact.
fn shows(lens: &Lens, point: DVec3) -> bool {
    let camera = &lens.camera;
    let local = camera.to_camera(point);
    let ideal = local.truncate() / local.z;
    if !(local.z > 0.0 && ideal.is_finite()) {
        return false;
    }
    let shown = match lens.distortion {
        Some(distortion) if distortion.is_regular(ideal) => distortion.distort(ideal),
        Some(_) => return false,
        None => ideal,
    };
    let pixel = DVec2::new(camera.fx * shown.x + camera.cx, camera.fy * shown.y + camera.cy);
    let is_within = |place: f64, side: u32| {
        let side = f64::from(side);
        place > -0.05 * side && place < 1.05 * side
    };
    is_within(pixel.x, camera.width) && is_within(pixel.y, camera.height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::SourcePhotograph;
    use crate::testing::looking_at;

    /// Where the points are: around the origin some wrong poses would show them too.
    const MIDDLE: DVec3 = DVec3::new(8.0, -3.0, 2.0);

    /// Cameras on an arc around points, each of which saw all of them.
    fn scene(change: fn(Pose) -> Pose, has_tracks: bool) -> SourceScene {
        let photograph = |index: u32| {
            let angle = f64::from(index) * 0.3;
            let position = DVec3::new(5.0 * angle.sin(), 1.0 + 0.2 * angle, -5.0 * angle.cos());
            let camera = looking_at(MIDDLE + position, MIDDLE, (64, 48), 50.0);
            let (name, lens) = (format!("{index}.png"), Lens { camera, distortion: None });
            SourcePhotograph::new(name.clone(), name.into(), with_pose(&lens, change))
        };
        let point = |index: u32| {
            let angle = f64::from(index);
            let position = MIDDLE + DVec3::new(angle.sin(), 0.5 * (2.0 * angle).cos(), angle.cos());
            SparsePoint { position, views: if has_tracks { (0..5).collect() } else { Vec::new() } }
        };
        SourceScene {
            origin: "a test".to_owned(),
            photographs: (0..5).map(photograph).collect(),
            points: (0..40).map(point).collect(),
            workspace: None,
            warnings: Vec::new(),
        }
    }

    #[test]
    fn rounded_rotations_are_made_exact_and_other_matrices_refused() {
        let exact = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.2);
        let rounded = DMat3::from_cols_array(&exact.to_cols_array().map(|v| (v * 1e4).round() / 1e4));
        let found = rotation(rounded).unwrap();
        assert!((found * found.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-12));
        assert!(found.abs_diff_eq(exact, 1e-4));
        assert_eq!(rotation(exact * 1.01), None);
        assert_eq!(rotation(exact * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0))), None);
        assert_eq!(rotation(exact * f64::NAN), None);
    }

    #[test]
    fn poses_in_the_convention_of_the_format_pass() {
        for convention in [Convention::WorldToCamera, Convention::CameraToWorldOpenGl] {
            for has_tracks in [true, false] {
                let mut scene = scene(|pose| pose, has_tracks);
                check(Path::new("scene"), &mut scene, convention).unwrap();
                assert!(scene.warnings.is_empty());
            }
        }
    }

    #[test]
    fn poses_in_another_convention_are_named() {
        type Change = fn(Pose) -> Pose;
        let given: [(Change, Convention, &str); 4] = [
            (inverse, Convention::WorldToCamera, "the poses look like camera-to-world; expected world-to"),
            (flipped, Convention::WorldToCamera, "look like world-to-camera with OpenGL's axes"),
            (flipped, Convention::CameraToWorldOpenGl, "look like camera-to-world with OpenCV's axes"),
            // A world-to-camera matrix M with OpenCV's axes, read as the pose F M^-1.
            (|pose| flipped(inverse(pose)), Convention::CameraToWorldOpenGl, "look like world-to-camera;"),
        ];
        for (change, convention, expected) in given {
            for has_tracks in [true, false] {
                let error = check(Path::new("scene"), &mut scene(change, has_tracks), convention);
                let error = error.unwrap_err().to_string();
                assert!(error.contains(expected), "{error}");
            }
        }
    }

    #[test]
    fn points_of_another_scene_are_a_warning() {
        let mut scene = scene(|pose| pose, true);
        scene.points.iter_mut().for_each(|point| point.position.y += 1e4);
        check(Path::new("scene"), &mut scene, Convention::WorldToCamera).unwrap();
        assert!(scene.warnings[0].contains("only 0 % of the sparse points"), "{:?}", scene.warnings);
    }
}
