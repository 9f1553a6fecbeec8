//! What the costs of a hypothesis in its source views add up to.

use crate::matching::Projections;
use crate::simd::{LANES, Simd};
use std::cmp::Ordering;

/// The largest k of the option `cost.best_views`.
pub const MAX_BEST_VIEWS: usize = 8;

/// The hypothesis at work in the source views of a group.
#[derive(Debug, Clone, Copy)]
pub struct InViews {
    /// Where it falls in them.
    pub projections: Projections,
    /// The least it can cost in each view that has it in its image: the geometric term, and the photometric one as soon
    /// as it is known.
    pub least: [f32; LANES],
}

/// Number of views that have the hypothesis in their image.
#[inline(always)]
pub fn seen(views: &[InViews]) -> usize {
    views.iter().map(|view| view.projections.inside.count_ones() as usize).sum()
}

/// The number of views in which the hypothesis costs less than in this one; of equals the earlier cost less.
#[inline(always)]
pub fn cheaper<S: Simd>(simd: S, views: &[InViews], group: usize, lane: usize) -> usize {
    let cost = simd.splat(views[group].least[lane]);
    let mut count = 0;
    for (other, InViews { projections, least }) in views.iter().enumerate() {
        let costs = simd.load(least);
        let not_less = simd.simd_ge(costs, cost);
        let earlier = match other.cmp(&group) {
            Ordering::Less => u8::MAX,
            Ordering::Equal => (1 << lane) - 1,
            Ordering::Greater => 0,
        };
        let equal = not_less & simd.simd_ge(cost, costs);
        count += ((!not_less | equal & earlier) & projections.inside).count_ones() as usize;
    }
    count
}

/// The costs in the views that have the hypothesis in their image.
#[inline(always)]
pub fn sum<S: Simd>(simd: S, views: &[InViews]) -> f32 {
    let zero = simd.splat(0.0);
    let mut sum = zero;
    for InViews { projections, least } in views {
        sum = simd.add(sum, simd.select(projections.inside, simd.load(least), zero));
    }
    simd.reduce_sum(sum)
}

/// The sum of the `best` smallest of those `count` costs.
#[inline(always)]
pub fn sum_of_least<S: Simd>(simd: S, views: &[InViews], count: usize, best: usize) -> f32 {
    if count == best {
        return sum(simd, views);
    }
    if count == best + 1 {
        let zero = simd.splat(0.0);
        let mut largest = zero;
        for InViews { projections, least } in views {
            largest = simd.max(largest, simd.select(projections.inside, simd.load(least), zero));
        }
        return sum(simd, views) - simd.reduce_max(largest);
    }
    match best {
        1 => sum_of::<1>(views),
        2 => sum_of::<2>(views),
        3 => sum_of::<3>(views),
        4 => sum_of::<4>(views),
        5 => sum_of::<5>(views),
        6 => sum_of::<6>(views),
        7 => sum_of::<7>(views),
        _ => sum_of::<MAX_BEST_VIEWS>(views),
    }
}

/// The sum of the smallest costs in the views that have the hypothesis in their image.
#[inline(always)]
fn sum_of<const BEST: usize>(views: &[InViews]) -> f32 {
    let mut least = [f32::INFINITY; BEST];
    for InViews { projections, least: costs } in views {
        for (lane, &cost) in costs.iter().enumerate() {
            let mut cost = if projections.inside >> lane & 1 != 0 { cost } else { f32::INFINITY };
            // Without branches: which costs are small cannot be predicted.
            for place in &mut least {
                (*place, cost) = (smaller(*place, cost), larger(*place, cost));
            }
        }
    }
    least.iter().sum()
}

/// Costs are numbers: `f32::min` would look for others.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
