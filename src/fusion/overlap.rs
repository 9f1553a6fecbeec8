//! Overlap of views by the sparse points they share.

use crate::scene::{SparsePoint, Tracks, nearest_views};
use glam::DVec3;

/// Views that a view chooses to be compared with: a surface that as many photographs show is averaged well
/// enough, and the maps of all of them must be in memory at the same time.
const MAX_CHOSEN: usize = 24;

/// For each view those that are compared with it, ascending: those that saw a sparse point together with it, of
/// more than 24 the ones with the most common points, and the views that choose it in this way. A view that saw
/// none with any other may see the surfaces of all others, and so overlaps all of them, and they overlap it: the
/// overlap of two views is mutual, so that a surface gives the same points whichever of them is the reference
/// first.
///
/// `centers` are the camera centers of all views; a point's views must be below their number. In a scene of
/// more than 1,000 views a view without common points overlaps the 256 views with the nearest cameras. Of
/// sparse points with long tracks, more than 33 views, only a part of the pairs of views is taken where all
/// points together have more than 16 million pairs; two views with many common points overlap in any case.
pub fn overlaps(centers: &[DVec3], points: &[SparsePoint]) -> Vec<Vec<u32>> {
    let views = centers.len();
    let tracks = Tracks::new(views, points);
    // By view, the others with the number of common points.
    let mut common: Vec<Vec<(u32, u32)>> = vec![Vec::new(); views];
    let mut counts = vec![0u32; views];
    for view in 0..views {
        let mut others = Vec::new();
        tracks.each_pair(view, |other, _| {
            if counts[other] == 0 {
                others.push(other);
            }
            counts[other] += 1;
        });
        for other in others {
            let count = std::mem::take(&mut counts[other]);
            common[view].push((other as u32, count));
            common[other].push((view as u32, count));
        }
    }
    let mut overlaps: Vec<Vec<u32>> = vec![Vec::new(); views];
    for (view, others) in common.into_iter().enumerate() {
        for other in most_common(centers, view, others) {
            overlaps[view].push(other);
            overlaps[other as usize].push(view as u32);
        }
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

/// The views with the most common points, at most [`MAX_CHOSEN`]: of about equally many, within a power of two as
/// long tracks are counted in part, those with the nearest cameras, then those of lower numbers.
fn most_common(centers: &[DVec3], view: usize, mut others: Vec<(u32, u32)>) -> impl Iterator<Item = u32> {
    let distance = |other: u32| centers[other as usize].distance_squared(centers[view]);
    let magnitude = |count: u32| count.checked_ilog2();
    others.sort_by(|a, b| {
        let by_count = magnitude(b.1).cmp(&magnitude(a.1));
        by_count.then(distance(a.0).total_cmp(&distance(b.0))).then(a.0.cmp(&b.0))
    });
    others.into_iter().take(MAX_CHOSEN).map(|(other, _)| other)
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
    fn of_many_views_those_with_the_most_common_points_are_chosen_on_both_sides() {
        // 46 million pairs, of which 15 million are taken.
        let points: Vec<SparsePoint> = (0..2300).map(|index| point(index % 200..index % 200 + 200)).collect();
        let centers: Vec<DVec3> = (0..400).map(|view| DVec3::X * f64::from(view)).collect();
        let found = overlaps(&centers, &points);
        assert!(is_mutual(&found));
        for view in 160..240u32 {
            let own = &found[view as usize];
            assert!((24..=60).contains(&own.len()), "{view}: {}", own.len());
            let near = (1..=5).flat_map(|distance| [view - distance, view + distance]);
            assert!(near.into_iter().all(|other| own.contains(&other)), "{view}: {own:?}");
        }
    }

    #[test]
    fn of_equally_many_common_points_the_nearest_cameras_decide() {
        let centers: Vec<DVec3> = (0..100).map(|view| DVec3::X * f64::from(view)).collect();
        let found = overlaps(&centers, &[point(0..100), point(0..100)]);
        assert!(found[50].iter().copied().eq((38..50).chain(51..63)));
        assert!(found[0].iter().copied().eq(1..25));
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
