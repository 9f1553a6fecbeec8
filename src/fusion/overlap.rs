//! Overlap of views by the sparse points they share.

use crate::scene::SparsePoint;
use std::collections::BTreeSet;

/// For each of `views` views those that may see the same surface: those that saw a sparse point together with
/// it, or all others for a view that saw none. A point's views must be below `views`.
pub fn overlaps(views: usize, points: &[SparsePoint]) -> Vec<Vec<u32>> {
    let mut overlaps = vec![BTreeSet::new(); views];
    for point in points {
        for &view in &point.views {
            let others = point.views.iter().filter(|&&other| other != view);
            overlaps[view as usize].extend(others);
        }
    }
    let all_others = |view: usize| (0..views as u32).filter(move |&other| other as usize != view);
    let list = |(view, overlap): (usize, BTreeSet<u32>)| match overlap.is_empty() {
        true => all_others(view).collect(),
        false => overlap.into_iter().collect(),
    };
    overlaps.into_iter().enumerate().map(list).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_overlap_when_they_share_a_point_and_a_view_without_points_overlaps_all() {
        let point = |views: &[u32]| SparsePoint { position: Default::default(), views: views.to_vec() };
        let overlaps = overlaps(4, &[point(&[0, 2]), point(&[2, 3, 0])]);
        assert_eq!(overlaps, [vec![2, 3], vec![0, 2, 3], vec![0, 3], vec![0, 2]]);
    }
}
