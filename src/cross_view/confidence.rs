//! Confidence of final planes: the probability that a depth is within 1 % of the true one.
//!
//! ```text
//! confidence = 1 / (1 + exp(-score))       score: weighted sum of the evidence below
//! ```
//!
//! | evidence | in |
//! |---|---|
//! | validated by the check | 0 or 1 |
//! | consistent views k of the check | k / (k + 2) |
//! | agreement a: sum over source views of w (1 - e^2)^2, e the error over its tolerance | a / (a + 1) |
//! | violations: sum of w over the source views whose surface lies behind | 0 to 3 |
//! | occlusions o: the same of surfaces in front | o / (o + 1) |
//! | cost: mean 1 - NCC | 0 to 1.5 |
//! | support s: how well the planes around the pixel continue its plane | s and s^2 |
//!
//! A source view has the weight w = min(1, sin angle / sin 20 degrees): at small triangulation angles wrong
//! depths agree too. The weights of the sum are those of a logistic regression on rendered scenes whose
//! depths are known.

use super::DepthTolerance;
use crate::geometry::{Border, Grid, PaddedMap, Position, SlantedPlane};
use crate::matching::{Problem, SourceProjector};
use crate::scene::PixelEstimate;
use crate::simd::{LANES, Simd, SimdLevel, Task, dispatch};
use rayon::prelude::*;

/// Sine of the triangulation angle from which on a source view has the full weight.
const FULL_WEIGHT_SINE: f32 = 0.342;
/// Half the side of the square of neighbors whose planes support a plane.
const SUPPORT_RADIUS: i32 = 3;
/// Distance in pixels of the neighbors along each axis.
const SUPPORT_STEP: usize = 2;
/// Relative difference of depths from which on a neighbor does not support a plane.
const SUPPORT_TOLERANCE: f32 = 0.01;

/// What speaks for and against a plane.
#[derive(Debug, Clone, Copy, Default)]
struct Evidence {
    is_validated: bool,
    consistent_views: u8,
    agreement: f32,
    violations: f32,
    occlusions: f32,
    cost: f32,
    support: f32,
}

impl Evidence {
    /// The probability that the depth is within 1 %.
    fn confidence(&self) -> f32 {
        let consistent = f32::from(self.consistent_views.min(6));
        let score = WEIGHTS.bias
            + WEIGHTS.validated * f32::from(u8::from(self.is_validated))
            + WEIGHTS.consistent * consistent / (consistent + 2.0)
            + WEIGHTS.agreement * self.agreement / (self.agreement + 1.0)
            + WEIGHTS.violations * self.violations.min(3.0)
            + WEIGHTS.occlusions * self.occlusions / (self.occlusions + 1.0)
            + WEIGHTS.cost * self.cost.min(1.5)
            + WEIGHTS.support * self.support
            + WEIGHTS.squared_support * self.support * self.support;
        1.0 / (1.0 + (-score).exp())
    }
}

/// Weights of the evidence.
struct Weights {
    bias: f32,
    validated: f32,
    consistent: f32,
    agreement: f32,
    violations: f32,
    occlusions: f32,
    cost: f32,
    support: f32,
    squared_support: f32,
}

/// From a fit to the raw planes of four rendered scenes of 16 views, preset `fast`; its terms for texture and
/// for validation times support are folded into the others by hand.
const WEIGHTS: Weights = Weights {
    bias: 1.06,
    validated: 0.35,
    consistent: 1.05,
    agreement: 1.79,
    violations: -0.72,
    occlusions: -1.0,
    cost: -2.46,
    support: -3.45,
    squared_support: 5.9,
};

/// The confidence of each plane, given its cost; 0 where there is none. Reads the published surfaces of the
/// problem's sources.
pub(crate) fn confidence(
    level: SimdLevel,
    problem: &Problem,
    tolerance: DepthTolerance,
    planes: &[PixelEstimate],
    costs: &[f32],
) -> Vec<f32> {
    let mut confidence = vec![0.0; planes.len()];
    dispatch(level, ConfidenceTask { problem, tolerance, planes, costs, confidence: &mut confidence });
    confidence
}

struct ConfidenceTask<'a> {
    problem: &'a Problem<'a>,
    tolerance: DepthTolerance,
    planes: &'a [PixelEstimate],
    costs: &'a [f32],
    confidence: &'a mut [f32],
}

impl Task for ConfidenceTask<'_> {
    type Output = ();

    fn run<S: Simd>(self, simd: S) {
        let ConfidenceTask { problem, tolerance, planes, costs, confidence } = self;
        let grid = Grid { width: problem.image.width, height: problem.image.height };
        let border = Border { width: SUPPORT_RADIUS as usize, value: 0.0 };
        let depths = PaddedMap::new(grid, border, |pixel| planes[pixel].depth);
        confidence.par_chunks_mut(grid.width).enumerate().for_each(|(y, row)| {
            simd.vectorize(
                #[inline(always)]
                || {
                    let mut projector = SourceProjector::with_all_sources(simd, problem);
                    for (left, confidence) in row.chunks_mut(LANES).enumerate() {
                        let left = left * LANES;
                        let supports = support(problem, planes, &depths, (left, y));
                        for (lane, confidence) in confidence.iter_mut().enumerate() {
                            let pixel = grid.index((left + lane, y));
                            let plane = &planes[pixel];
                            if plane.depth <= 0.0 {
                                continue;
                            }
                            projector.set_pixel((left + lane) as f32, y as f32);
                            let mut evidence = Evidence {
                                is_validated: plane.validated,
                                consistent_views: plane.consistent_views,
                                cost: costs[pixel],
                                support: supports[lane],
                                ..Evidence::default()
                            };
                            add_votes(simd, problem, &projector, tolerance, plane.depth, &mut evidence);
                            *confidence = evidence.confidence();
                        }
                    }
                },
            );
        });
    }
}

/// Adds what the published surfaces of the source views say about a depth at the projector's pixel.
#[inline(always)]
fn add_votes<S: Simd>(
    simd: S,
    problem: &Problem,
    projector: &SourceProjector<'_, S>,
    tolerance: DepthTolerance,
    depth: f32,
    evidence: &mut Evidence,
) {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    for group in projector.groups() {
        let projections = group.project(simd, depth);
        let surfaces = group.surfaces(simd, &projections);
        let counted = projections.inside & surfaces.known;
        if counted == 0 {
            continue;
        }
        let parallax = group.parallax(simd, &projections, depth);
        let sine = simd.mul(parallax, simd.splat(problem.inverse_focal.0 / FULL_WEIGHT_SINE));
        let weight = simd.min(sine, one);
        let own_depth = simd.mul(simd.load(&projections.center[2]), simd.splat(depth));
        let difference = simd.sub(simd.mul(simd.load(&surfaces.exact), own_depth), one);
        let error = simd.div(difference, tolerance.relative(simd, parallax));
        let root = simd.sub(one, simd.mul(error, error));
        let agrees = counted & simd.simd_ge(root, zero);
        let agreement = simd.mul(weight, simd.mul(root, root));
        evidence.agreement += simd.reduce_sum(simd.select(agrees, agreement, zero));
        let is_in_front = simd.simd_ge(difference, zero);
        let violations = simd.select(counted & !agrees & !is_in_front, weight, zero);
        evidence.violations += simd.reduce_sum(violations);
        let occlusions = simd.select(counted & !agrees & is_in_front, weight, zero);
        evidence.occlusions += simd.reduce_sum(occlusions);
    }
}

/// How well the planes around each of `LANES` pixels from this one on continue its plane, 0 to 1.
#[inline(always)]
fn support(problem: &Problem, planes: &[PixelEstimate], depths: &PaddedMap, at: Position) -> [f32; LANES] {
    let grid = Grid { width: problem.image.width, height: problem.image.height };
    let (mut inverse_depth, mut slope_x, mut slope_y) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES.min(grid.width - at.0) {
        let PixelEstimate { depth, normal, .. } = planes[grid.index((at.0 + lane, at.1))];
        let ray = problem.ray((at.0 + lane) as f32, at.1 as f32);
        let plane = SlantedPlane::new(depth, normal, ray, problem.inverse_focal);
        (inverse_depth[lane], slope_x[lane], slope_y[lane]) =
            (plane.inverse_depth, plane.slope_x, plane.slope_y);
    }
    let offsets = || (-SUPPORT_RADIUS..=SUPPORT_RADIUS).step_by(SUPPORT_STEP);
    let mut sums = [0.0; LANES];
    for dy in offsets() {
        for dx in offsets() {
            // 0 outside of the image and where there is no plane.
            let others = depths.lanes(at, (dx, dy));
            for lane in 0..LANES {
                let predicted = inverse_depth[lane] + slope_x[lane] * dx as f32 + slope_y[lane] * dy as f32;
                let error = (predicted * others[lane] - 1.0) * (1.0 / SUPPORT_TOLERANCE);
                let support = 1.0 - error * error;
                sums[lane] += if support > 0.0 { support } else { 0.0 };
            }
        }
    }
    let count_inside = |at: usize, size: usize| {
        offsets().filter(|&offset| at.checked_add_signed(offset as isize).is_some_and(|at| at < size)).count()
    };
    let rows = count_inside(at.1, grid.height);
    std::array::from_fn(|lane| {
        let count = rows * count_inside(at.0 + lane, grid.width);
        if count > 0 { sums[lane] / count as f32 } else { 0.0 }
    })
}
