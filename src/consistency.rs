//! Geometric consistency check (section 5.6 of the paper): a solution is validated when enough of its source views found
//! the same surface.

use crate::options::Options;
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
/// order of the reference's list. Gives the number of consistent sources and whether the solution is validated.
pub fn check(
    reference: &Reference,
    state: &ViewState,
    sources: &[&ViewState],
    rules: &ConsistencyRules,
) -> Vec<(u8, bool)> {
    let width = reference.image.width;
    let judge = |(pixel, solution): (usize, &Solution)| {
        if solution.depth <= 0.0 {
            return (0, false);
        }
        let (x, y) = ((pixel % width) as f32, (pixel / width) as f32);
        let (mut consistent, mut speaking) = (0, 0);
        for index in state.sets.iter(pixel) {
            let source = &reference.sources[index];
            match verdict(source, sources[index], (x, y), solution, rules) {
                Verdict::Consistent => (consistent, speaking) = (consistent + 1, speaking + 1),
                Verdict::Inconsistent => speaking += 1,
                Verdict::Abstains => {}
            }
        }
        (consistent.min(255) as u8, rules.validates(consistent, speaking))
    };
    state.solutions.par_iter().enumerate().with_min_len(1024).map(judge).collect()
}

/// What one source view says; one that has the point outside its image abstains.
fn verdict(
    source: &Source,
    state: &ViewState,
    (x, y): (f32, f32),
    solution: &Solution,
    rules: &ConsistencyRules,
) -> Verdict {
    let point = source.pose.at_infinity(x, y) + source.pose.epipole / solution.depth;
    let Some(at) = source.project(point) else { return Verdict::Abstains };
    let nearest = (at.y + 0.5) as usize * source.image.width + (at.x + 0.5) as usize;
    rules.judge(point.z * solution.depth, source.rotation * solution.normal, &state.solutions[nearest])
}
