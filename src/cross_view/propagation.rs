//! Propagation across views (section 5.6.1 of the paper): consistent planes become candidates of pixels of
//! other views that have no validated plane.

use crate::ambc::Candidate;
use crate::error::Result;
use crate::geometry::{Camera, DepthRange, MIN_FACING, RelativePose};
use crate::parallel::Advance;
use crate::scene::PixelEstimate;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// A view whose planes are propagated.
#[derive(Clone, Copy)]
pub(crate) struct Donor<'a> {
    /// Its index in the scene: of candidates of equal cost that of the lowest view is taken.
    pub view: u32,
    /// Its camera on this scale.
    pub camera: &'a Camera,
    /// Its checked planes.
    pub planes: &'a [PixelEstimate],
}

/// The view that receives them.
#[derive(Clone, Copy)]
pub(crate) struct Target<'a> {
    /// Its camera on this scale.
    pub camera: &'a Camera,
    /// Its checked planes: validated pixels receive nothing.
    pub planes: &'a [PixelEstimate],
    /// The depths its planes must keep to.
    pub range: DepthRange,
}

/// Pixels that one thread takes at once; `advance` is told before each block.
const BLOCK: usize = 1 << 13;

/// The candidates of the pixels of a target view: for each pixel that is not validated, of all donors' planes
/// that project there and are consistent with at least one of their source views, the one of lowest cost. The
/// donors are added one after another; their order does not matter.
pub(crate) struct CandidateCollector<'a> {
    target: Target<'a>,
    /// The best so far of every pixel; empty before the first donor.
    best: Vec<Ranked>,
}

impl<'a> CandidateCollector<'a> {
    /// No candidates yet.
    pub(crate) fn new(target: Target<'a>) -> CandidateCollector<'a> {
        CandidateCollector { target, best: Vec::new() }
    }

    /// Adds the candidates from the planes of a donor.
    ///
    /// # Errors
    /// What `advance` returns.
    pub(crate) fn add(&mut self, donor: &Donor, advance: Advance) -> Result<()> {
        let starts: Vec<usize> = (0..donor.planes.len()).step_by(BLOCK).collect();
        let target = &self.target;
        let lists = starts.into_par_iter().map(|first| {
            advance(0)?;
            Ok(propagated(target, donor, first))
        });
        let lists: Vec<Vec<(usize, Ranked)>> = lists.collect::<Result<_>>()?;
        self.best.resize(target.camera.pixels(), Ranked::default());
        self.best.par_chunks_mut(BLOCK).enumerate().for_each(|(block, best)| {
            let (first, end) = (block * BLOCK, block * BLOCK + best.len());
            for list in &lists {
                let here = &list[list.partition_point(|(pixel, _)| *pixel < first)..];
                for (pixel, candidate) in here.iter().take_while(|(pixel, _)| *pixel < end) {
                    best[pixel - first].keep_better(candidate);
                }
            }
        });
        Ok(())
    }

    /// The pixels with a candidate, ascending.
    pub(crate) fn into_candidates(self) -> Vec<(u32, Candidate)> {
        let candidates = (0u32..).zip(self.best).map(|(pixel, ranked)| (pixel, ranked.candidate));
        candidates.filter(|(_, candidate)| candidate.depth > 0.0).collect()
    }
}

/// A candidate and the view it comes from.
#[derive(Debug, Clone, Copy, Default)]
struct Ranked {
    candidate: Candidate,
    view: u32,
}

impl Ranked {
    fn keep_better(&mut self, other: &Ranked) {
        let is_better = match (self.candidate.depth > 0.0, other.candidate.depth > 0.0) {
            (_, false) => false,
            (false, true) => true,
            (true, true) => (other.candidate.cost, other.view) < (self.candidate.cost, self.view),
        };
        if is_better {
            *self = *other;
        }
    }
}

/// The candidates from a block of a donor's pixels, by the pixels they project to.
fn propagated(target: &Target, donor: &Donor, first: usize) -> Vec<(usize, Ranked)> {
    let camera = target.camera;
    let pose = RelativePose::new(donor.camera, camera);
    let rotation = camera.rotation * donor.camera.rotation.transpose();
    let translation = camera.translation - rotation * donor.camera.translation;
    let grid = donor.camera.grid();
    let mut candidates = Vec::new();
    for (index, plane) in donor.planes.iter().enumerate().skip(first).take(BLOCK) {
        if plane.depth <= 0.0 || plane.consistent_views == 0 {
            continue;
        }
        let (x, y) = grid.position(index);
        let projection = pose.at_infinity(x as f32, y as f32) + pose.epipole / plane.depth;
        // Most planes project to validated pixels: the exact plane is computed for the others only.
        let pixel = nearest_pixel(camera, projection).filter(|&pixel| !target.planes[pixel].validated);
        let Some(pixel) = pixel else { continue };
        let ray = donor.camera.ray(DVec2::new(x as f64, y as f64));
        let point = rotation * (ray * f64::from(plane.depth)) + translation;
        let normal = rotation * plane.normal.as_dvec3();
        if let Some(depth) = depth_at(target, pixel, point, normal) {
            let candidate = Candidate { depth, normal: normal.as_vec3(), cost: plane.cost.into() };
            candidates.push((pixel, Ranked { candidate, view: donor.view }));
        }
    }
    candidates.sort_by_key(|(pixel, _)| *pixel);
    candidates
}

/// The pixel nearest to a homogeneous point, `None` behind the camera or outside its image.
fn nearest_pixel(camera: &Camera, point: Vec3) -> Option<usize> {
    let (x, y) = (point.x / point.z + 0.5, point.y / point.z + 0.5);
    let is_inside =
        point.z > 0.0 && x >= 0.0 && y >= 0.0 && x < camera.width as f32 && y < camera.height as f32;
    is_inside.then(|| camera.grid().index((x as usize, y as usize)))
}

/// The depth, exactly at a pixel, of a plane through a point of the target's frame; `None` where it is not
/// usable. In f64: the point may be far from the pixel's ray.
fn depth_at(target: &Target, pixel: usize, point: DVec3, normal: DVec3) -> Option<f32> {
    let (x, y) = target.camera.grid().position(pixel);
    let facing = normal.dot(target.camera.ray(DVec2::new(x as f64, y as f64)));
    let depth = normal.dot(point) / facing;
    let is_usable =
        facing < -f64::from(MIN_FACING) && depth >= target.range.near && depth <= target.range.far;
    is_usable.then_some(depth as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::PlaneMap;
    use crate::testing::{self, RANGE, World};

    /// A world, its target's planes, and the exact planes of the other views.
    fn target_and_donors() -> (World, PlaneMap, Vec<PlaneMap>) {
        let world = World::five();
        let mut maps = world.exact();
        let target = maps.remove(0);
        (world, target, maps)
    }

    /// The candidates of view 0 from views of these indices.
    fn propagated(world: &World, target: &PlaneMap, donors: &[(usize, &PlaneMap)]) -> Vec<Candidate> {
        within(RANGE, world, target, donors)
    }

    fn within(
        range: DepthRange,
        world: &World,
        target: &PlaneMap,
        donors: &[(usize, &PlaneMap)],
    ) -> Vec<Candidate> {
        let target = Target { camera: &world.cameras[0], planes: &target.planes, range };
        let mut collector = CandidateCollector::new(target);
        for &(view, map) in donors {
            let donor = Donor { view: view as u32, camera: &world.cameras[view], planes: &map.planes };
            collector.add(&donor, &|_| Ok(())).unwrap();
        }
        let mut found = vec![Candidate::default(); target.planes.len()];
        collector.into_candidates().into_iter().for_each(|(pixel, one)| found[pixel as usize] = one);
        found
    }

    fn count(candidates: &[Candidate]) -> usize {
        candidates.iter().filter(|candidate| candidate.depth > 0.0).count()
    }

    #[test]
    fn a_candidate_has_its_plane_s_depth_at_the_pixel_its_point_projects_to() {
        let (world, target, donors) = target_and_donors();
        let found = propagated(&world, &target, &[(1, &donors[0])]);
        let camera = &world.cameras[0];
        assert!(count(&found) > camera.pixels() / 2);
        for (pixel, candidate) in found.iter().enumerate().filter(|(_, candidate)| candidate.depth > 0.0) {
            // Points project beside the pixel's center, and the wall is slanted: only its plane is exact.
            assert!((candidate.depth / testing::depth(camera, pixel) - 1.0).abs() < 1e-5);
            assert!(candidate.normal.distance(testing::normal(camera)) < 1e-5);
            assert_eq!(
                candidate.cost,
                f32::from(PixelEstimate { cost: 0.1.into(), ..Default::default() }.cost)
            );
        }
    }

    #[test]
    fn a_single_plane_becomes_a_candidate_of_a_single_pixel() {
        let (world, target, mut donors) = target_and_donors();
        let source = 10 * 36 + 20;
        for (pixel, plane) in donors[0].planes.iter_mut().enumerate() {
            plane.consistent_views = u8::from(pixel == source);
        }
        let found = propagated(&world, &target, &[(1, &donors[0])]);
        let camera = &world.cameras[1];
        let depth = f64::from(donors[0].planes[source].depth);
        let point = camera.unproject(testing::place(camera, source), depth);
        let (x, y) = world.cameras[0].nearest_pixel(world.cameras[0].project(point).unwrap().0).unwrap();
        assert_eq!(count(&found), 1);
        assert!(found[(y * 36 + x) as usize].depth > 0.0);
    }

    #[test]
    fn validated_pixels_get_no_candidate() {
        let (world, mut target, donors) = target_and_donors();
        for plane in &mut target.planes[..500] {
            plane.validated = true;
        }
        let found = propagated(&world, &target, &[(1, &donors[0]), (2, &donors[1])]);
        assert_eq!(count(&found[..500]), 0);
        assert!(count(&found[500..]) > 250);
    }

    #[test]
    fn only_planes_that_a_source_view_confirmed_are_propagated() {
        let (world, target, mut donors) = target_and_donors();
        donors[0].planes.iter_mut().for_each(|plane| plane.consistent_views = 0);
        assert_eq!(count(&propagated(&world, &target, &[(1, &donors[0])])), 0);
        donors[0].planes.iter_mut().for_each(|plane| {
            *plane = PixelEstimate { consistent_views: 1, depth: 0.0, ..*plane };
        });
        assert_eq!(count(&propagated(&world, &target, &[(1, &donors[0])])), 0);
    }

    #[test]
    fn the_candidate_of_lowest_cost_is_kept_and_of_equals_that_of_the_lowest_view_in_any_order() {
        let (mut world, target, mut donors) = target_and_donors();
        // Views at the same position propagate the same points: their normals tell which one was kept.
        (world.cameras[2], world.cameras[3]) = (world.cameras[1], world.cameras[1]);
        let tilted = |map: &PlaneMap, x: f32, cost: f32| {
            let mut map = map.clone();
            map.planes.iter_mut().for_each(|plane| {
                let normal = (plane.normal + x * Vec3::X).normalize();
                *plane = PixelEstimate { normal, cost: cost.into(), ..*plane };
            });
            map
        };
        donors[1] = tilted(&donors[0], 0.1, 0.1);
        donors[2] = tilted(&donors[0], 0.2, 0.05);
        let (one, two, three) = ((1, &donors[0]), (2, &donors[1]), (3, &donors[2]));
        let only = |donor| propagated(&world, &target, &[donor]);
        assert_ne!(only(one), only(two));
        assert_eq!(propagated(&world, &target, &[one, two]), only(one));
        assert_eq!(propagated(&world, &target, &[two, one]), only(one));
        for order in [[one, two, three], [three, one, two], [two, three, one]] {
            assert_eq!(propagated(&world, &target, &order), only(three));
        }
    }

    #[test]
    fn without_donors_there_are_no_candidates() {
        let (world, target, _) = target_and_donors();
        assert_eq!(propagated(&world, &target, &[]), vec![Candidate::default(); target.planes.len()]);
    }

    #[test]
    fn a_plane_out_of_the_target_s_range_or_turned_away_is_not_propagated() {
        let (world, target, mut donors) = target_and_donors();
        let short = DepthRange { near: 1.0, far: 3.0 };
        assert_eq!(count(&within(short, &world, &target, &[(1, &donors[0])])), 0);
        donors[0].planes.iter_mut().for_each(|plane| plane.normal = -plane.normal);
        assert_eq!(count(&propagated(&world, &target, &[(1, &donors[0])])), 0);
    }
}
