//! Geometric consistency check (section 5.6 of the paper): a solution is validated when enough of its source views found
//! the same surface.

use crate::error::{Error, Result};
use crate::geometry::ViewSets;
use crate::matching::{PREFETCH_DISTANCE, Problem, SourceProjector};
use crate::options::Options;
use crate::pipeline::Cancelled;
use crate::scene::{PixelEstimate, PlaneMap};
use crate::simd::{LANES, Simd, SimdLevel, Task, dispatch};
use glam::Vec3;
use rayon::prelude::*;

/// The thresholds of the check.
#[derive(Debug, Clone, Copy)]
pub struct ConsistencyRules {
    depth_tolerance: f32,
    min_normal_cosine: f32,
    min_consistent: usize,
    share: f32,
    occluders_abstain: bool,
}

/// How the depths that eight source views found compare with a solution's, as bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Depths {
    /// The source views that found the same depth.
    pub same: u8,
    /// Those that cannot speak: what they found lies in front and may hide the point from them.
    pub abstaining: u8,
}

impl ConsistencyRules {
    /// The thresholds of these options.
    pub fn new(options: &Options) -> ConsistencyRules {
        ConsistencyRules {
            depth_tolerance: options.check.depth_tolerance as f32,
            min_normal_cosine: options.check.normal_tolerance.to_radians().cos() as f32,
            min_consistent: options.check.min_consistent_views as usize,
            share: options.check.min_consistent_fraction as f32,
            occluders_abstain: options.check.ignore_occluders,
        }
    }

    /// The same with half of the tolerance of depths.
    pub fn closer(self) -> ConsistencyRules {
        ConsistencyRules { depth_tolerance: 0.5 * self.depth_tolerance, ..self }
    }

    /// Compares the depths of a solution in eight source views' frames with the source views' own, 0 where they have none.
    #[inline(always)]
    pub fn compare<S: Simd>(&self, simd: S, depth: S::F32, own: S::F32) -> Depths {
        let tolerance = simd.mul(simd.splat(self.depth_tolerance), depth);
        let (behind, before) = (simd.sub(own, depth), simd.sub(depth, own));
        let known = simd.simd_ge(own, simd.splat(f32::MIN_POSITIVE));
        let in_front = known & !simd.simd_ge(tolerance, before);
        Depths {
            same: known & !simd.simd_ge(behind, tolerance) & !simd.simd_ge(before, tolerance),
            abstaining: if self.occluders_abstain { in_front } else { 0 },
        }
    }

    /// Whether normals in the same frame agree.
    #[inline(always)]
    pub fn agree(&self, normal: Vec3, own: Vec3) -> bool {
        normal.dot(own) > self.min_normal_cosine
    }

    /// Whether this many consistent sources out of those that can speak validate a solution.
    #[inline(always)]
    pub fn validates(&self, consistent: usize, speaking: usize) -> bool {
        consistent >= self.min_consistent && consistent as f32 >= self.share * speaking as f32
    }
}

/// Checks every solution of a reference view against the sources of its view set; `sources` are their maps in the
/// order of the reference's list, `None` of one that cannot speak. Gives the number of consistent sources and whether
/// the solution is validated.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn check(
    level: SimdLevel,
    problem: &Problem,
    map: &PlaneMap,
    sources: &[Option<&PlaneMap>],
    rules: &ConsistencyRules,
    cancelled: Cancelled,
) -> Result<Vec<(u8, bool)>> {
    let found = sources.iter().map(|found| found.map_or(&[][..], |found| &found.solutions)).collect();
    dispatch(level, CheckTask { problem, map, found, rules, cancelled })
}

/// A check, eight sources at a time.
struct CheckTask<'a> {
    problem: &'a Problem<'a>,
    map: &'a PlaneMap,
    /// What the sources found, nothing of those that cannot speak.
    found: Vec<&'a [PixelEstimate]>,
    rules: &'a ConsistencyRules,
    cancelled: Cancelled<'a>,
}

/// Rows judged at once, between two looks whether to go on.
const BAND_ROWS: usize = 8;

impl Task for CheckTask<'_> {
    type Output = Result<Vec<(u8, bool)>>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let CheckTask { problem, map, .. } = &self;
        let width = problem.image.width;
        let mut verdicts = vec![(0, false); map.solutions.len()];
        let bands = verdicts.par_chunks_mut(BAND_ROWS * width).enumerate();
        bands.try_for_each(|(band, verdicts)| {
            if (self.cancelled)() {
                return Err(Error::Cancelled);
            }
            simd.vectorize(
                #[inline(always)]
                || {
                    let mut projector = SourceProjector::with_all_sources(simd, problem);
                    for (row, verdicts) in verdicts.chunks_exact_mut(width).enumerate() {
                        let y = band * BAND_ROWS + row;
                        for (x, verdict) in verdicts.iter_mut().enumerate() {
                            let pixel = y * width + x;
                            let solution = &map.solutions[pixel];
                            if solution.depth > 0.0 {
                                projector.set_pixel(x as f32, y as f32);
                                *verdict = self.judge(simd, &projector, map.sets.words_of(pixel), solution);
                            }
                        }
                    }
                },
            );
            Ok(())
        })?;
        Ok(verdicts)
    }
}

impl CheckTask<'_> {
    /// Asks the sources of a set about the solution of the pixel at which they are projections; those whose image it leaves
    /// abstain.
    #[inline(always)]
    fn judge<S: Simd>(
        &self,
        simd: S,
        projector: &SourceProjector<'_, S>,
        set: &[u32],
        solution: &PixelEstimate,
    ) -> (u8, bool) {
        let (mut consistent, mut speaking) = (0, 0);
        for (index, group) in projector.groups().iter().enumerate() {
            let projections = group.project(simd, solution.depth);
            let mut asked = projections.inside & ViewSets::eight(set, index);
            let places = group.nearest_pixels(simd, &projections);
            // All are looked up before any is judged: the look-ups, far apart in memory, then do not wait for each other.
            let mut owns = [0.0; LANES];
            for (lane, (own, found)) in owns.iter_mut().zip(&self.found[index * LANES..]).enumerate() {
                simd.prefetch(found, places[lane] as usize + PREFETCH_DISTANCE);
                match found.get(places[lane] as usize) {
                    Some(found) => *own = found.depth,
                    None => asked &= !(1 << lane),
                }
            }
            let depth = simd.mul(simd.load(&projections.center[2]), simd.splat(solution.depth));
            let Depths { same, abstaining } = self.rules.compare(simd, depth, simd.load(&owns));
            speaking += (asked & !abstaining).count_ones() as usize;
            let mut rest = asked & same;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize % LANES;
                rest &= rest - 1;
                let source = index * LANES + lane;
                let normal = self.problem.sources[source].rotation * solution.normal;
                let own = self.found[source][places[lane] as usize].normal;
                consistent += usize::from(self.rules.agree(normal, own));
            }
        }
        (consistent.min(255) as u8, self.rules.validates(consistent, speaking))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Scalar;
    use crate::testing::{World, changed};

    fn abstaining(occluders_abstain: bool) -> Options {
        changed(Options::default(), |o| {
            o.check.depth_tolerance = 0.01;
            o.check.normal_tolerance = 30.0;
            o.check.min_consistent_fraction = 0.7;
            o.check.min_consistent_views = 2;
            o.check.ignore_occluders = occluders_abstain;
        })
    }

    /// How a source view's own depth and the angle between normals compare with a solution at a depth of `scale`.
    fn compare(rules: &ConsistencyRules, scale: f32, factor: f32, degrees: f32) -> (Depths, bool) {
        let own = Vec3::new(degrees.to_radians().sin(), 0.0, -degrees.to_radians().cos());
        let depths = rules.compare(Scalar, [scale; LANES], [scale * factor; LANES]);
        (depths, rules.agree(Vec3::NEG_Z, own))
    }

    const SAME: Depths = Depths { same: 0xff, abstaining: 0 };
    const OTHER: Depths = Depths { same: 0, abstaining: 0 };
    const ABSTAINING: Depths = Depths { same: 0, abstaining: 0xff };

    #[test]
    fn a_source_agrees_within_both_tolerances() {
        for rules in [true, false].map(|abstain| ConsistencyRules::new(&abstaining(abstain))) {
            for scale in [4.0, 4000.0] {
                let compare = |factor, degrees| compare(&rules, scale, factor, degrees);
                assert_eq!(compare(1.0, 0.0), (SAME, true));
                assert_eq!(compare(1.009, 29.0), (SAME, true));
                assert_eq!(compare(0.991, -29.0), (SAME, true));
                assert_eq!(compare(1.011, 0.0), (OTHER, true));
                assert_eq!(compare(1.0, 31.0), (SAME, false));
                assert_eq!(compare(1.0, -31.0), (SAME, false));
                // A source without a solution speaks against.
                assert_eq!(compare(0.0, 0.0), (OTHER, true));
            }
        }
    }

    #[test]
    fn closer_rules_halve_the_tolerance_of_depths() {
        let closer = ConsistencyRules::new(&abstaining(false)).closer();
        assert_eq!(compare(&closer, 4.0, 1.0049, 29.0), (SAME, true));
        assert_eq!(compare(&closer, 4.0, 1.0051, 0.0), (OTHER, true));
        assert_eq!(compare(&closer, 4.0, 1.0, 31.0), (SAME, false));
    }

    #[test]
    fn what_lies_in_front_abstains_or_speaks_against_as_in_the_paper() {
        for (abstain, in_front) in [(true, ABSTAINING), (false, OTHER)] {
            let rules = ConsistencyRules::new(&abstaining(abstain));
            assert_eq!(compare(&rules, 4.0, 0.985, 0.0).0, in_front);
            assert_eq!(compare(&rules, 4.0, 0.25, 80.0).0, in_front);
            // What lies behind never abstains.
            assert_eq!(compare(&rules, 4.0, 1.25, 0.0).0, OTHER);
        }
    }

    #[test]
    fn enough_sources_and_a_share_of_them_must_agree() {
        let rules = |min_consistent, consistent_share| {
            ConsistencyRules::new(&changed(Options::default(), |o| {
                o.check.min_consistent_views = min_consistent;
                o.check.min_consistent_fraction = consistent_share;
            }))
        };
        let seventy = rules(2, 0.7);
        assert!(!seventy.validates(0, 0));
        assert!(!seventy.validates(1, 1));
        assert!(seventy.validates(2, 2));
        assert!(!seventy.validates(2, 3));
        assert!(seventy.validates(3, 4));
        assert!(seventy.validates(7, 10) && !seventy.validates(6, 10));
        assert!(rules(2, 0.5).validates(2, 4) && !rules(2, 0.5).validates(2, 5));
        assert!(rules(3, 0.0).validates(3, 100) && !rules(3, 0.0).validates(2, 2));
    }

    /// The verdicts on the exact wall when the depths of the first sources are multiplied by these factors, at the pixel
    /// in the middle.
    fn checked(factors: &[f32], occluders_abstain: bool) -> (u8, bool) {
        let world = World::five();
        let mut maps = world.exact();
        for (map, factor) in maps[1..].iter_mut().zip(factors) {
            map.solutions.iter_mut().for_each(|solution| solution.depth *= factor);
        }
        let sources: Vec<Option<&PlaneMap>> = maps[1..].iter().map(Some).collect();
        let rules = ConsistencyRules::new(&abstaining(occluders_abstain));
        let verdicts =
            check(SimdLevel::detect(), &world.problem(), &maps[0], &sources, &rules, &|| false).unwrap();
        assert_eq!(verdicts.len(), maps[0].solutions.len());
        verdicts[14 * 36 + 18]
    }

    #[test]
    fn the_sources_of_a_pixel_s_set_are_asked() {
        assert_eq!(checked(&[], true), (4, true));
        assert_eq!(checked(&[1.05], true), (3, true));
        assert_eq!(checked(&[1.05, 1.05], true), (2, false));
        // Two occluders do not count, unless they vote.
        assert_eq!(checked(&[0.9, 0.9], true), (2, true));
        assert_eq!(checked(&[0.9, 0.9], false), (2, false));
        assert_eq!(checked(&[0.9, 0.9, 0.9], true), (1, false));
    }

    #[test]
    fn sources_outside_the_set_and_outside_their_image_are_not_asked() {
        let world = World::five();
        let mut maps = world.exact();
        let pixels = maps[0].solutions.len();
        let [mut two, mut one] = [ViewSets::empty(pixels, 4), ViewSets::empty(pixels, 4)];
        for pixel in 0..pixels {
            two.insert(pixel, 0);
            two.insert(pixel, 3);
            one.insert(pixel, 2);
        }
        let rules = ConsistencyRules::new(&abstaining(true));
        let mut verdicts = |sets: ViewSets| {
            maps[0].sets = sets;
            let sources: Vec<Option<&PlaneMap>> = maps[1..].iter().map(Some).collect();
            check(SimdLevel::detect(), &world.problem(), &maps[0], &sources, &rules, &|| false).unwrap()
        };
        let middle = 14 * 36 + 18;
        assert_eq!(verdicts(one)[middle], (1, false));
        let verdicts = verdicts(two);
        assert_eq!(verdicts[middle], (2, true));
        let outside = verdicts.iter().filter(|verdict| verdict.0 < 2).count();
        assert!(outside > 0 && outside < pixels / 2, "{outside} of {pixels} are seen by one of the two only");
        assert!(verdicts.iter().all(|&(count, validated)| validated == (count == 2)));
    }

    #[test]
    fn a_pixel_without_a_solution_is_not_validated() {
        let world = World::five();
        let mut maps = world.exact();
        maps[0].solutions[14 * 36 + 18].depth = 0.0;
        let sources: Vec<Option<&PlaneMap>> = maps[1..].iter().map(Some).collect();
        let rules = ConsistencyRules::new(&abstaining(true));
        assert_eq!(
            check(SimdLevel::detect(), &world.problem(), &maps[0], &sources, &rules, &|| false).unwrap()
                [14 * 36 + 18],
            (0, false)
        );
    }
}
