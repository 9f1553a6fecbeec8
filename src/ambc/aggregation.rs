//! Aggregation: the costs of a hypothesis in its source views become one cost.

use crate::matching::Projections;
use crate::simd::{LANES, Simd};
use std::cmp::Ordering;

/// The largest k of the option `cost.best_views`.
pub(super) const MAX_BEST_VIEWS: usize = 8;

/// The current hypothesis in the source views of a group.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroupCosts {
    /// Its projections into the views.
    pub projections: Projections,
    /// Lower bound of its cost in each view that has it in its image: the geometric term, and the photometric
    /// one as soon as it is known.
    pub costs: [f32; LANES],
}

/// Number of views that have the hypothesis in their image.
#[inline(always)]
pub(super) fn count_visible(groups: &[GroupCosts]) -> usize {
    groups.iter().map(|group| group.projections.inside.count_ones() as usize).sum()
}

/// The rank of a view: the number of views in which the hypothesis costs less; of equal costs the earlier is
/// lower.
#[inline(always)]
pub(super) fn rank_of<S: Simd>(simd: S, groups: &[GroupCosts], group: usize, lane: usize) -> usize {
    let cost = simd.splat(groups[group].costs[lane]);
    let mut rank = 0;
    for (other, GroupCosts { projections, costs }) in groups.iter().enumerate() {
        let costs = simd.load(costs);
        let not_less = simd.simd_ge(costs, cost);
        let earlier = match other.cmp(&group) {
            Ordering::Less => u8::MAX,
            Ordering::Equal => (1 << lane) - 1,
            Ordering::Greater => 0,
        };
        let equal = not_less & simd.simd_ge(cost, costs);
        rank += ((!not_less | equal & earlier) & projections.inside).count_ones() as usize;
    }
    rank
}

/// The sum of the costs in the views that have the hypothesis in their image.
#[inline(always)]
pub(super) fn sum<S: Simd>(simd: S, groups: &[GroupCosts]) -> f32 {
    let zero = simd.splat(0.0);
    let mut sum = zero;
    for GroupCosts { projections, costs } in groups {
        sum = simd.add(sum, simd.select(projections.inside, simd.load(costs), zero));
    }
    simd.reduce_sum(sum)
}

/// The sum of the `best` smallest of those `count` costs.
#[inline(always)]
pub(super) fn sum_of_best<S: Simd>(simd: S, groups: &[GroupCosts], count: usize, best: usize) -> f32 {
    if count == best {
        return sum(simd, groups);
    }
    if count == best + 1 {
        let zero = simd.splat(0.0);
        let mut largest = zero;
        for GroupCosts { projections, costs } in groups {
            largest = simd.max(largest, simd.select(projections.inside, simd.load(costs), zero));
        }
        return sum(simd, groups) - simd.reduce_max(largest);
    }
    match best {
        1 => sum_of_smallest::<1>(groups),
        2 => sum_of_smallest::<2>(groups),
        3 => sum_of_smallest::<3>(groups),
        4 => sum_of_smallest::<4>(groups),
        5 => sum_of_smallest::<5>(groups),
        6 => sum_of_smallest::<6>(groups),
        7 => sum_of_smallest::<7>(groups),
        _ => sum_of_smallest::<MAX_BEST_VIEWS>(groups),
    }
}

/// Insertion into a sorted list of the smallest costs.
#[inline(always)]
fn sum_of_smallest<const BEST: usize>(groups: &[GroupCosts]) -> f32 {
    let mut smallest = [f32::INFINITY; BEST];
    for GroupCosts { projections, costs } in groups {
        for (lane, &cost) in costs.iter().enumerate() {
            let mut cost = if projections.inside >> lane & 1 != 0 { cost } else { f32::INFINITY };
            // Without branches: which costs are small cannot be predicted.
            for place in &mut smallest {
                (*place, cost) = (smaller(*place, cost), larger(*place, cost));
            }
        }
    }
    smallest.iter().sum()
}

/// Costs are never NaN, which `f32::min` would test for.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
