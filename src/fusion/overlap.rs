//! Overlap of views by the sparse points they share.

use crate::scene::{SparsePoint, Tracks, nearest_views};
use glam::DVec3;
use std::cmp::{Ordering, Reverse};

/// Views that a view is compared with: a surface that as many photographs show is averaged well enough, and
/// the maps of all of them must be in memory at the same time.
const MOST_VIEWS: usize = 24;
/// Views that it is compared with also if all of them have as many as that already.
const LEAST_VIEWS: usize = 8;

/// For each view those that are compared with it, ascending: those that saw a sparse point together with it;
/// of more than 24 those with the most common points. A view that saw none with any other may see the
/// surfaces of all others: it is compared with the nearest ones. The overlap of two views is mutual, so that
/// a surface gives the same points whichever of them is the reference first.
///
/// `centers` are the camera centers of all views; a point's views must be below their number. Of sparse
/// points with long tracks, more than 33 views, only a part of the pairs of views is taken where all points
/// together have more than 16 million pairs; two views with many common points overlap in any case.
pub fn overlaps(centers: &[DVec3], points: &[SparsePoint]) -> Vec<Vec<u32>> {
    let mut pairs = pairs(centers, points);
    // The best first: each pair is taken while both of its views have room for it.
    pairs.sort_unstable_by(Pair::compare);
    pairs.dedup_by_key(|pair| pair.views);
    let mut overlaps: Vec<Vec<u32>> = vec![Vec::new(); centers.len()];
    let mut take = |pair: &Pair, has_room: &dyn Fn([usize; 2]) -> bool| {
        let [a, b] = pair.views;
        let is_taken = has_room(pair.views.map(|view| overlaps[view as usize].len()));
        if is_taken {
            overlaps[a as usize].push(b);
            overlaps[b as usize].push(a);
        }
        is_taken
    };
    pairs.retain(|pair| !take(pair, &|counts| counts.iter().all(|&count| count < MOST_VIEWS)));
    pairs.retain(|pair| !take(pair, &|counts| counts.iter().any(|&count| count < LEAST_VIEWS)));
    for overlap in &mut overlaps {
        overlap.sort_unstable();
        overlap.shrink_to_fit();
    }
    overlaps
}

/// The order in which views are fused: each is followed by the one of those it overlaps with that overlaps
/// most with the same views, of equal ones the first; where none is left, by one that overlaps with a view
/// before. So neighbors in the scene follow each other, whatever the order of their numbers, and views that
/// are loaded when they are needed are loaded few times.
pub(super) fn fusion_order<'a>(views: usize, overlap: impl Fn(usize) -> &'a [u32]) -> Vec<usize> {
    let (mut is_taken, mut is_own) = (vec![false; views], vec![false; views]);
    let mut order = Vec::with_capacity(views);
    for start in 0..views {
        // Views that may overlap with others that are not taken yet.
        let mut open = vec![start];
        while let Some(&view) = open.last() {
            if !is_taken[view] {
                is_taken[view] = true;
                order.push(view);
            }
            let own = overlap(view);
            own.iter().for_each(|&other| is_own[other as usize] = true);
            let common = |other: usize| overlap(other).iter().filter(|&&view| is_own[view as usize]).count();
            let left = own.iter().map(|&other| other as usize).filter(|&other| !is_taken[other]);
            let next = left.max_by_key(|&other| (common(other), Reverse(other)));
            own.iter().for_each(|&other| is_own[other as usize] = false);
            match next {
                Some(other) => open.push(other),
                None => drop(open.pop()),
            }
        }
    }
    order
}

/// Two views that may see the same surface, the first of the lower number.
struct Pair {
    views: [u32; 2],
    /// Common sparse points, as the exponent of a power of two: long tracks are counted in part.
    magnitude: Option<u32>,
    squared_distance: f64,
}

impl Pair {
    /// That with the most common points first, of about equally many that of the nearest cameras.
    fn compare(&self, other: &Pair) -> Ordering {
        let by_points = other.magnitude.cmp(&self.magnitude);
        let by_distance = self.squared_distance.total_cmp(&other.squared_distance);
        by_points.then(by_distance).then(self.views.cmp(&other.views))
    }
}

/// The pairs of views that share sparse points, and of those that share none with any other view, the pairs
/// with the nearest ones.
fn pairs(centers: &[DVec3], points: &[SparsePoint]) -> Vec<Pair> {
    let views = centers.len();
    let tracks = Tracks::new(views, points);
    let (mut pairs, mut is_alone) = (Vec::new(), vec![true; views]);
    let pair = |a: usize, b: usize, magnitude| Pair {
        views: [a.min(b) as u32, a.max(b) as u32],
        magnitude,
        squared_distance: centers[a].distance_squared(centers[b]),
    };
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
            (is_alone[view], is_alone[other]) = (false, false);
            pairs.push(pair(view, other, std::mem::take(&mut counts[other]).checked_ilog2()));
        }
    }
    for view in (0..views).filter(|&view| is_alone[view]) {
        pairs.extend(nearest_views(centers, view).into_iter().map(|other| pair(view, other as usize, None)));
    }
    pairs
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
    fn neighbors_in_the_scene_are_fused_one_after_the_other() {
        let order = |overlaps: &[Vec<u32>]| fusion_order(overlaps.len(), |view| &overlaps[view]);
        // Two places that were photographed by turns.
        let by_turns: Vec<Vec<u32>> = (0..6)
            .map(|view| (0..6).filter(|&other| other != view && other % 2 == view % 2).collect())
            .collect();
        assert_eq!(order(&by_turns), [0, 2, 4, 1, 3, 5]);
        // A row of views, each with its two neighbors, whose numbers are mixed.
        let numbers = [3, 0, 4, 1, 2];
        let mut row = vec![Vec::new(); 5];
        for pair in numbers.windows(2) {
            row[pair[0]].push(pair[1] as u32);
            row[pair[1]].push(pair[0] as u32);
        }
        assert_eq!(order(&row), [0, 3, 4, 1, 2]);
        let all: Vec<Vec<u32>> = (0..4).map(|view| (0..4).filter(|&other| other != view).collect()).collect();
        assert_eq!(order(&all), [0, 1, 2, 3]);
        assert_eq!(order(&[vec![], vec![]]), [0, 1]);
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
            assert_eq!(own.len(), 24, "{view}: {own:?}");
            let near = (1..=5).flat_map(|distance| [view - distance, view + distance]);
            assert!(near.into_iter().all(|other| own.contains(&other)), "{view}: {own:?}");
        }
    }

    #[test]
    fn of_equally_many_common_points_the_nearest_cameras_decide() {
        let centers: Vec<DVec3> = (0..100).map(|view| DVec3::X * f64::from(view)).collect();
        let found = overlaps(&centers, &[point(0..100), point(0..100)]);
        assert!(found[50].iter().copied().eq((38..50).chain(51..63)));
        assert!(found[0][..12].iter().copied().eq(1..13), "the others near it have enough");
        assert!(is_mutual(&found));
    }

    #[test]
    fn a_view_that_all_others_would_leave_out_is_compared_with_some_of_them() {
        // The last view is far from the others, which have enough near ones.
        let centers: Vec<DVec3> = (0..100).map(|view| DVec3::X * f64::from(view + view / 99 * 900)).collect();
        let found = overlaps(&centers, &[point(0..100)]);
        assert_eq!(found[99].len(), 8);
        assert!(found.iter().all(|own| (8..=25).contains(&own.len())));
        assert!(is_mutual(&found));
    }

    #[test]
    fn a_view_without_points_overlaps_the_nearest_views_of_a_large_scene() {
        let centers: Vec<DVec3> = (0..3000).map(|view| DVec3::X * f64::from(view)).collect();
        let found = overlaps(&centers, &[point([0, 2999])]);
        assert!(found[0].contains(&2999));
        assert!(found[1500].iter().copied().eq((1488..1500).chain(1501..1513)));
        assert!(is_mutual(&found));
        assert!(found.iter().all(|own| own.len() <= 24));
    }
}
