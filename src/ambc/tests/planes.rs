//! Planes drawn, moved and shown.

use super::*;
use crate::ambc::random::Random;
use crate::matching::SourceProjector;
use crate::simd::Scalar;
use glam::Vec3;

#[test]
fn random_planes_fill_their_stratum_of_inverse_depth_and_face_the_camera() {
    let world = World::five();
    let problem = world.problem();
    let ray = problem.ray(3.0, 25.0);
    let mut random = Random::new(8, 9);
    let (nearest, farthest) = (1.0 / problem.range.near, 1.0 / problem.range.far);
    let strata = 5;
    for stratum in 0..strata {
        let part = (stratum as f32 / strata as f32, (stratum + 1) as f32 / strata as f32);
        let mut halves = [0; 2];
        for _ in 0..2000 {
            let food = FoodSource::random(&problem, ray, &mut random, part);
            let share = (1.0 / food.depth - farthest) / (nearest - farthest);
            assert!((part.0 - 1e-5..=part.1 + 1e-5).contains(&share), "{share} is not in {part:?}");
            assert!((problem.range.near..=problem.range.far).contains(&food.depth));
            assert!(food.normal.dot(ray) < 0.0 && (food.normal.length() - 1.0).abs() < 1e-5);
            halves[usize::from(share > (part.0 + part.1) / 2.0)] += 1;
        }
        assert!(halves.iter().all(|&count| count > 850), "{halves:?}");
    }
}

#[test]
fn one_random_plane_in_16_lies_beyond_a_likely_range_that_is_narrower() {
    let world = World::five();
    let mut problem = world.problem();
    problem.likely_range.near = 3.0;
    problem.likely_range.far = 6.0;
    let ray = problem.ray(3.0, 25.0);
    let mut random = Random::new(8, 9);
    let depths: Vec<f32> =
        (0..16000).map(|_| FoodSource::random(&problem, ray, &mut random, (0.0, 1.0)).depth).collect();
    let count = |is_there: &dyn Fn(f32) -> bool| depths.iter().filter(|&&depth| is_there(depth)).count();
    assert!((400..600).contains(&count(&|depth| depth < 3.0)));
    assert!((400..600).contains(&count(&|depth| depth > 6.0)));
    assert!(depths.iter().all(|&depth| problem.range.contains(depth)));
}

#[test]
fn a_plane_transferred_to_another_pixel_is_the_same_plane() {
    let world = World::five();
    let problem = world.problem();
    let from = wall(&world, PIXEL, 1.0);
    let ray = |(x, y): (usize, usize)| problem.ray(x as f32, y as f32);
    for to in [(19, 14), (18, 9), (16, 15), (0, 0), (35, 27)] {
        let offset = (to.0 as f32 - PIXEL.0 as f32, to.1 as f32 - PIXEL.1 as f32);
        let moved = from.transferred(&problem, ray(PIXEL), ray(to), offset).unwrap();
        assert!((moved.depth / wall(&world, to, 1.0).depth - 1.0).abs() < 1e-5);
        assert_eq!(moved.normal, from.normal);
    }
    let leaves_the_range = FoodSource::new(problem.range.near, Vec3::new(0.7, 0.0, -0.7).normalize());
    let outcomes = [(-5.0, (13, 14)), (5.0, (23, 14))]
        .map(|(dx, to)| leaves_the_range.transferred(&problem, ray(PIXEL), ray(to), (dx, 0.0)).is_some());
    assert!(outcomes[0] != outcomes[1], "one way the plane comes nearer than the range");
}

#[test]
fn a_validated_plane_shown_by_a_source_is_the_wall_between_its_pixels_too() {
    let mut world = World::five();
    let mut map = testing::exact(&world.cameras[1]);
    map.set_verdicts(&vec![(4, true); map.planes.len()]);
    world.surfaces[1] = map.publish(&world.cameras[1]);
    let problem = world.problem();
    let mut projector = SourceProjector::new(Scalar, &problem);
    projector.set_pixel_and_views(0.0, 0.0, &[0b11]);
    let group = &projector.groups()[0];
    let mut at = group.project(Scalar, 5.0);
    at.column[..2].fill(10.4);
    at.row[..2].fill(7.7);
    let shown = group.surfaces(Scalar, &at);
    assert_eq!(shown.nearest[0], world.surfaces[1][8 * 36 + 10].inverse_depth());
    assert_eq!(shown.known, 0b01);
    let camera = &world.cameras[1];
    let [a, b] = [8 * 36 + 10, 8 * 36 + 11].map(|pixel| 1.0 / testing::depth(camera, pixel));
    let up = 1.0 / testing::depth(camera, 7 * 36 + 10) - a;
    assert!((shown.exact[0] - (a + 0.4 * (b - a) + 0.3 * up)).abs() < 5e-6);
}
