//! The distance to the nearest of many points.
//!
//! The tree is the array of the points itself: the middle one of a part splits it in the median along an
//! axis, so there is nothing to store but the axis of each.

/// Points of a part that are looked at one by one.
const LEAF: usize = 16;
/// Points of a part above which its halves are sorted by two threads.
const PARALLEL: usize = 1 << 14;

/// Points in the order of the tree.
pub struct KdTree {
    points: Vec<[f64; 3]>,
    /// The axis along which the middle point of a part splits it, at the place of the middle point.
    axes: Vec<u8>,
}

impl KdTree {
    /// Sorts finite points, on the threads of the caller's pool.
    pub fn new(mut points: Vec<[f64; 3]>) -> KdTree {
        let mut axes = vec![0; points.len()];
        sort(&mut points, &mut axes);
        KdTree { points, axes }
    }

    /// The distance to the nearest point; infinite if there is none.
    pub fn distance(&self, point: &[f64; 3]) -> f64 {
        let mut least = f64::INFINITY;
        self.search(point, 0, self.points.len(), &mut least);
        least.sqrt()
    }

    /// Lowers `least`, a squared distance, to that of the nearest point of a part.
    fn search(&self, point: &[f64; 3], start: usize, end: usize, least: &mut f64) {
        if end - start <= LEAF {
            for other in &self.points[start..end] {
                *least = least.min(squared_distance(point, other));
            }
            return;
        }
        let middle = start + (end - start) / 2;
        let axis = usize::from(self.axes[middle]);
        let beyond = point[axis] - self.points[middle][axis];
        *least = least.min(squared_distance(point, &self.points[middle]));
        let (lower, upper) = ((start, middle), (middle + 1, end));
        let (near, far) = if beyond < 0.0 { (lower, upper) } else { (upper, lower) };
        self.search(point, near.0, near.1, least);
        if beyond * beyond < *least {
            self.search(point, far.0, far.1, least);
        }
    }
}

/// Sorts a part: the middle point has the median along the axis in which the part is longest.
fn sort(points: &mut [[f64; 3]], axes: &mut [u8]) {
    if points.len() <= LEAF {
        return;
    }
    let middle = points.len() / 2;
    let length = |axis: usize| {
        let places = points.iter().map(|point| point[axis]);
        let (least, most) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), place| {
            (least.min(place), most.max(place))
        });
        most - least
    };
    let axis = (0..3).max_by(|a, b| length(*a).total_cmp(&length(*b))).unwrap_or(0);
    points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    axes[middle] = axis as u8;
    let is_large = points.len() > PARALLEL;
    let (lower, upper) = points.split_at_mut(middle);
    let (lower_axes, upper_axes) = axes.split_at_mut(middle);
    let (upper, upper_axes) = (&mut upper[1..], &mut upper_axes[1..]);
    if is_large {
        rayon::join(|| sort(lower, lower_axes), || sort(upper, upper_axes));
    } else {
        sort(lower, lower_axes);
        sort(upper, upper_axes);
    }
}

fn squared_distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look random, from 0 to 1.
    fn numbers(count: usize, seed: u64) -> Vec<[f64; 3]> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        (0..count).map(|_| [next(), next(), next()]).collect()
    }

    #[test]
    fn the_nearest_of_all_points_is_found() {
        // Of each kind: points in space, in a plane, on few places, and few points.
        let plane = numbers(2000, 2).into_iter().map(|[x, y, _]| [x, y, 0.5]).collect();
        let places =
            numbers(2000, 3).into_iter().map(|point| point.map(|place| (4.0 * place).floor())).collect();
        for points in [numbers(3000, 1), plane, places, numbers(3, 4), numbers(20_000, 5)] {
            let tree = KdTree::new(points.clone());
            for wanted in numbers(100, 9) {
                let nearest =
                    points.iter().map(|point| squared_distance(point, &wanted)).fold(f64::INFINITY, f64::min);
                assert_eq!(tree.distance(&wanted), nearest.sqrt());
            }
        }
        assert_eq!(KdTree::new(Vec::new()).distance(&[0.0; 3]), f64::INFINITY);
    }
}
