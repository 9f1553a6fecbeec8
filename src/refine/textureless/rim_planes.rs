//! The planes that pixels around a part lie on.

use crate::ambc::Random;
use glam::{DMat3, DVec3};

/// Relative difference of inverse depths within which a witness lies on a plane.
const TOLERANCE: f64 = 0.004;
/// Planes that are looked for, each without the witnesses of those before it.
const MAX_PLANES: usize = 5;
/// Planes through three witnesses that are tried for each, and witnesses they are tried on.
const TRIALS: usize = 100;
const TRIED_ON: usize = 300;
/// Witnesses a plane has at least.
const MIN_WITNESSES: usize = 8;

/// A validated pixel: its column, row and 1, and its inverse depth.
#[derive(Debug, Clone, Copy)]
pub struct Witness {
    pub place: DVec3,
    pub inverse_depth: f64,
}

/// A plane, as inverse depth over column, row and 1, and the share of the witnesses that lie on it.
#[derive(Debug, Clone, Copy)]
pub struct RimPlane {
    pub plane: DVec3,
    pub share: f64,
}

impl Witness {
    fn lies_on(&self, plane: DVec3) -> bool {
        let off = plane.dot(self.place) - self.inverse_depth;
        off.abs() <= TOLERANCE * self.inverse_depth
    }
}

/// The planes that many of the witnesses of a part lie on, the commonest first.
pub fn common_planes(witnesses: &[Witness], part: u64) -> Vec<RimPlane> {
    let mut left = witnesses.to_vec();
    let mut random = Random::new(part, witnesses.len() as u64);
    let mut planes = Vec::new();
    while planes.len() < MAX_PLANES && left.len() >= MIN_WITNESSES {
        let commonest = commonest_plane(&left, &mut random);
        let Some(plane) = least_squares(left.iter().filter(|witness| witness.lies_on(commonest))) else {
            break;
        };
        let before = left.len();
        left.retain(|witness| !witness.lies_on(plane));
        if before - left.len() < MIN_WITNESSES {
            break;
        }
        let count = witnesses.iter().filter(|witness| witness.lies_on(plane)).count();
        planes.push(RimPlane { plane, share: count as f64 / witnesses.len() as f64 });
    }
    planes
}

/// The one of some planes through three witnesses that most of them lie on.
fn commonest_plane(witnesses: &[Witness], random: &mut Random) -> DVec3 {
    let every = witnesses.len().div_ceil(TRIED_ON);
    let mut best = (0, DVec3::ZERO);
    for _ in 0..TRIALS {
        let three = [(); 3].map(|()| witnesses[random.below(witnesses.len())]);
        let places = DMat3::from_cols(three[0].place, three[1].place, three[2].place).transpose();
        if places.determinant().abs() < 0.5 {
            continue;
        }
        let plane = places.inverse() * DVec3::from_array(three.map(|witness| witness.inverse_depth));
        let count = witnesses.iter().step_by(every).filter(|witness| witness.lies_on(plane)).count();
        if count > best.0 {
            best = (count, plane);
        }
    }
    best.1
}

fn least_squares<'a>(witnesses: impl Iterator<Item = &'a Witness>) -> Option<DVec3> {
    let (mut normal_matrix, mut right, mut count) = (DMat3::ZERO, DVec3::ZERO, 0);
    for Witness { place, inverse_depth } in witnesses {
        normal_matrix += DMat3::from_cols(*place * place.x, *place * place.y, *place * place.z);
        right += *place * *inverse_depth;
        count += 1;
    }
    (count >= 3 && normal_matrix.determinant().abs() > 1e-6).then(|| normal_matrix.inverse() * right)
}
