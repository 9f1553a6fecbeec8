//! Propagation between views (section 5.6.1 of the paper): consistent solutions are offered to views that have no
//! validated one there.

use crate::ambc::{MIN_FACING, Offer};
use crate::camera::Camera;
use crate::scene::DepthRange;
use crate::state::{Solution, ViewState};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// A view that offers its solutions.
#[derive(Clone, Copy)]
pub struct Giver<'a> {
    /// Its index in the scene: of equal offers the one of the lowest view is taken.
    pub view: usize,
    /// Its camera on this scale.
    pub camera: &'a Camera,
    /// Its solutions.
    pub state: &'a ViewState,
}

/// The offers to the pixels of a target view that are not validated: for each the one of lowest cost among all
/// solutions that project there and agree with at least one source view. The order of `givers` does not matter.
pub fn offers(camera: &Camera, state: &ViewState, range: DepthRange, givers: &[Giver]) -> Vec<Offer> {
    let from_one = |giver: &Giver| {
        let mut offers = vec![Ranked::default(); camera.pixels()];
        give(camera, state, range, giver, &mut offers);
        offers
    };
    let merge = |mut ours: Vec<Ranked>, theirs: Vec<Ranked>| {
        if ours.is_empty() {
            return theirs;
        }
        for (ours, theirs) in ours.iter_mut().zip(&theirs) {
            ours.keep_better(theirs);
        }
        ours
    };
    let ranked = givers.par_iter().map(from_one).reduce(Vec::new, merge);
    ranked.into_iter().map(|ranked| ranked.offer).collect()
}

/// An offer and who makes it.
#[derive(Debug, Clone, Copy, Default)]
struct Ranked {
    offer: Offer,
    view: usize,
}

impl Ranked {
    fn keep_better(&mut self, other: &Ranked) {
        let is_better = match (self.offer.depth > 0.0, other.offer.depth > 0.0) {
            (_, false) => false,
            (false, true) => true,
            (true, true) => (other.offer.cost, other.view) < (self.offer.cost, self.view),
        };
        if is_better {
            *self = *other;
        }
    }
}

fn give(camera: &Camera, state: &ViewState, range: DepthRange, giver: &Giver, offers: &mut [Ranked]) {
    let rotation = camera.rotation * giver.camera.rotation.transpose();
    let translation = camera.translation - rotation * giver.camera.translation;
    let width = giver.camera.width as usize;
    for (pixel, solution) in giver.state.solutions.iter().enumerate() {
        if solution.depth <= 0.0 || solution.consistent == 0 {
            continue;
        }
        let at = DVec2::new((pixel % width) as f64, (pixel / width) as f64);
        let point = rotation * (giver.camera.ray(at) * f64::from(solution.depth)) + translation;
        let normal = rotation * solution.normal.as_dvec3();
        if let Some((target, depth)) = land(camera, point, normal, range)
            && !is_settled(&state.solutions[target])
        {
            let offer = Offer { depth, normal: normal.as_vec3(), cost: giver.state.cost[pixel] };
            offers[target].keep_better(&Ranked { offer, view: giver.view });
        }
    }
}

fn is_settled(solution: &Solution) -> bool {
    solution.validated
}

/// The pixel a point of the target's frame falls on and the depth of its plane exactly there.
fn land(camera: &Camera, point: DVec3, normal: DVec3, range: DepthRange) -> Option<(usize, f32)> {
    let (x, y) = camera.nearest_pixel(camera.project_camera(point)?)?;
    let ray = camera.ray(DVec2::new(f64::from(x), f64::from(y)));
    let facing = normal.dot(ray);
    let depth = normal.dot(point) / facing;
    let is_usable = facing < -f64::from(MIN_FACING) && depth >= range.near && depth <= range.far;
    is_usable.then_some((y as usize * camera.width as usize + x as usize, depth as f32))
}
