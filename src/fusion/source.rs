//! What another view says about a point of the reference view.

use super::average::Member;
use super::{FusionView, estimate, weight};
use crate::geometry::Camera;
use crate::options::FusionOptions;
use glam::{DMat3, DVec2, DVec3};

/// What a view's maps say about a point.
pub(super) enum Opinion {
    /// Its pixel there carries the same surface.
    Agrees(Member),
    /// Its pixel there carries a surface clearly behind: the point would hide it.
    SeesThrough,
    /// Outside, no estimate, or hidden by something nearer.
    None,
}

/// A view's surface lies clearly behind a point beyond this many depth tolerances.
const CONFLICT_TOLERANCES: f64 = 2.0;

/// A view that overlaps the reference, with the maps from one to the other.
pub(super) struct Source<'a> {
    index: u32,
    view: &'a FusionView<'a>,
    /// Homogeneous pixel here of the point at depth 1 behind a homogeneous reference pixel, but for `shift`.
    transfer: DMat3,
    shift: DVec3,
    /// Camera directions to the world.
    to_world: DMat3,
    /// The camera's center from the reference's.
    center: DVec3,
    depth_tolerance: f64,
    min_cosine: f64,
}

impl<'a> Source<'a> {
    pub(super) fn new(
        reference: &Camera,
        index: u32,
        view: &'a FusionView<'a>,
        options: &FusionOptions,
    ) -> Source<'a> {
        let camera = view.camera;
        let center = camera.center() - reference.center();
        let rotation = camera.rotation * reference.rotation.transpose();
        Source {
            index,
            view,
            transfer: camera.calibration() * rotation * reference.calibration().inverse(),
            shift: camera.calibration() * (camera.rotation * -center),
            to_world: camera.rotation.transpose(),
            center,
            depth_tolerance: options.depth_tolerance,
            min_cosine: options.normal_tolerance.to_radians().cos(),
        }
    }

    /// What this view says about the reference's `start`, the point at `depth` behind `pixel`.
    pub(super) fn opinion(&self, pixel: DVec2, depth: f64, start: &Member) -> Opinion {
        let point = self.transfer * pixel.extend(1.0) * depth + self.shift;
        if point.z <= 0.0 {
            return Opinion::None;
        }
        let camera = self.view.camera;
        let Some((column, row)) = camera.nearest_pixel(point.truncate() / point.z) else {
            return Opinion::None;
        };
        let pixel = row as usize * camera.width as usize + column as usize;
        let Some((depth, normal)) = estimate(self.view, pixel) else { return Opinion::None };
        let difference = depth - point.z;
        if difference > CONFLICT_TOLERANCES * self.depth_tolerance * point.z {
            return Opinion::SeesThrough;
        }
        let normal = self.to_world * normal;
        if difference.abs() > self.depth_tolerance * point.z || normal.dot(start.normal) < self.min_cosine {
            return Opinion::None;
        }
        let ray = camera.ray(DVec2::new(f64::from(column), f64::from(row)));
        let position = self.center + self.to_world * (ray * depth);
        Opinion::Agrees(Member { view: self.index, pixel, position, normal, weight: weight(camera, depth) })
    }
}
