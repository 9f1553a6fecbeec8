//! Filling, beyond the paper: where the image shows nothing but noise no search finds a surface, but what surrounds such a
//! place tells of it. Each connected part is filled with one of the planes that its surroundings lie on: the one by which
//! the part looks the same in the source views. It must pass the consistency check like everything else.

mod photo_check;
mod region;
mod rim_planes;
#[cfg(test)]
mod tests;

use crate::ambc::FoodSource;
use crate::geometry::SlantedPlane;
use crate::matching::Problem;
use glam::DVec3;
use photo_check::Looks;
use region::{Marks, Part};
use rim_planes::{RimPlane, Witness, common_planes};

/// Share of the rim that must lie on the plane, reckoned as if the rim went on along the border of the image without lying
/// on it, where the source views agree with the plane, and where they cannot tell: a sky goes on from the ground on one
/// side only.
const MIN_SHARE_SEEN: f64 = 0.2;
const MIN_SHARE_UNSEEN: f64 = 0.6;
/// Share of the part's outline that must look the same in the source views.
const MIN_LOOKS: f64 = 0.8;
/// How much a plane that the whole rim lies on may look worse than one nothing lies on.
const WORTH_OF_SHARE: f64 = 0.1;

/// Fills the `weak` pixels that have no plane of validated origin, and pixels beside them that look alike; gives those it
/// filled.
pub fn fill(problem: &Problem, planes: &mut [FoodSource], weak: &[bool]) -> Vec<usize> {
    let width = problem.image.width;
    let mut marks = Marks::new(planes.len());
    let mut is_traced = vec![false; planes.len()];
    let ends_within = region::end_within(width, weak);
    let mut filled = Vec::new();
    let mut parts = 0;
    for pixel in 0..planes.len() {
        if is_traced[pixel] || !region::is_open(planes, weak, pixel) {
            continue;
        }
        parts += 1;
        let mut part = Part::trace(width, planes, weak, pixel, &mut marks);
        part.core.iter().for_each(|&pixel| is_traced[pixel] = true);
        if !part.is_framed() {
            continue;
        }
        if ends_within[pixel] {
            part.grow(problem, planes, &mut marks);
        }
        let witness = |pixel: usize| Witness {
            place: place(pixel, width),
            inverse_depth: 1.0 / f64::from(planes[pixel].depth),
        };
        let witnesses: Vec<Witness> =
            part.witnesses(planes, width, &mut marks).into_iter().map(witness).collect();
        let looks = ends_within[pixel]
            .then(|| Looks::new(problem, &part, part.band(width, planes.len() / width, &mut marks)));
        let found = common_planes(&witnesses, parts);
        let look = |plane| looks.as_ref()?.share(problem, plane);
        let Some(plane) = choose(&found, part.framed(), look) else {
            continue;
        };
        for &pixel in part.core.iter().chain(&part.grown) {
            if let Some(found) = on_plane(problem, plane, place(pixel, width)) {
                planes[pixel] = FoodSource { cost: planes[pixel].cost, ..found };
                filled.push(pixel);
            }
        }
    }
    filled
}

fn place(pixel: usize, width: usize) -> DVec3 {
    DVec3::new((pixel % width) as f64, (pixel / width) as f64, 1.0)
}

/// The plane by which the part looks best; `framed` is the share of its outline that is not the border of the image.
fn choose(planes: &[RimPlane], framed: f64, looks: impl Fn(DVec3) -> Option<f64>) -> Option<DVec3> {
    let worth = |&RimPlane { plane, share }: &RimPlane| {
        let (looks, min_share) = match looks(plane) {
            Some(looks) => (looks, MIN_SHARE_SEEN),
            None => (MIN_LOOKS, MIN_SHARE_UNSEEN),
        };
        let is_likely = share * framed >= min_share && looks >= MIN_LOOKS;
        is_likely.then_some((looks + WORTH_OF_SHARE * share, plane))
    };
    let best = planes.iter().filter_map(worth).max_by(|one, other| one.0.total_cmp(&other.0));
    best.map(|(_, plane)| plane)
}

/// The plane, as inverse depth over column, row and 1, at a pixel, unless it leaves the depth range or turns away there.
fn on_plane(problem: &Problem, plane: DVec3, place: DVec3) -> Option<FoodSource> {
    let about = SlantedPlane {
        inverse_depth: plane.dot(place) as f32,
        slope_x: plane.x as f32,
        slope_y: plane.y as f32,
    };
    let found = FoodSource::of_plane(problem, problem.ray(place.x as f32, place.y as f32), &about)?;
    Some(FoodSource { validated: true, ..found })
}
