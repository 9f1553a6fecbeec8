//! Triangulation angles of pairs of views at the sparse points that they share.

use crate::scene::{Scene, Tracks};
use glam::DVec3;

/// Minimum number of shared points: with fewer, one false match decides the angle.
const MIN_SHARED_POINTS: usize = 3;
/// Quantile of the angles at the points that is the angle of the pair.
const ANGLE_QUANTILE: f64 = 0.75;

/// The triangulation angle of each pair of views that shares enough sparse points.
///
/// Time and memory are linear in the number of observations: of the long tracks of a large scene only some
/// pairs of views are taken (`Tracks::each_pair`), and the angles at the points of one view are kept at a
/// time.
#[derive(Debug, Default)]
pub(crate) struct SharedAngles {
    /// By view, its partners and the angles in degrees, by partner.
    partners: Vec<Vec<(u32, f64)>>,
}

impl SharedAngles {
    /// The angles of all pairs of views.
    pub(crate) fn new(scene: &Scene) -> SharedAngles {
        let centers: Vec<DVec3> = scene.views().iter().map(|view| view.camera.center()).collect();
        let tracks = Tracks::new(centers.len(), scene.points());
        let mut partners = vec![Vec::new(); centers.len()];
        // The angles at the points that the view shares with each one of a higher number, and which have any.
        let mut shared = vec![Vec::new(); centers.len()];
        let mut others = Vec::new();
        for view in 0..centers.len() {
            tracks.each_pair(view, |other, point| {
                let position = scene.points()[point].position;
                let angle = (centers[view] - position).angle_between(centers[other] - position);
                if shared[other].is_empty() {
                    others.push(other);
                }
                shared[other].push(angle.to_degrees());
            });
            others.sort_unstable();
            for other in others.drain(..) {
                if let Some(angle) = quantile(&mut shared[other], MIN_SHARED_POINTS) {
                    // Views are taken in ascending order, and so each list is ascending.
                    partners[view].push((other as u32, angle));
                    partners[other].push((view as u32, angle));
                }
                shared[other].clear();
            }
        }
        SharedAngles { partners }
    }

    /// The views that share enough points with a view, ascending.
    pub(crate) fn partners(&self, view: usize) -> impl Iterator<Item = u32> {
        self.partners.get(view).into_iter().flatten().map(|(partner, _)| *partner)
    }

    /// The angle of a pair; `None` where it shares too few points.
    pub(crate) fn angle(&self, view: usize, other: usize) -> Option<f64> {
        let partners = self.partners.get(view)?;
        let found = partners.binary_search_by_key(&(other as u32), |(partner, _)| *partner).ok()?;
        Some(partners[found].1)
    }
}

/// The angle of a pair with these angles at common points, which are reordered; `None` of fewer than `min`,
/// or of none.
pub(super) fn quantile(angles: &mut [f64], min: usize) -> Option<f64> {
    if angles.len() < min.max(1) {
        return None;
    }
    let place = ((angles.len() - 1) as f64 * ANGLE_QUANTILE).round() as usize;
    Some(*angles.select_nth_unstable_by(place, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DepthRange;
    use crate::image::Picture;
    use crate::scene::{SparsePoint, View};
    use crate::testing::looking_at;

    /// Views in a row of this length that see some points in front of it.
    fn scene(views: u32, length: f64, points: Vec<SparsePoint>) -> Scene {
        let camera = |view: u32| {
            let center = DVec3::X * length * f64::from(view) / f64::from(views);
            looking_at(center, center + DVec3::Z, (4, 3), 3.0)
        };
        let view = |index: u32| View {
            name: format!("view{index}"),
            picture: Picture::from_gray(4, 3, vec![0; 12]).unwrap().into(),
            camera: camera(index),
            mask: None,
            depth_range: Some(DepthRange { near: 1.0, far: 10.0 }),
            sources: None,
        };
        Scene::new((0..views).map(view).collect(), points).unwrap()
    }

    /// Points that lie apart, each seen by these views.
    fn points(count: u32, views: impl Fn(u32) -> Vec<u32>) -> Vec<SparsePoint> {
        let position = |point: u32| {
            let place = f64::from(point);
            DVec3::new((place * 0.618).fract() * 4.0, (place * 0.414).fract(), 4.0 + (place * 0.732).fract())
        };
        (0..count).map(|point| SparsePoint { position: position(point), views: views(point) }).collect()
    }

    /// The quantile of all angles at common points, from their sorted list.
    fn expected(scene: &Scene, view: u32, other: u32) -> Option<f64> {
        let has = |point: &&SparsePoint| point.views.contains(&view) && point.views.contains(&other);
        let to =
            |view: u32, point: &SparsePoint| scene.views()[view as usize].camera.center() - point.position;
        let angle = |point: &SparsePoint| to(view, point).angle_between(to(other, point)).to_degrees();
        let mut angles: Vec<f64> = scene.points().iter().filter(has).map(angle).collect();
        angles.sort_by(f64::total_cmp);
        (angles.len() >= 3).then(|| angles[((angles.len() - 1) as f64 * 0.75).round() as usize])
    }

    #[test]
    fn angles_of_ordinary_scenes_are_those_at_all_shared_points_to_the_bit() {
        // Tracks of 1 to 40 views that name some of them twice.
        let track = |point: u32| -> Vec<u32> {
            (0..1 + point % 40).map(|place| (point * 7 + place * (1 + point % 3)) % 45).collect()
        };
        let scene = scene(45, 4.0, points(120, track));
        let angles = SharedAngles::new(&scene);
        for view in 0..45 {
            let mut partners = Vec::new();
            for other in (0..45).filter(|&other| other != view) {
                let expected = expected(&scene, view.min(other), view.max(other));
                assert_eq!(angles.angle(view as usize, other as usize), expected, "{view} and {other}");
                partners.extend(expected.map(|_| other));
            }
            assert!(angles.partners(view as usize).eq(partners), "{view}");
        }
    }

    #[test]
    fn angles_of_long_tracks_are_about_those_at_all_shared_points() {
        // 32 million pairs, of which half are taken.
        let scene = scene(120, 4.0, points(10_000, |point| (point % 40..point % 40 + 80).collect()));
        let angles = SharedAngles::new(&scene);
        for (view, other) in [(40, 41), (45, 52), (45, 70), (41, 79), (60, 61), (20, 60)] {
            let expected = expected(&scene, view, other).unwrap();
            let found = angles.angle(view as usize, other as usize).unwrap();
            assert!((found / expected - 1.0).abs() < 0.01, "{found}, not {expected}");
        }
    }

    #[test]
    fn two_shared_points_are_too_few() {
        let angles = SharedAngles::new(&scene(3, 1.0, points(2, |_| vec![0, 1, 2])));
        assert_eq!(angles.angle(0, 1), None);
        assert_eq!(angles.partners(0).count(), 0);
        assert_eq!(SharedAngles::default().angle(0, 1), None);
    }
}
