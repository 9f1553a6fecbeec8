//! Clouds of even density.

use super::arguments::Thinning;
use rayon::prelude::*;
use std::collections::HashMap;

/// The cell of a point in a grid of cubes.
type Cell = [i64; 3];

/// The points thinned to this spacing, on the threads of the caller's pool. The result does not depend on
/// their number.
pub fn thin(points: Vec<[f64; 3]>, how: Thinning, size: f64) -> Vec<[f64; 3]> {
    match how {
        Thinning::First => by_cell(&points, size, |cell| points[cell[0].1]),
        Thinning::Mean => by_cell(&points, size, |cell| mean(&points, cell)),
        Thinning::Radius => by_radius(&points, size),
    }
}

fn cell(point: &[f64; 3], size: f64) -> Cell {
    point.map(|coordinate| (coordinate / size).floor() as i64)
}

/// A point for each cube, made from its cell and the indices of its points, which ascend.
fn by_cell(points: &[[f64; 3]], size: f64, point: impl Fn(&[(Cell, usize)]) -> [f64; 3]) -> Vec<[f64; 3]> {
    let mut order: Vec<(Cell, usize)> =
        points.par_iter().enumerate().map(|(index, point)| (cell(point, size), index)).collect();
    order.par_sort_unstable();
    order.chunk_by(|a, b| a.0 == b.0).map(point).collect()
}

fn mean(points: &[[f64; 3]], cell: &[(Cell, usize)]) -> [f64; 3] {
    let sum: glam::DVec3 = cell.iter().map(|&(_, index)| glam::DVec3::from(points[index])).sum();
    (sum / cell.len() as f64).into()
}

/// Takes the points in random order, each unless a taken one lies within the radius.
fn by_radius(points: &[[f64; 3]], radius: f64) -> Vec<[f64; 3]> {
    let mut order: Vec<(u64, usize)> = (0..points.len()).map(|index| (scrambled(index), index)).collect();
    order.par_sort_unstable();
    let mut taken: HashMap<Cell, Vec<u32>> = HashMap::new();
    let mut kept = Vec::new();
    for (_, index) in order {
        let (point, [x, y, z]) = (glam::DVec3::from(points[index]), cell(&points[index], radius));
        let mut around = (0..27).filter_map(|place: i64| {
            // Cells saturate at the ends of their numbers.
            let beside = |cell: i64, step: i64| cell.saturating_add(step % 3 - 1);
            taken.get(&[beside(x, place), beside(y, place / 3), beside(z, place / 9)])
        });
        let is_near = around.any(|others: &Vec<u32>| {
            others.iter().any(|&other| {
                point.distance_squared(glam::DVec3::from(points[other as usize])) <= radius * radius
            })
        });
        if !is_near {
            taken.entry([x, y, z]).or_default().push(index as u32);
            kept.push(points[index]);
        }
    }
    kept
}

/// A bijection of 64-bit numbers without a visible pattern (the finalizer of SplitMix64).
fn scrambled(index: usize) -> u64 {
    let mut bits = (index as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Vec<[f64; 3]> {
        (0..100).map(|index| [f64::from(index) * 0.1, -0.05, 0.0]).collect()
    }

    #[test]
    fn a_cube_keeps_its_first_point_or_the_mean() {
        let first = thin(line(), Thinning::First, 1.0);
        assert_eq!(first.len(), 10);
        assert_eq!(first[0], [0.0, -0.05, 0.0]);
        let mean = thin(line(), Thinning::Mean, 1.0);
        assert!((mean[0][0] - 0.45).abs() < 1e-12, "{mean:?}");
    }

    #[test]
    fn points_thinned_by_a_radius_are_apart_and_cover_the_others() {
        let kept = thin(line(), Thinning::Radius, 0.35);
        let distance = |a: &[f64; 3], b: &[f64; 3]| glam::DVec3::from(*a).distance(glam::DVec3::from(*b));
        for (index, point) in kept.iter().enumerate() {
            assert!(kept[..index].iter().all(|other| distance(point, other) > 0.35));
        }
        assert!(line().iter().all(|point| kept.iter().any(|kept| distance(point, kept) <= 0.35)));
    }
}
