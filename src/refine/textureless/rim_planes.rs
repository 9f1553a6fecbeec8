//! The planes that the pixels around a region are on: RANSAC, one plane after the other, each refined by
//! least squares.

use crate::ambc::Random;
use glam::{DMat3, DVec3};

/// Relative error of inverse depth up to which a sample is on a plane: above the errors of search. Chosen on
/// renderings.
const TOLERANCE: f64 = 0.004;
/// Most planes, each fitted without the samples of those before it: a region has few neighboring surfaces.
const MAX_PLANES: usize = 5;
/// Planes through three random samples that are tried for each: they find a plane with 20 % of the samples in
/// more than half of all cases, one with 40 % nearly always.
const TRIALS: usize = 100;
/// Most samples that a trial is evaluated on; more do not change which one wins.
const TRIAL_SAMPLES: usize = 300;
/// Smallest double area in square pixels of the triangle of three samples: those on a line determine no
/// plane.
const MIN_DOUBLE_AREA: f64 = 0.5;
/// Fewest samples of a plane: fewer are on one by chance.
const MIN_SAMPLES: usize = 8;
/// Smallest determinant of the normal matrix that is inverted: that of samples on a line is 0 up to rounding.
const MIN_DETERMINANT: f64 = 1e-6;

/// A validated pixel beside a region.
#[derive(Debug, Clone, Copy)]
pub(super) struct RimSample {
    /// Column, row and 1.
    pub place: DVec3,
    /// Inverse of its depth.
    pub inverse_depth: f64,
}

/// A plane that many samples are on.
#[derive(Debug, Clone, Copy)]
pub(super) struct RimPlane {
    /// Its coefficients: `inverse depth = plane . [x y 1]`.
    pub plane: DVec3,
    /// Fraction of all samples that are on it.
    pub inlier_fraction: f64,
}

impl RimSample {
    fn is_on(&self, plane: DVec3) -> bool {
        let error = plane.dot(self.place) - self.inverse_depth;
        error.abs() <= TOLERANCE * self.inverse_depth
    }
}

/// The planes with the most samples, by the number that the planes before left over. The random numbers
/// depend on the region and the number of samples only.
pub(super) fn fit_rim_planes(samples: &[RimSample], region: u64) -> Vec<RimPlane> {
    let mut left = samples.to_vec();
    let mut random = Random::new(region, samples.len() as u64);
    let mut planes = Vec::new();
    while planes.len() < MAX_PLANES && left.len() >= MIN_SAMPLES {
        let rough = ransac_plane(&left, &mut random);
        let Some(plane) = least_squares(left.iter().filter(|sample| sample.is_on(rough))) else {
            break;
        };
        let before = left.len();
        left.retain(|sample| !sample.is_on(plane));
        if before - left.len() < MIN_SAMPLES {
            break;
        }
        let inliers = samples.iter().filter(|sample| sample.is_on(plane)).count();
        planes.push(RimPlane { plane, inlier_fraction: inliers as f64 / samples.len() as f64 });
    }
    planes
}

/// The plane through three random samples that most samples are on; zeros without any.
fn ransac_plane(samples: &[RimSample], random: &mut Random) -> DVec3 {
    let step = samples.len().div_ceil(TRIAL_SAMPLES);
    let (mut most, mut best) = (0, DVec3::ZERO);
    for _ in 0..TRIALS {
        let three = [(); 3].map(|()| samples[random.below(samples.len())]);
        let places = DMat3::from_cols(three[0].place, three[1].place, three[2].place).transpose();
        if places.determinant().abs() < MIN_DOUBLE_AREA {
            continue;
        }
        let plane = places.inverse() * DVec3::from_array(three.map(|sample| sample.inverse_depth));
        let inliers = samples.iter().step_by(step).filter(|sample| sample.is_on(plane)).count();
        if inliers > most {
            (most, best) = (inliers, plane);
        }
    }
    best
}

fn least_squares<'a>(samples: impl Iterator<Item = &'a RimSample>) -> Option<DVec3> {
    let (mut normal_matrix, mut right_side, mut count) = (DMat3::ZERO, DVec3::ZERO, 0);
    for RimSample { place, inverse_depth } in samples {
        normal_matrix += DMat3::from_cols(*place * place.x, *place * place.y, *place * place.z);
        right_side += *place * *inverse_depth;
        count += 1;
    }
    let is_regular = count >= 3 && normal_matrix.determinant().abs() > MIN_DETERMINANT;
    is_regular.then(|| normal_matrix.inverse() * right_side)
}
