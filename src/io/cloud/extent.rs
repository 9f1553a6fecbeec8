//! Where the points of a cloud lie and how far apart, from which files get their precision.

use crate::error::Result;
use crate::fusion::CloudSource;
use glam::DVec3;

/// Error of a stored coordinate, as a fraction of the distance of neighboring points, that is too large.
const MAX_ERROR: f64 = 0.125;
/// Fraction of the points with such an error for which 32-bit floats do not suffice.
const MAX_COARSE_FRACTION: f64 = 0.1;
/// Fraction of the distances between points that are below the spacing.
#[cfg(feature = "las")]
const SPACING_FRACTION: f64 = 0.1;
/// Exponents of 64-bit floats.
const EXPONENTS: usize = 2048;

/// The extent of a cloud.
///
/// Fusion gives points row by row, so that most points follow a neighbor; in a cloud in another order the
/// distances of successive points are too large, and the mean density on a surface as large as the bounds
/// takes their place.
pub(super) struct Extent {
    pub min: DVec3,
    pub max: DVec3,
    count: u64,
    last: Option<DVec3>,
    /// Distances other than 0 of successive points, by their exponent.
    distances: Vec<u64>,
    /// Points whose rounding to 32-bit floats is too large for their distance to the one before.
    coarse: u64,
}

impl Extent {
    /// The extent of these points.
    ///
    /// # Errors
    /// Points that cannot be read.
    pub(super) fn of(source: &dyn CloudSource) -> Result<Extent> {
        let mut extent = Extent {
            min: DVec3::INFINITY,
            max: DVec3::NEG_INFINITY,
            count: 0,
            last: None,
            distances: vec![0; EXPONENTS],
            coarse: 0,
        };
        source.each_part(&mut |points| {
            points.positions.iter().for_each(|&position| extent.add(position.into()));
            Ok(())
        })?;
        Ok(extent)
    }

    fn add(&mut self, position: DVec3) {
        self.min = self.min.min(position);
        self.max = self.max.max(position);
        self.count += 1;
        let distance = self.last.replace(position).map_or(0.0, |last| last.distance(position));
        if distance > 0.0 {
            self.distances[exponent(distance)] += 1;
            self.coarse += u64::from(rounding(position) > MAX_ERROR * distance);
        }
    }

    /// Distance of neighboring points: one of the smaller ones, within a factor of two. 0 for fewer than two
    /// points.
    #[cfg(feature = "las")]
    pub(super) fn spacing(&self) -> f64 {
        let total: u64 = self.distances.iter().sum();
        let mut below = (total as f64 * SPACING_FRACTION).ceil() as u64;
        let of_neighbors = self.distances.iter().position(|&count| {
            let is_there = count > 0 && below <= count;
            below = below.saturating_sub(count);
            is_there
        });
        let of_neighbors = of_neighbors.map_or(0.0, |exponent| f64::from_bits((exponent as u64) << 52));
        of_neighbors.min(self.mean_spacing())
    }

    /// Whether 32-bit floats would move many points by a part of the distance to their neighbors.
    pub(super) fn exceeds_floats(&self) -> bool {
        if self.count < 2 {
            return false;
        }
        let compared: u64 = self.distances.iter().sum();
        let largest = rounding(self.min).max(rounding(self.max));
        self.coarse as f64 > compared as f64 * MAX_COARSE_FRACTION
            || largest > MAX_ERROR * self.mean_spacing()
    }

    /// Distance of neighbors if the points were spread evenly on a square of the size of the bounds.
    fn mean_spacing(&self) -> f64 {
        if self.count < 2 { 0.0 } else { self.min.distance(self.max) / (self.count as f64).sqrt() }
    }
}

fn exponent(distance: f64) -> usize {
    (distance.to_bits() >> 52) as usize % EXPONENTS
}

/// Distance of the 32-bit floats around the largest coordinate.
fn rounding(position: DVec3) -> f64 {
    position.abs().max_element() * f64::from(f32::EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fusion::PointCloud;

    /// A square of 50 x 50 points at a distance of 1 mm.
    fn square(corner: [f64; 3]) -> PointCloud {
        let position = |index: usize| {
            (DVec3::from(corner) + 1e-3 * DVec3::new((index % 50) as f64, (index / 50) as f64, 0.0)).into()
        };
        PointCloud { positions: (0..2500).map(position).collect(), ..PointCloud::default() }
    }

    fn exceeds(cloud: &PointCloud) -> bool {
        Extent::of(cloud).unwrap().exceeds_floats()
    }

    #[test]
    fn only_coordinates_that_are_large_for_the_spacing_exceed_floats() {
        assert!(!exceeds(&square([0.0, 0.0, 2.0])));
        assert!(!exceeds(&square([500.0, -200.0, 30.0])));
        assert!(exceeds(&square([500e3, 5e6, 100.0])), "UTM");
        assert!(exceeds(&square([4.1e6, -0.9e6, 4.7e6])), "ECEF");
        assert!(!exceeds(&PointCloud::default()));
    }

    #[test]
    fn neither_the_order_nor_a_distant_point_decides() {
        let mut far = square([0.0, 0.0, 2.0]);
        far.positions.push([1e5, 1e5, 1e5]);
        assert!(!exceeds(&far));
        let mut mixed = square([500e3, 5e6, 100.0]);
        mixed.positions.sort_by_key(|position| (position[0] * 1e3) as u64 * 7919 % 2503);
        assert!(exceeds(&mixed));
    }

    #[test]
    fn the_spacing_is_that_of_neighbors_within_a_factor_of_two() {
        let spacing = Extent::of(&square([7.0, 8.0, 9.0])).unwrap().spacing();
        assert!((0.5e-3..=1e-3).contains(&spacing), "{spacing}");
        assert_eq!(Extent::of(&PointCloud::default()).unwrap().spacing(), 0.0);
    }
}
