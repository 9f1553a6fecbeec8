//! The verdicts of the check.

use super::*;
use crate::options::Options;
use crate::scene::PlaneMap;
use crate::simd::Scalar;
use crate::testing::World;

/// The pixel in the middle of the first view.
const MIDDLE: usize = 14 * 36 + 18;

fn options(ignore_occluders: bool) -> CheckOptions {
    CheckOptions {
        min_consistent_views: 2,
        min_consistent_fraction: 0.7,
        ignore_occluders,
        ..Options::paper().check
    }
}

fn rules(ignore_occluders: bool) -> ConsistencyRules {
    ConsistencyRules::new(&options(ignore_occluders), 5.0, 0.0)
}

/// Compares a plane at depth `scale` with a source view's own depth of `factor` times that and a normal
/// `degrees` away.
fn compare(rules: &ConsistencyRules, scale: f32, factor: f32, degrees: f32) -> (DepthComparison, bool) {
    let own = Vec3::new(degrees.to_radians().sin(), 0.0, -degrees.to_radians().cos());
    let depths = rules.compare(Scalar, [scale; LANES], [scale * factor; LANES], [100.0; LANES]);
    (depths, rules.is_same_normal(Vec3::NEG_Z, own))
}

const SAME: DepthComparison = DepthComparison { same: 0xff, ignored: 0 };
const OTHER: DepthComparison = DepthComparison { same: 0, ignored: 0 };
const IGNORED: DepthComparison = DepthComparison { same: 0, ignored: 0xff };

#[test]
fn planes_are_consistent_within_both_tolerances() {
    for rules in [true, false].map(rules) {
        for scale in [4.0, 4000.0] {
            let compare = |factor, degrees| compare(&rules, scale, factor, degrees);
            assert_eq!(compare(1.0, 0.0), (SAME, true));
            assert_eq!(compare(1.009, 29.0), (SAME, true));
            assert_eq!(compare(0.991, -29.0), (SAME, true));
            assert_eq!(compare(1.011, 0.0), (OTHER, true));
            assert_eq!(compare(1.0, 31.0), (SAME, false));
            assert_eq!(compare(1.0, -31.0), (SAME, false));
            // A source view without a depth counts as another depth.
            assert_eq!(compare(0.0, 0.0), (OTHER, true));
        }
    }
}

#[test]
fn at_a_small_parallax_depths_within_a_pixel_and_slants_within_a_pixel_at_the_rim_are_the_same() {
    let options = CheckOptions { reprojection_tolerance: 1.0, slant_tolerance: 1.0, ..options(true) };
    let rules = ConsistencyRules::new(&options, 5.0, 0.0);
    let same = |factor: f32, parallax: f32| {
        rules.compare(Scalar, [4.0; LANES], [4.0 * factor; LANES], [parallax; LANES]).same
    };
    // One pixel of 40 is 2.5 % of the depth, one of 400 a quarter of a percent: 1 % remains.
    assert_eq!([1.024, 1.026].map(|factor| same(factor, 40.0)), [0xff, 0]);
    assert_eq!([1.009, 1.011].map(|factor| same(factor, 400.0)), [0xff, 0]);
    // Without parallax any depth would do: at most 5 % are the same.
    assert_eq!([1.04, 1.06].map(|factor| same(factor, 0.0)), [0xff, 0]);
    // 1 px at 5 px, with a parallax of 40 px: a relative change of inverse depth of 0.005 a pixel.
    let slant = |size: f32| rules.is_same_slant(Vec2::new(size, 0.0), 40.0);
    assert!(slant(0.0049) && !slant(0.0051));
}

#[test]
fn errors_of_the_poses_widen_the_tolerance_and_leave_single_views_uncertain() {
    let options = CheckOptions { reprojection_tolerance: 1.0, few_views: 2, ..options(true) };
    let same = |residual: f32| {
        let rules = ConsistencyRules::new(&options, 5.0, residual);
        rules.compare(Scalar, [4.0; LANES], [4.0 * 1.02; LANES], [100.0; LANES]).same
    };
    assert_eq!([0.1, 0.3, 0.5].map(same), [0, 0, 0xff]);
    let parallax = |residual| ConsistencyRules::new(&options, 5.0, residual).min_parallax;
    assert_eq!(parallax(0.2), 0.0, "what matching alone leaves");
    assert!(parallax(0.5) > 100.0);
}

#[test]
fn one_certain_view_suffices_where_few_see_the_surface() {
    let options = CheckOptions { few_views: 2, min_consistent_fraction: 0.5, ..options(true) };
    let rules = ConsistencyRules::new(&options, 5.0, 0.0);
    assert!(rules.validates(1, 1, 1) && rules.validates(1, 1, 2) && rules.validates(2, 0, 4));
    assert!(!rules.validates(1, 0, 1) && !rules.validates(1, 1, 3) && !rules.validates(0, 0, 1));
}

#[test]
fn a_recheck_halves_the_depth_tolerance() {
    let recheck = rules(false).for_recheck();
    assert_eq!(compare(&recheck, 4.0, 1.0049, 29.0), (SAME, true));
    assert_eq!(compare(&recheck, 4.0, 1.0051, 0.0), (OTHER, true));
    assert_eq!(compare(&recheck, 4.0, 1.0, 31.0), (SAME, false));
}

#[test]
fn a_depth_in_front_is_ignored_or_counts_against_the_plane_as_in_the_paper() {
    for (ignore_occluders, in_front) in [(true, IGNORED), (false, OTHER)] {
        let rules = rules(ignore_occluders);
        assert_eq!(compare(&rules, 4.0, 0.985, 0.0).0, in_front);
        assert_eq!(compare(&rules, 4.0, 0.25, 80.0).0, in_front);
        // A depth behind is never ignored.
        assert_eq!(compare(&rules, 4.0, 1.25, 0.0).0, OTHER);
    }
}

#[test]
fn a_number_and_a_fraction_of_the_views_must_be_consistent() {
    let rules = |min_consistent_views, min_consistent_fraction| {
        let options = CheckOptions { min_consistent_views, min_consistent_fraction, ..options(true) };
        ConsistencyRules::new(&options, 5.0, 0.0)
    };
    let seventy = rules(2, 0.7);
    assert!(!seventy.validates(0, 0, 0));
    assert!(!seventy.validates(1, 0, 1));
    assert!(seventy.validates(2, 0, 2));
    assert!(!seventy.validates(2, 0, 3));
    assert!(seventy.validates(3, 0, 4));
    assert!(seventy.validates(7, 0, 10) && !seventy.validates(6, 0, 10));
    assert!(rules(2, 0.5).validates(2, 0, 4) && !rules(2, 0.5).validates(2, 0, 5));
    assert!(rules(3, 0.0).validates(3, 0, 100) && !rules(3, 0.0).validates(2, 0, 2));
}

/// The verdicts on the first view's planes against those of the other views.
fn verdicts(world: &World, maps: &[PlaneMap], view_sets: &ViewSets, ignore_occluders: bool) -> Vec<Verdict> {
    let check = ConsistencyCheck {
        problem: &world.problem(),
        planes: &maps[0].planes,
        view_sets,
        sources: maps[1..].iter().map(|map| &map.planes[..]).collect(),
        options: &options(ignore_occluders),
        window_radius: 5.0,
        is_recheck: false,
        level: SimdLevel::detect(),
        advance: &|_| Ok(()),
    };
    check.run().unwrap().0
}

/// The verdict on the exact wall in the middle when the depths of the first sources are multiplied by
/// these factors.
fn verdict_with(factors: &[f32], ignore_occluders: bool) -> Verdict {
    let world = World::five();
    let mut maps = world.exact();
    for (map, factor) in maps[1..].iter_mut().zip(factors) {
        map.planes.iter_mut().for_each(|plane| plane.depth *= factor);
    }
    verdicts(&world, &maps, &world.all_views(), ignore_occluders)[MIDDLE]
}

#[test]
fn the_views_of_a_pixel_s_set_are_counted() {
    assert_eq!(verdict_with(&[], true), (4, true));
    assert_eq!(verdict_with(&[1.05], true), (3, true));
    assert_eq!(verdict_with(&[1.05, 1.05], true), (2, false));
    // Two occluders are ignored, unless they count.
    assert_eq!(verdict_with(&[0.9, 0.9], true), (2, true));
    assert_eq!(verdict_with(&[0.9, 0.9], false), (2, false));
    assert_eq!(verdict_with(&[0.9, 0.9, 0.9], true), (1, false));
}

#[test]
fn views_outside_the_set_and_views_whose_image_the_point_leaves_do_not_count() {
    let world = World::five();
    let maps = world.exact();
    let pixels = maps[0].planes.len();
    let [mut two, mut one] = [ViewSets::empty(pixels, 4), ViewSets::empty(pixels, 4)];
    for pixel in 0..pixels {
        two.insert(pixel, 0);
        two.insert(pixel, 3);
        one.insert(pixel, 2);
    }
    assert_eq!(verdicts(&world, &maps, &one, true)[MIDDLE], (1, false));
    let verdicts = verdicts(&world, &maps, &two, true);
    assert_eq!(verdicts[MIDDLE], (2, true));
    let outside = verdicts.iter().filter(|verdict| verdict.0 < 2).count();
    assert!(outside > 0 && outside < pixels / 2, "{outside} of {pixels} are visible in one of the two only");
    assert!(verdicts.iter().all(|&(count, validated)| validated == (count == 2)));
}

#[test]
fn a_source_view_without_planes_does_not_count() {
    let world = World::five();
    let mut maps = world.exact();
    maps[1].planes = Vec::new();
    assert_eq!(verdicts(&world, &maps, &world.all_views(), true)[MIDDLE], (3, true));
}

#[test]
fn a_pixel_without_a_plane_is_not_validated() {
    let world = World::five();
    let mut maps = world.exact();
    maps[0].planes[MIDDLE].depth = 0.0;
    assert_eq!(verdicts(&world, &maps, &world.all_views(), true)[MIDDLE], (0, false));
}
