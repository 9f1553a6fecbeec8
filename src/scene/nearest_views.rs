//! The views around a view, for pairs of views that share no sparse points.

use glam::DVec3;

/// Number of views up to which every view may see the surfaces of every other one: the pairs are few.
pub(crate) const MAX_VIEWS_FOR_ALL_PAIRS: usize = 1000;
/// Number of views that may see the surfaces of a view of a larger scene: those with the nearest cameras.
pub(crate) const NEAREST_VIEWS: usize = 256;

/// The views that may see the surfaces of a view although they share no sparse points with it, ascending: all
/// others or, in a scene of more than [`MAX_VIEWS_FOR_ALL_PAIRS`], the [`NEAREST_VIEWS`] with the nearest
/// camera centers; of equally near ones those of lower numbers.
pub(crate) fn nearest_views(centers: &[DVec3], view: usize) -> Vec<u32> {
    let all_others = (0..centers.len() as u32).filter(|&other| other as usize != view);
    if centers.len() <= MAX_VIEWS_FOR_ALL_PAIRS {
        return all_others.collect();
    }
    let distance = |other: u32| centers[other as usize].distance_squared(centers[view]);
    let mut others: Vec<(f64, u32)> = all_others.map(|other| (distance(other), other)).collect();
    others.select_nth_unstable_by(NEAREST_VIEWS, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    others.truncate(NEAREST_VIEWS);
    let mut nearest: Vec<u32> = others.into_iter().map(|(_, other)| other).collect();
    nearest.sort_unstable();
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_a_row(views: usize) -> Vec<DVec3> {
        (0..views).map(|view| DVec3::X * view as f64).collect()
    }

    #[test]
    fn all_other_views_of_ordinary_scenes_are_near() {
        let nearest = nearest_views(&in_a_row(MAX_VIEWS_FOR_ALL_PAIRS), 3);
        assert!(nearest.into_iter().eq((0..1000).filter(|&other| other != 3)));
    }

    #[test]
    fn the_nearest_views_of_large_scenes_are_near() {
        let centers = in_a_row(MAX_VIEWS_FOR_ALL_PAIRS + 1);
        // 128 at either side.
        assert!(nearest_views(&centers, 500).into_iter().eq((372..500).chain(501..629)));
        assert!(nearest_views(&centers, 0).into_iter().eq(1..257));
        assert!(nearest_views(&vec![DVec3::ONE; 2000], 7).into_iter().eq((0..7).chain(8..257)));
    }
}
