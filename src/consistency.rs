//! Geometric consistency check (section 5.6 of the paper): a solution is validated when enough of its source views found
//! the same surface.

use crate::error::{Error, Result};
use crate::options::Options;
use crate::progress::Cancelled;
use crate::state::{Solution, ViewState};
use crate::views::{Reference, Source};
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

/// What a source view says of a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It found the same surface.
    Consistent,
    /// It found another one.
    Inconsistent,
    /// It cannot speak: what it found lies in front and may hide the point from it.
    Abstains,
}

impl ConsistencyRules {
    /// The thresholds of these options.
    pub fn new(options: &Options) -> ConsistencyRules {
        ConsistencyRules {
            depth_tolerance: options.depth_tolerance as f32,
            min_normal_cosine: options.normal_tolerance.to_radians().cos() as f32,
            min_consistent: options.min_consistent as usize,
            share: options.consistent_share as f32,
            occluders_abstain: options.occluders_abstain,
        }
    }

    /// The same with half of the tolerance of depths.
    pub fn closer(self) -> ConsistencyRules {
        ConsistencyRules { depth_tolerance: 0.5 * self.depth_tolerance, ..self }
    }

    /// Compares a solution, as depth and normal in the source view's frame, with the source view's own.
    #[inline(always)]
    pub fn judge(&self, depth: f32, normal: Vec3, own: &Solution) -> Verdict {
        let difference = own.depth - depth;
        if self.occluders_abstain && own.depth > 0.0 && difference < -self.depth_tolerance * depth {
            return Verdict::Abstains;
        }
        let same_depth = own.depth > 0.0 && difference.abs() < self.depth_tolerance * depth;
        if same_depth && normal.dot(own.normal) > self.min_normal_cosine {
            Verdict::Consistent
        } else {
            Verdict::Inconsistent
        }
    }

    /// Whether this many consistent sources out of those that can speak validate a solution.
    #[inline(always)]
    pub fn validates(&self, consistent: usize, speaking: usize) -> bool {
        consistent >= self.min_consistent && consistent as f32 >= self.share * speaking as f32
    }
}

/// Checks every solution of a reference view against the sources of its view set; `sources` are their states in the
/// order of the reference's list, `None` of one that cannot speak. Gives the number of consistent sources and whether
/// the solution is validated.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn check(
    reference: &Reference,
    state: &ViewState,
    sources: &[Option<&ViewState>],
    rules: &ConsistencyRules,
    cancelled: Cancelled,
) -> Result<Vec<(u8, bool)>> {
    let width = reference.image.width;
    let judge = |(pixel, solution): (usize, &Solution), met: &mut Vec<Met>| {
        if solution.depth <= 0.0 {
            return (0, false);
        }
        let at = ((pixel % width) as f32, (pixel / width) as f32);
        // All are looked up before any is judged: the look-ups, far apart in memory, then do not wait for each other.
        met.clear();
        met.extend(state.sets.iter(pixel).filter_map(|index| {
            sources[index].and_then(|found| meet(&reference.sources[index], found, at, solution))
        }));
        let (mut consistent, mut speaking) = (0, 0);
        for Met { depth, normal, own } in met {
            match rules.judge(*depth, *normal, own) {
                Verdict::Consistent => (consistent, speaking) = (consistent + 1, speaking + 1),
                Verdict::Inconsistent => speaking += 1,
                Verdict::Abstains => {}
            }
        }
        (consistent.min(255) as u8, rules.validates(consistent, speaking))
    };
    let mut verdicts = vec![(0, false); state.solutions.len()];
    let bands = verdicts.par_chunks_mut(BAND).zip(state.solutions.par_chunks(BAND)).enumerate();
    bands.try_for_each(|(band, (verdicts, solutions))| {
        if cancelled() {
            return Err(Error::Cancelled);
        }
        let mut met = Vec::with_capacity(sources.len());
        for (verdict, pixel) in verdicts.iter_mut().zip((band * BAND..).zip(solutions)) {
            *verdict = judge(pixel, &mut met);
        }
        Ok(())
    })?;
    Ok(verdicts)
}

/// Pixels judged at once, between two looks whether to go on.
const BAND: usize = 1 << 12;

/// A solution in a source view's frame, and what that view found there.
struct Met {
    depth: f32,
    normal: Vec3,
    own: Solution,
}

/// Looks up what a source view found where a solution falls; `None` outside its image: it abstains.
fn meet(source: &Source, found: &ViewState, (x, y): (f32, f32), solution: &Solution) -> Option<Met> {
    let point = source.pose.at_infinity(x, y) + source.pose.epipole / solution.depth;
    let at = source.project(point)?;
    let nearest = (at.y + 0.5) as usize * source.image.width + (at.x + 0.5) as usize;
    Some(Met {
        depth: point.z * solution.depth,
        normal: source.rotation * solution.normal,
        own: found.solutions[nearest],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::World;
    use crate::views::ViewSets;

    fn abstaining(occluders_abstain: bool) -> Options {
        Options {
            depth_tolerance: 0.01,
            normal_tolerance: 30.0,
            consistent_share: 0.7,
            min_consistent: 2,
            occluders_abstain,
            ..Options::default()
        }
    }

    fn own(depth: f32, degrees: f32) -> Solution {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        Solution { depth, normal: Vec3::new(sine, 0.0, -cosine), ..Solution::default() }
    }

    #[test]
    fn a_source_agrees_within_both_tolerances() {
        for rules in [true, false].map(|abstain| ConsistencyRules::new(&abstaining(abstain))) {
            for scale in [4.0, 4000.0] {
                let judge = |factor, degrees| rules.judge(scale, Vec3::NEG_Z, &own(scale * factor, degrees));
                assert_eq!(judge(1.0, 0.0), Verdict::Consistent);
                assert_eq!(judge(1.009, 29.0), Verdict::Consistent);
                assert_eq!(judge(0.991, -29.0), Verdict::Consistent);
                assert_eq!(judge(1.011, 0.0), Verdict::Inconsistent);
                assert_eq!(judge(1.0, 31.0), Verdict::Inconsistent);
                assert_eq!(judge(1.0, -31.0), Verdict::Inconsistent);
            }
            // A source without a solution speaks against.
            assert_eq!(rules.judge(4.0, Vec3::NEG_Z, &Solution::default()), Verdict::Inconsistent);
        }
    }

    #[test]
    fn closer_rules_halve_the_tolerance_of_depths() {
        let closer = ConsistencyRules::new(&abstaining(false)).closer();
        let judge = |factor: f32, degrees| closer.judge(4.0, Vec3::NEG_Z, &own(4.0 * factor, degrees));
        assert_eq!(judge(1.0049, 29.0), Verdict::Consistent);
        assert_eq!(judge(1.0051, 0.0), Verdict::Inconsistent);
        assert_eq!(judge(1.0, 31.0), Verdict::Inconsistent);
    }

    #[test]
    fn what_lies_in_front_abstains_or_speaks_against_as_in_the_paper() {
        for (abstain, verdict) in [(true, Verdict::Abstains), (false, Verdict::Inconsistent)] {
            let rules = ConsistencyRules::new(&abstaining(abstain));
            assert_eq!(rules.judge(4.0, Vec3::NEG_Z, &own(4.0 * 0.985, 0.0)), verdict);
            assert_eq!(rules.judge(4.0, Vec3::NEG_Z, &own(1.0, 80.0)), verdict);
            // What lies behind never abstains.
            assert_eq!(rules.judge(4.0, Vec3::NEG_Z, &own(5.0, 0.0)), Verdict::Inconsistent);
        }
    }

    #[test]
    fn enough_sources_and_a_share_of_them_must_agree() {
        let rules = |min_consistent, consistent_share| {
            ConsistencyRules::new(&Options { min_consistent, consistent_share, ..Options::default() })
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
        let mut states = world.exact();
        for (state, factor) in states[1..].iter_mut().zip(factors) {
            state.solutions.iter_mut().for_each(|solution| solution.depth *= factor);
        }
        let sources: Vec<Option<&ViewState>> = states[1..].iter().map(Some).collect();
        let rules = ConsistencyRules::new(&abstaining(occluders_abstain));
        let verdicts = check(&world.reference(), &states[0], &sources, &rules, &|| false).unwrap();
        assert_eq!(verdicts.len(), states[0].solutions.len());
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
        let mut states = world.exact();
        let pixels = states[0].solutions.len();
        let [mut two, mut one] = [ViewSets::empty(pixels, 4), ViewSets::empty(pixels, 4)];
        for pixel in 0..pixels {
            two.insert(pixel, 0);
            two.insert(pixel, 3);
            one.insert(pixel, 2);
        }
        let rules = ConsistencyRules::new(&abstaining(true));
        let mut verdicts = |sets: ViewSets| {
            states[0].sets = sets;
            let sources: Vec<Option<&ViewState>> = states[1..].iter().map(Some).collect();
            check(&world.reference(), &states[0], &sources, &rules, &|| false).unwrap()
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
        let mut states = world.exact();
        states[0].solutions[14 * 36 + 18].depth = 0.0;
        let sources: Vec<Option<&ViewState>> = states[1..].iter().map(Some).collect();
        let rules = ConsistencyRules::new(&abstaining(true));
        assert_eq!(
            check(&world.reference(), &states[0], &sources, &rules, &|| false).unwrap()[14 * 36 + 18],
            (0, false)
        );
    }
}
