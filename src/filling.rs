//! Filling, beyond the paper: where the image shows nothing but noise no search finds a surface, but what surrounds such a
//! place tells of it. Each connected part is filled with the plane that most of its rim lies on, if there is one; it
//! must pass the consistency check like everything else.

use crate::ambc::{FoodSource, Random};
use crate::kernels::SlantedPlane;
use crate::views::Reference;
use glam::{DMat3, DVec3};

/// Width of the rim, in pixels.
const RIM: usize = 3;
/// Relative difference of inverse depths within which a pixel of the rim lies on the plane.
const TOLERANCE: f64 = 0.004;
/// Share of the rim that must, reckoned as if it went on along the border of the image without lying on the plane: a sky
/// goes on from the ground on one side only.
const MIN_SHARE: f64 = 0.6;
/// Pixels a rim has at least, by the square root of the part's area: a full one around a disc has 3.5 for each pixel of its
/// width.
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
        let (part, rim, framed) = trace(planes, weak, width, pixel, parts, &mut part_of);
        let witness = |&pixel: &usize| Witness {
            place: DVec3::new((pixel % width) as f64, (pixel / width) as f64, 1.0),
            inverse_depth: 1.0 / f64::from(planes[pixel].depth),
        };
        let rim: Vec<Witness> = rim.iter().map(witness).collect();
        if let Some(plane) = common_plane(&rim, (part.len(), framed), u64::from(parts)) {
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

/// The connected part a pixel belongs to, the validated pixels around it, and their share of its outline, the rest of
/// which is the border of the image.
fn trace(
    planes: &[FoodSource],
    weak: &[bool],
    width: usize,
    first: usize,
    number: u32,
    part_of: &mut [u32],
) -> (Vec<usize>, Vec<usize>, f64) {
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
    let (mut framed, mut outline) = (0, 0);
    let mut next = 0;
    while next < part.len() {
        for neighbour in neighbours(part[next]) {
            match neighbour {
                Some(neighbour) if is_open(planes, weak, neighbour) => {
                    if part_of[neighbour] != number {
                        part_of[neighbour] = number;
                        part.push(neighbour);
                    }
                }
                // Pixels without a surface say nothing.
                Some(neighbour) if !planes[neighbour].validated => {}
                other => {
                    outline += 1;
                    framed += u32::from(other.is_some());
                }
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
    (part, rim, f64::from(framed) / f64::from(outline.max(1)))
}

/// The plane, as inverse depth over column, row and 1, that enough of the rim of a part of this area lies on; the rim is
/// this share of the outline.
fn common_plane(rim: &[Witness], (area, framed): (usize, f64), part: u64) -> Option<DVec3> {
    let frame = MIN_FRAME * RIM as f64 * (area as f64).sqrt();
    if rim.len() < 3 || (rim.len() as f64) < frame || framed < MIN_SHARE {
        return None;
    }
    let lies_on = |plane: DVec3| {
        move |witness: &&Witness| {
            let off = plane.dot(witness.place) - witness.inverse_depth;
            off.abs() <= TOLERANCE * witness.inverse_depth
        }
    };
    let every = rim.len().div_ceil(WITNESSES);
    let mut random = Random::new(part, rim.len() as u64);
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
    let share = rim.iter().filter(lies_on(plane)).count() as f64 / rim.len() as f64;
    (share * framed >= MIN_SHARE).then_some(plane)
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
    let plane = SlantedPlane {
        inverse_depth: plane.dot(DVec3::new(x as f64, y as f64, 1.0)) as f32,
        slope_x: plane.x as f32,
        slope_y: plane.y as f32,
    };
    let found = FoodSource::of_plane(reference, reference.ray(x as f32, y as f32), &plane)?;
    Some(FoodSource { validated: true, ..found })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, World};
    use glam::Vec3;

    const SIZE: (u32, u32) = (60, 48);
    const WIDTH: usize = SIZE.0 as usize;
    const PIXELS: usize = WIDTH * SIZE.1 as usize;

    /// The wall seen by one camera; the pixels of a hole have wrong planes that are not validated.
    struct Holed {
        world: World,
        planes: Vec<FoodSource>,
        weak: Vec<bool>,
    }

    fn holed(is_hole: impl Fn(i32, i32) -> bool) -> Holed {
        let world = World::new(&[0.0], SIZE);
        let weak: Vec<bool> = (0..PIXELS).map(|pixel| is_hole(column(pixel), row(pixel))).collect();
        let plane = |pixel: usize| match weak[pixel] {
            true => FoodSource { cost: 2.0, ..FoodSource::new(3.0, Vec3::NEG_Z) },
            false => FoodSource { validated: true, cost: 0.1, ..exact(&world, pixel) },
        };
        Holed { planes: (0..PIXELS).map(plane).collect(), world, weak }
    }

    fn exact(world: &World, pixel: usize) -> FoodSource {
        FoodSource::new(testing::depth(&world.cameras[0], pixel), testing::normal(&world.cameras[0]))
    }

    fn column(pixel: usize) -> i32 {
        (pixel % WIDTH) as i32
    }

    fn row(pixel: usize) -> i32 {
        (pixel / WIDTH) as i32
    }

    fn is_in_disc(x: i32, y: i32) -> bool {
        (x - 30).pow(2) + (y - 24).pow(2) <= 100
    }

    impl Holed {
        /// Fills, and checks that what is not filled is as it was.
        fn fill(&mut self) -> Vec<usize> {
            let before = self.planes.clone();
            let mut filled = fill(&self.world.reference(), &mut self.planes, &self.weak);
            filled.sort_unstable();
            for (pixel, before) in before.iter().enumerate() {
                assert_eq!(self.planes[pixel].cost, before.cost, "filling does not match");
                match filled.binary_search(&pixel) {
                    Ok(_) => assert!(self.weak[pixel] && !before.validated && before.depth > 0.0),
                    Err(_) => assert_eq!(self.planes[pixel], *before),
                }
            }
            filled
        }

        fn hole(&self) -> Vec<usize> {
            (0..PIXELS).filter(|&pixel| self.weak[pixel]).collect()
        }

        fn assert_on_the_wall(&self, pixels: &[usize]) {
            for &pixel in pixels {
                let (found, exact) = (&self.planes[pixel], exact(&self.world, pixel));
                assert!(found.validated);
                assert!((found.depth / exact.depth - 1.0).abs() < 1e-4, "{found:?} instead of {exact:?}");
                let sine = found.normal.cross(exact.normal).length();
                assert!(sine < 0.1f32.to_radians().sin(), "{found:?} instead of {exact:?}");
            }
        }
    }

    #[test]
    fn a_hole_is_filled_with_the_plane_around_it() {
        let mut holed = holed(is_in_disc);
        let filled = holed.fill();
        assert_eq!(filled, holed.hole());
        holed.assert_on_the_wall(&filled);
    }

    #[test]
    fn each_part_is_filled_by_itself() {
        let mut holed =
            holed(|x, y| (x - 15).pow(2) + (y - 24).pow(2) <= 60 || (41..52).contains(&x) && y > 30);
        for pixel in (0..PIXELS).filter(|&pixel| column(pixel) > 30) {
            holed.planes[pixel].depth *= 1.3;
        }
        let filled = holed.fill();
        assert_eq!(filled, holed.hole());
        let left: Vec<usize> = filled.iter().copied().filter(|&pixel| column(pixel) < 30).collect();
        holed.assert_on_the_wall(&left);
        let mut right: Vec<usize> = filled.into_iter().filter(|&pixel| column(pixel) > 30).collect();
        right.retain(|&pixel| {
            (holed.planes[pixel].depth / exact(&holed.world, pixel).depth - 1.3).abs() > 1e-3
        });
        assert_eq!(right, []);
    }

    #[test]
    fn something_before_a_third_of_the_rim_does_not_spoil_it() {
        let mut holed = holed(is_in_disc);
        for pixel in 0..PIXELS {
            let (x, y) = (f64::from(column(pixel) - 30), f64::from(row(pixel) - 24));
            if !holed.weak[pixel] && x > 0.5 * x.hypot(y) {
                holed.planes[pixel].depth *= 0.8;
            }
        }
        let filled = holed.fill();
        assert_eq!(filled, holed.hole());
        holed.assert_on_the_wall(&filled);
    }

    #[test]
    fn a_hole_at_the_border_is_filled_unless_it_is_framed_too_little() {
        let mut framed = holed(|x, y| (16..45).contains(&x) && y >= 30);
        let filled = framed.fill();
        assert_eq!(filled, framed.hole());
        framed.assert_on_the_wall(&filled);
        assert_eq!(holed(|_, y| y < 8).fill(), [], "a sky");
        assert_eq!(holed(|_, y| y >= 12).fill(), []);
        assert_eq!(holed(|_, _| true).fill(), [], "nothing is around it");
    }

    #[test]
    fn a_hole_whose_rim_lies_on_no_common_plane_stays() {
        let mut holed = holed(is_in_disc);
        for pixel in (0..PIXELS).filter(|&pixel| !is_in_disc(column(pixel), row(pixel))) {
            let (x, y) = ((column(pixel) - 30) as f32, (row(pixel) - 24) as f32);
            holed.planes[pixel].depth *= 1.0 + 0.05 * (4.0 * y.atan2(x)).sin();
        }
        assert_eq!(holed.fill(), []);
    }

    #[test]
    fn pixels_that_can_be_matched_are_validated_or_masked_stay() {
        let mut holed = holed(is_in_disc);
        let hole = holed.hole();
        let at = |x: usize, y: usize| y * WIDTH + x;
        // Not validated, but matched; validated, but weak; left out by a mask.
        let (matched, validated, masked) = (at(30, 24), at(27, 22), at(33, 26));
        holed.weak[matched] = false;
        holed.planes[validated] = FoodSource { validated: true, ..exact(&holed.world, validated) };
        holed.planes[masked] = FoodSource::new(0.0, Vec3::ZERO);
        let filled = holed.fill();
        let rest = hole.into_iter().filter(|pixel| ![matched, validated, masked].contains(pixel));
        assert_eq!(filled, rest.collect::<Vec<_>>());
        holed.assert_on_the_wall(&filled);
        holed.weak.fill(false);
        filled.iter().for_each(|&pixel| holed.planes[pixel].validated = false);
        assert_eq!(holed.fill(), []);
    }

    #[test]
    fn a_pixel_whose_plane_leaves_the_depth_range_stays() {
        let mut holed = holed(is_in_disc);
        let depths = holed.hole().into_iter().map(|pixel| exact(&holed.world, pixel).depth);
        let far = depths.clone().fold(0.0, f32::max) - 0.1;
        let count = depths.filter(|&depth| depth <= far).count();
        let mut reference = holed.world.reference();
        reference.far = far;
        let filled = fill(&reference, &mut holed.planes, &holed.weak);
        assert!(filled.len() < holed.hole().len() && filled.len().abs_diff(count) <= 1);
        assert!(filled.iter().all(|&pixel| holed.planes[pixel].depth <= far));
    }
}
