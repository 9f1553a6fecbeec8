//! Overlap of views by the sparse points they share.

use crate::scene::{SparsePoint, Tracks, nearest_views};
use glam::DVec3;

/// For each view those that may see the same surface, ascending: those that saw a sparse point together with
/// it. A view that saw none with any other may see the surfaces of all others, and so overlaps all of them,
/// and they overlap it: the overlap of two views is mutual, so that a surface gives the same points whichever
/// of them is the reference first.
///
/// `centers` are the camera centers of all views; a point's views must be below their number. In a scene of
/// more than 1,000 views a view without common points overlaps the 256 views with the nearest cameras. Of
/// sparse points with long tracks, more than 33 views, only a part of the pairs of views is taken where all
/// points together have more than 16 million pairs; two views with many common points overlap in any case.
pub fn overlaps(centers: &[DVec3], points: &[SparsePoint]) -> Vec<Vec<u32>> {
    let views = centers.len();
    let tracks = Tracks::new(views, points);
    let mut overlaps: Vec<Vec<u32>> = vec![Vec::new(); views];
    // For each view the last one of a lower number that was found to overlap it.
    let mut last = vec![usize::MAX; views];
    for view in 0..views {
        tracks.each_pair(view, |other, _| {
            if last[other] != view {
                last[other] = view;
                overlaps[view].push(other as u32);
                overlaps[other].push(view as u32);
            }
        });
    }
    let alone: Vec<usize> = (0..views).filter(|&view| overlaps[view].is_empty()).collect();
    for view in alone {
        for other in nearest_views(centers, view) {
            overlaps[view].push(other);
            overlaps[other as usize].push(view as u32);
        }
    }
    for overlap in &mut overlaps {
        overlap.sort_unstable();
        overlap.dedup();
        overlap.shrink_to_fit();
    }
    overlaps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(views: impl IntoIterator<Item = u32>) -> SparsePoint {
        SparsePoint { position: Default::default(), views: views.into_iter().collect() }
    }

    fn is_mutual(overlaps: &[Vec<u32>]) -> bool {
        let has = |view: usize, other: u32| overlaps[other as usize].contains(&(view as u32));
        overlaps.iter().enumerate().all(|(view, own)| own.iter().all(|&other| has(view, other)))
    }

    #[test]
    fn views_overlap_when_they_share_a_point_and_a_view_without_points_overlaps_all() {
        let centers = [DVec3::ZERO; 5];
        let with_points = overlaps(&centers[..4], &[point([0, 2]), point([2, 3, 0]), point([1, 0])]);
        assert_eq!(with_points, [vec![1, 2, 3], vec![0], vec![0, 3], vec![0, 2]]);
        // View 1 saw no point, view 4 one that no other view saw.
        let without = overlaps(&centers, &[point([0, 2, 2]), point([2, 3]), point([4])]);
        assert_eq!(without[1], [0, 2, 3, 4]);
        assert_eq!(without[4], [0, 1, 2, 3]);
        assert_eq!(without[0], [1, 2, 4]);
        assert!(is_mutual(&without), "{without:?}");
    }

    #[test]
    fn long_tracks_of_large_scenes_overlap_all_views_that_share_many_points() {
        // 46 million pairs, of which 15 million are taken.
        let points: Vec<SparsePoint> = (0..2300).map(|index| point(index % 200..index % 200 + 200)).collect();
        let found = overlaps(&[DVec3::ZERO; 400], &points);
        // These share half of the points or more.
        for view in 100..300u32 {
            let mut near = (100..300).filter(|other| (1..=100).contains(&view.abs_diff(*other)));
            assert!(near.all(|other| found[view as usize].contains(&other)), "{view}");
        }
        assert!(is_mutual(&found));
    }

    #[test]
    fn a_view_without_points_overlaps_the_nearest_views_of_a_large_scene() {
        let centers: Vec<DVec3> = (0..3000).map(|view| DVec3::X * f64::from(view)).collect();
        let found = overlaps(&centers, &[point([0, 2999])]);
        assert_eq!((found[0].len(), found[1500].len()), (1 + 128, 256));
        assert!(found[1500].iter().copied().eq((1372..1500).chain(1501..1629)));
        assert!(is_mutual(&found));
        assert!(found.iter().map(Vec::len).sum::<usize>() < 3000 * 2 * 256);
    }
}
