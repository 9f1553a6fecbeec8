//! Exposure compensation: photographs of one scene differ in exposure and white balance, and a point's color,
//! averaged over those that see it, would show seams where their set changes.
//!
//! For each pair of overlapping views and each channel, `m` is the median of `ln(c_a / c_b)` over points that
//! both see. The gains `exp(g)` minimize `sum n (g_a - g_b + m)^2` over all pairs of `n` points each, and are
//! 1 in the mean.

use super::source::{Comparison, Source};
use super::{FusionInput, Reference, with_group};
use crate::error::Result;
use crate::options::FusionOptions;
use glam::DVec3;
use rayon::prelude::*;

/// Fraction of the time of a fusion that the comparison takes: it reads all maps once more.
pub(super) const SHARE: f64 = 0.25;
/// Of so many rows and columns one is compared, of fewer in large images.
const MIN_STEP: usize = 8;
/// Pixels of a view that are compared, about.
const MAX_SAMPLES: f64 = 20_000.0;
/// Colors beyond are clipped, or mostly noise.
const USABLE: std::ops::RangeInclusive<u8> = 8..=247;
/// Fewest points that a pair of views is compared by.
const MIN_POINTS: usize = 30;
/// Sweeps of the Gauss-Seidel iteration.
const SWEEPS: usize = 200;

/// Two views and the logarithms of the ratios of their colors.
struct Pair {
    views: [usize; 2],
    points: f64,
    ratio: DVec3,
}

/// Factors of red, green and blue for each view; calls `before` with the place in the order before each
/// reference view.
///
/// # Errors
/// Views that cannot be read; what `before` returns.
pub(super) fn gains(
    input: &dyn FusionInput,
    options: &FusionOptions,
    order: &[usize],
    before: impl Fn(usize) -> Result<()> + Sync,
) -> Result<Vec<DVec3>> {
    let mut pairs = Vec::new();
    for (place, &index) in order.iter().enumerate() {
        before(place)?;
        with_group(input, index, &|| before(place), &mut |group| {
            let reference = Reference::new(group, index, input.overlap(index), options);
            pairs.par_extend(reference.sources.par_iter().filter_map(|source| pair(&reference, source)));
            Ok(())
        })?;
    }
    Ok(solve(input.len(), &pairs).into_iter().map(DVec3::exp).collect())
}

/// Compares the colors of the reference and a source where they see the same surface.
fn pair(reference: &Reference, source: &Source) -> Option<Pair> {
    let group = reference.group;
    let camera = group[0].camera;
    let step = MIN_STEP.max((camera.pixels() as f64 / MAX_SAMPLES).sqrt() as usize);
    let own_picture = group[0].picture?;
    let mut ratios: [Vec<f64>; 3] = Default::default();
    for row in (0..camera.height).step_by(step) {
        for column in (0..camera.width).step_by(step) {
            let Some((pixel, depth, start)) = reference.start((column, row)) else { continue };
            let Comparison::Consistent(other) = source.compare(pixel, depth, &start) else { continue };
            let (own, other) = (own_picture.rgb(start.pixel), group[other.slot].picture?.rgb(other.pixel));
            if own.iter().chain(&other).all(|channel| USABLE.contains(channel)) {
                for (channel, ratios) in ratios.iter_mut().enumerate() {
                    ratios.push((f64::from(own[channel]) / f64::from(other[channel])).ln());
                }
            }
        }
    }
    let points = ratios[0].len();
    (points >= MIN_POINTS).then(|| Pair {
        views: [reference.index, source.index as usize],
        points: points as f64,
        ratio: DVec3::from_array(ratios.map(super::average::median)),
    })
}

/// The logarithms of the gains.
fn solve(views: usize, pairs: &[Pair]) -> Vec<DVec3> {
    let mut by_view = vec![Vec::new(); views];
    for pair in pairs {
        let [first, second] = pair.views;
        by_view[first].push((second, pair.points, -pair.ratio));
        by_view[second].push((first, pair.points, pair.ratio));
    }
    let compared: Vec<usize> = (0..views).filter(|&view| !by_view[view].is_empty()).collect();
    let mut gains = vec![DVec3::ZERO; views];
    for _ in 0..SWEEPS {
        for &view in &compared {
            let points: f64 = by_view[view].iter().map(|(_, points, _)| points).sum();
            let wanted: DVec3 =
                by_view[view].iter().map(|&(other, points, ratio)| points * (gains[other] + ratio)).sum();
            gains[view] = wanted / points;
        }
    }
    let mean = compared.iter().map(|&view| gains[view]).sum::<DVec3>() / compared.len().max(1) as f64;
    compared.iter().for_each(|&view| gains[view] -= mean);
    gains
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_undo_the_ratios_of_a_chain_of_views_and_are_1_without_pairs() {
        let pair = |first, second, ratio: f64| Pair {
            views: [first, second],
            points: 100.0,
            ratio: DVec3::splat(ratio),
        };
        let gains = solve(4, &[pair(0, 1, 0.2), pair(1, 2, -0.1)]);
        let difference = |first: usize, second: usize| gains[first].x - gains[second].x;
        assert!((difference(0, 1) + 0.2).abs() < 1e-6 && (difference(1, 2) - 0.1).abs() < 1e-6, "{gains:?}");
        assert!((gains[0] + gains[1] + gains[2]).length() < 1e-6);
        assert_eq!(gains[3], DVec3::ZERO);
    }
}
