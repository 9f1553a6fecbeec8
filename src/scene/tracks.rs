//! The observations of the sparse points: the views of each point, the points of each view, and the pairs of
//! views that share points.

use super::SparsePoint;

/// Pairs of views, counted over all points, up to which every pair of every track is taken.
const MAX_PAIRS: u64 = 1 << 24;
/// Views of its track that each observation is paired with at least: larger scenes have as many pairs as half
/// of this for each observation, and so do not grow with the square of the tracks' lengths.
const MIN_PARTNERS: u64 = 32;
/// The golden ratio in 64 bits: the fractions of its multiples are spread evenly.
const GOLDEN_RATIO: u64 = 0x9e37_79b9_7f4a_7c15;

/// The observations of the sparse points, by point and by view; as large as the points themselves.
pub(crate) struct Tracks {
    /// The views of all points, point after point, ascending and each once.
    views: Vec<u32>,
    /// Where the views of each point start, and their end.
    tracks: Vec<usize>,
    /// The observations of all views, view after view, by point.
    observations: Vec<Observation>,
    /// Where the observations of each view start, and their end.
    by_view: Vec<usize>,
    /// Views of its track that an observation is paired with at most: a power of two.
    max_partners: u64,
}

/// An observation of a view.
#[derive(Debug, Clone, Copy, Default)]
struct Observation {
    point: usize,
    /// Place of the view in the track of the point.
    place: u32,
}

impl Tracks {
    /// The tracks of the points, whose views must be below `views`.
    pub(crate) fn new(views: usize, points: &[SparsePoint]) -> Tracks {
        let mut tracks = Tracks {
            views: Vec::with_capacity(points.iter().map(|point| point.views.len()).sum()),
            tracks: vec![0],
            observations: Vec::new(),
            by_view: vec![0; views + 1],
            max_partners: 0,
        };
        let mut track = Vec::new();
        for point in points {
            track.clone_from(&point.views);
            track.sort_unstable();
            track.dedup();
            tracks.views.extend_from_slice(&track);
            tracks.tracks.push(tracks.views.len());
        }
        tracks.max_partners = max_partners(tracks.tracks.windows(2).map(|ends| ends[1] - ends[0]));
        tracks.sort_by_view();
        tracks
    }

    /// Fills `observations` and `by_view`: a counting sort.
    fn sort_by_view(&mut self) {
        for &view in &self.views {
            self.by_view[view as usize + 1] += 1;
        }
        for view in 1..self.by_view.len() {
            self.by_view[view] += self.by_view[view - 1];
        }
        let mut next = self.by_view.clone();
        let mut observations = vec![Observation::default(); self.views.len()];
        for point in 0..self.tracks.len() - 1 {
            for (place, &view) in (0..).zip(self.track(point)) {
                observations[next[view as usize]] = Observation { point, place };
                next[view as usize] += 1;
            }
        }
        self.observations = observations;
    }

    /// The views of a point, ascending.
    fn track(&self, point: usize) -> &[u32] {
        &self.views[self.tracks[point]..self.tracks[point + 1]]
    }

    fn observations_of(&self, view: usize) -> &[Observation] {
        &self.observations[self.by_view[view]..self.by_view[view + 1]]
    }

    /// The points of a view, ascending.
    pub(crate) fn points_of(&self, view: usize) -> impl Iterator<Item = usize> {
        self.observations_of(view).iter().map(|observation| observation.point)
    }

    /// Calls `work` with the points that a view shares with views of a higher number, and with these views.
    ///
    /// All pairs of views of all points where these are at most [`MAX_PAIRS`], or where no track has more
    /// than [`MIN_PARTNERS`] + 1 views. Otherwise the pairs of the longest tracks are thinned out, the same
    /// ones in every call: views at certain distances within the track are paired, others for every point, so
    /// that two views with many common points keep a fraction of them.
    pub(crate) fn each_pair(&self, view: usize, mut work: impl FnMut(usize, usize)) {
        for &Observation { point, place } in self.observations_of(view) {
            let track = self.track(point);
            let place = place as usize;
            if track.len() as u64 - 1 <= self.max_partners {
                track[place + 1..].iter().for_each(|&other| work(other as usize, point));
                continue;
            }
            for distance in self.distances(track.len(), point) {
                // The track is a ring here: every view has as many partners.
                let (ahead, around) = (place + distance, place + track.len() - distance);
                if ahead < track.len() {
                    work(track[ahead] as usize, point);
                }
                if around < track.len() && around != ahead {
                    work(track[around] as usize, point);
                }
            }
        }
    }

    /// The distances of views in a long track, as a ring, that are paired: half as many as each view may have
    /// partners, evenly spread, from a start that depends on the point.
    fn distances(&self, length: usize, point: usize) -> impl Iterator<Item = usize> {
        let (all, wanted) = (length as u64 / 2, self.max_partners / 2);
        let start = (((point as u64).wrapping_mul(GOLDEN_RATIO) >> 32) * all) >> 32;
        let shift = wanted.trailing_zeros();
        (0..wanted).map(move |index| {
            let distance = start + ((index * all) >> shift);
            1 + if distance < all { distance } else { distance - all } as usize
        })
    }
}

/// The number of views of its track that an observation is paired with at most, for tracks of these lengths:
/// the largest power of two with at most [`MAX_PAIRS`] pairs in all, or else [`MIN_PARTNERS`] / 2 pairs an
/// observation.
fn max_partners(lengths: impl Iterator<Item = usize>) -> u64 {
    let mut counts = std::collections::BTreeMap::<u64, u64>::new();
    lengths.for_each(|length| *counts.entry(length as u64).or_default() += 1);
    let pairs = |partners: u64| -> u64 {
        let each = |(&length, &count): (&u64, &u64)| count * length * partners.min(length.max(1) - 1) / 2;
        counts.iter().map(each).sum()
    };
    let observations: u64 = counts.iter().map(|(length, count)| length * count).sum();
    let most = MAX_PAIRS.max(MIN_PARTNERS / 2 * observations);
    let longest = counts.keys().last().copied().unwrap_or(0);
    let mut partners = MIN_PARTNERS;
    while partners < longest && pairs(2 * partners) <= most {
        partners *= 2;
    }
    partners
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn points(count: usize, views: impl Fn(usize) -> Vec<u32>) -> Vec<SparsePoint> {
        (0..count).map(|point| SparsePoint { position: Default::default(), views: views(point) }).collect()
    }

    /// The number of points for each pair of views, the lower number first.
    fn counts(tracks: &Tracks, views: usize) -> BTreeMap<(usize, usize), usize> {
        let mut counts = BTreeMap::new();
        for view in 0..views {
            let mut with = vec![0; views];
            tracks.each_pair(view, |other, _| with[other] += 1);
            let pairs = with.into_iter().enumerate().map(|(other, count)| ((view, other), count));
            counts.extend(pairs.filter(|(_, count)| *count > 0));
        }
        counts
    }

    #[test]
    fn views_know_their_points_and_the_views_that_share_them_once() {
        let views: [&[u32]; 4] = [&[3, 0], &[], &[2, 3, 2, 0, 3], &[1]];
        let tracks = Tracks::new(5, &points(4, |point| views[point].to_vec()));
        let of: Vec<Vec<usize>> = (0..5).map(|view| tracks.points_of(view).collect()).collect();
        assert_eq!(of, [vec![0, 2], vec![3], vec![2], vec![0, 2], vec![]]);
        let expected = BTreeMap::from([((0, 2), 1), ((0, 3), 2), ((2, 3), 1)]);
        assert_eq!(counts(&tracks, 5), expected);
    }

    #[test]
    fn all_pairs_of_ordinary_scenes_are_taken() {
        // 300 views that see the same 300 points: 13 million pairs.
        let tracks = Tracks::new(300, &points(300, |_| (0..300).collect()));
        let counts = counts(&tracks, 300);
        assert_eq!(counts.len(), 300 * 299 / 2);
        assert!(counts.values().all(|&count| count == 300));
        // 2 million tracks that are not long: 1 billion pairs.
        let lengths = std::iter::repeat_n(MIN_PARTNERS as usize + 1, 2_000_000);
        assert!(max_partners(lengths) >= MIN_PARTNERS);
    }

    #[test]
    fn long_tracks_have_as_many_pairs_as_observations_and_every_pair_of_views_has_its_fraction() {
        let (views, points) = (121, points(6000, |point| (point as u32 % 2..121).collect()));
        let tracks = Tracks::new(views, &points);
        let counts = counts(&tracks, views);
        let observations: usize = points.iter().map(|point| point.views.len()).sum();
        let pairs: usize = counts.values().sum();
        assert!(pairs <= MIN_PARTNERS as usize / 2 * observations, "{pairs} pairs");
        assert!(pairs >= MIN_PARTNERS as usize / 4 * observations, "{pairs} pairs");
        assert_eq!(counts.len(), views * (views - 1) / 2);
        // 32 of the 120 partners; view 0 sees half of the points.
        let fraction = |(pair, &count): (&(usize, usize), &usize)| {
            count as f64 / if pair.0 == 0 { 3000.0 } else { 6000.0 }
        };
        let (least, most) = counts
            .iter()
            .map(fraction)
            .fold((1.0, 0.0), |(a, b): (f64, f64), fraction| (a.min(fraction), b.max(fraction)));
        assert!(least > 0.2 && most < 0.35, "{least} to {most}");
    }

    #[test]
    fn no_pair_of_a_long_track_is_taken_twice() {
        for length in [34, 35, 64, 65, 66, 67, 200, 201] {
            let mut tracks = Tracks::new(length, &points(9, |_| (0..length as u32).collect()));
            tracks.max_partners = MIN_PARTNERS;
            for point in 0..9 {
                let mut partners = vec![Vec::new(); length];
                for view in 0..length {
                    tracks.each_pair(view, |other, of| {
                        if of == point {
                            partners[view].push(other);
                            partners[other].push(view);
                        }
                    });
                }
                for own in &mut partners {
                    own.sort_unstable();
                    let all = own.len();
                    own.dedup();
                    assert_eq!(own.len(), all);
                    // One less where the view opposite in the ring is among them.
                    assert!([31, 32].contains(&all), "{all} of {length}");
                }
            }
        }
    }
}
