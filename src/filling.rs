//! Filling, beyond the paper: where the image shows nothing but noise no search finds a surface, but what surrounds such a
//! place tells of it. Each connected part is filled with the plane that most of its rim lies on, if there is one; it
//! must pass the consistency check like everything else.

use crate::ambc::{FoodSource, MIN_FACING, Random};
use crate::views::Reference;
use glam::{DMat3, DVec3, Vec3};

/// Width of the rim, in pixels.
const RIM: usize = 3;
/// Relative difference of inverse depths within which a pixel of the rim lies on the plane.
const TOLERANCE: f64 = 0.004;
/// Share of the rim that must.
const MIN_SHARE: f64 = 0.6;
/// Pixels of the rim that must, by the square root of the area: around a disc there are 3.5 for each pixel of width. Less
/// is no frame, and the plane is a guess far from it.
const MIN_FRAME: f64 = 1.5;
/// Planes through three pixels of the rim that are tried, and pixels they are tried on.
const TRIALS: usize = 100;
const WITNESSES: usize = 300;

/// A pixel of the rim: its column, row and 1, and its inverse depth.
#[derive(Debug, Clone, Copy)]
struct Witness {
    place: DVec3,
    inverse_depth: f64,
}

/// Fills the `weak` pixels that have no plane of validated origin; gives those it filled.
pub fn fill(reference: &Reference, planes: &mut [FoodSource], weak: &[bool]) -> Vec<usize> {
    let width = reference.image.width;
    let mut part_of = vec![0u32; planes.len()];
    let mut filled = Vec::new();
    let mut parts = 0;
    for pixel in 0..planes.len() {
        if part_of[pixel] != 0 || !is_open(planes, weak, pixel) {
            continue;
        }
        parts += 1;
        let (part, rim) = trace(planes, weak, width, pixel, parts, &mut part_of);
        let witness = |&pixel: &usize| Witness {
            place: DVec3::new((pixel % width) as f64, (pixel / width) as f64, 1.0),
            inverse_depth: 1.0 / f64::from(planes[pixel].depth),
        };
        let rim: Vec<Witness> = rim.iter().map(witness).collect();
        if let Some(plane) = common_plane(&rim, part.len(), u64::from(parts)) {
            for pixel in part {
                if let Some(found) = on_plane(reference, plane, (pixel % width, pixel / width)) {
                    planes[pixel] = FoodSource { cost: planes[pixel].cost, ..found };
                    filled.push(pixel);
                }
            }
        }
    }
    filled
}

fn is_open(planes: &[FoodSource], weak: &[bool], pixel: usize) -> bool {
    weak[pixel] && !planes[pixel].validated && planes[pixel].depth > 0.0
}

/// The connected part a pixel belongs to, and the validated pixels around it.
fn trace(
    planes: &[FoodSource],
    weak: &[bool],
    width: usize,
    first: usize,
    number: u32,
    part_of: &mut [u32],
) -> (Vec<usize>, Vec<usize>) {
    let height = planes.len() / width;
    let neighbours = |pixel: usize| {
        let (x, y) = (pixel % width, pixel / width);
        [
            (x > 0).then(|| pixel - 1),
            (x + 1 < width).then(|| pixel + 1),
            (y > 0).then(|| pixel - width),
            (y + 1 < height).then(|| pixel + width),
        ]
    };
    let mut part = vec![first];
    part_of[first] = number;
    let mut next = 0;
    while next < part.len() {
        for neighbour in neighbours(part[next]).into_iter().flatten() {
            if part_of[neighbour] != number && is_open(planes, weak, neighbour) {
                part_of[neighbour] = number;
                part.push(neighbour);
            }
        }
        next += 1;
    }
    let mut rim: Vec<usize> = Vec::new();
    let mut start = 0;
    for step in 0..RIM {
        let end = rim.len();
        let from = if step == 0 { &part[..] } else { &rim[start..end] };
        let mut found = Vec::new();
        for neighbour in from.iter().flat_map(|&pixel| neighbours(pixel)).flatten() {
            // A pixel of the rim may belong to the rims of several parts.
            if part_of[neighbour] != number && planes[neighbour].validated {
                part_of[neighbour] = number;
                found.push(neighbour);
            }
        }
        start = end;
        rim.extend(found);
    }
    (part, rim)
}

/// The plane, as inverse depth over column, row and 1, that enough of the rim lies on.
fn common_plane(rim: &[Witness], area: usize, part: u64) -> Option<DVec3> {
    let frame = MIN_FRAME * RIM as f64 * (area as f64).sqrt();
    if rim.len() < 3 || (rim.len() as f64) < frame {
        return None;
    }
    let lies_on = |plane: DVec3| {
        move |witness: &&Witness| {
            let off = plane.dot(witness.place) - witness.inverse_depth;
            off.abs() <= TOLERANCE * witness.inverse_depth
        }
    };
    let every = rim.len().div_ceil(WITNESSES);
    let mut random = Random::new(part, area as u64);
    let mut best = (0, DVec3::ZERO);
    for _ in 0..TRIALS {
        let three = [(); 3].map(|()| rim[random.below(rim.len())]);
        let places = DMat3::from_cols(three[0].place, three[1].place, three[2].place).transpose();
        if places.determinant().abs() < 0.5 {
            continue;
        }
        let depths = DVec3::from_array(three.map(|witness| witness.inverse_depth));
        let plane = places.inverse() * depths;
        let count = rim.iter().step_by(every).filter(lies_on(plane)).count();
        if count > best.0 {
            best = (count, plane);
        }
    }
    let plane = least_squares(rim.iter().filter(lies_on(best.1)))?;
    let count = rim.iter().filter(lies_on(plane)).count() as f64;
    (count >= MIN_SHARE * rim.len() as f64 && count >= frame).then_some(plane)
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

/// The plane at a pixel, unless it leaves the depth range or turns away there.
fn on_plane(reference: &Reference, plane: DVec3, (x, y): (usize, usize)) -> Option<FoodSource> {
    let (focal, principal) = (reference.inverse_focal, reference.principal);
    let inverse_depth = plane.dot(DVec3::new(x as f64, y as f64, 1.0));
    let depth = (1.0 / inverse_depth) as f32;
    // With q = plane . [x y 1] = m . ray and n . X = -D: n = -m / |m|.
    let towards = DVec3::new(
        plane.x / f64::from(focal.0),
        plane.y / f64::from(focal.1),
        plane.z + plane.x * f64::from(principal.0) + plane.y * f64::from(principal.1),
    );
    let normal: Vec3 = (-towards.normalize_or_zero()).as_vec3();
    let is_usable = depth >= reference.near
        && depth <= reference.far
        && normal.dot(reference.ray(x as f32, y as f32)) < -MIN_FACING;
    is_usable.then(|| FoodSource { validated: true, ..FoodSource::new(depth, normal) })
}
