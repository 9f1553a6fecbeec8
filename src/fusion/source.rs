//! The comparison of a point of the reference view with the maps of another view.

use super::average::Member;
use super::{FusionView, estimate, weight};
use crate::geometry::Camera;
use crate::options::FusionOptions;
use glam::{DMat3, DVec2, DVec3};

/// How a view's maps compare with a point.
pub(super) enum Comparison {
    /// The view's pixel has the same depth and normal.
    Consistent(Member),
    /// The view's pixel has a surface clearly behind the point: the point would occlude it.
    SeesThrough,
    /// The point is in the image and not occluded, but the pixel has no or another estimate.
    Sees,
    /// The point is outside the image or occluded, or its pixel has no estimate or another normal.
    Unknown,
}

/// How far behind a point a view's surface must be to conflict with it, in depth tolerances: at one, noise
/// would suffice.
const CONFLICT_TOLERANCES: f64 = 2.0;

/// Most that the tolerance in pixels allows, as a fraction of the depth.
const MAX_TOLERANCE: f64 = 0.05;

/// A view that overlaps the reference, with the transforms from one to the other.
pub(super) struct Source<'a> {
    pub(super) index: u32,
    /// Place of the view in the group of the reference.
    slot: usize,
    view: &'a FusionView<'a>,
    /// `K' R K^-1`: a reference pixel (x, y, 1) at depth d falls on `transfer (x, y, 1) d + shift`.
    transfer: DMat3,
    /// `K' t`.
    shift: DVec3,
    /// Rotation from the camera to the world.
    to_world: DMat3,
    /// The camera's center relative to the reference's, in world axes.
    center: DVec3,
    options: &'a FusionOptions,
    min_cosine: f64,
}

impl<'a> Source<'a> {
    pub(super) fn new(
        reference: &Camera,
        (index, slot): (u32, usize),
        view: &'a FusionView<'a>,
        options: &'a FusionOptions,
    ) -> Source<'a> {
        let camera = view.camera;
        let center = camera.center() - reference.center();
        let rotation = camera.rotation * reference.rotation.transpose();
        Source {
            index,
            slot,
            view,
            transfer: camera.calibration() * rotation * reference.calibration().inverse(),
            shift: camera.calibration() * (camera.rotation * -center),
            to_world: camera.rotation.transpose(),
            center,
            options,
            min_cosine: options.normal_tolerance.to_radians().cos(),
        }
    }

    /// Compares the reference's `start`, the point at `depth` on the ray of `pixel`, with this view's maps.
    pub(super) fn compare(&self, pixel: DVec2, depth: f64, start: &Member) -> Comparison {
        let point = self.transfer * pixel.extend(1.0) * depth + self.shift;
        if point.z <= 0.0 {
            return Comparison::Unknown;
        }
        let camera = self.view.camera;
        let place = point.truncate() / point.z;
        let parallax = (self.shift.truncate() - place * self.shift.z).length() / point.z;
        let of_pixels = (self.options.reprojection_tolerance / parallax).min(MAX_TOLERANCE);
        let tolerance = of_pixels.max(self.options.depth_tolerance);
        let Some((column, row)) = camera.nearest_pixel(place) else {
            return Comparison::Unknown;
        };
        let pixel = row as usize * camera.width as usize + column as usize;
        let Some((depth, normal)) = estimate(self.view, self.options, pixel) else { return Comparison::Sees };
        let difference = depth - point.z;
        if difference > CONFLICT_TOLERANCES * tolerance * point.z {
            return Comparison::SeesThrough;
        }
        let normal = self.to_world * normal;
        if difference.abs() > tolerance * point.z {
            return Comparison::Unknown;
        }
        if normal.dot(start.normal) < self.min_cosine {
            return Comparison::Sees;
        }
        let ray = camera.ray(DVec2::new(f64::from(column), f64::from(row)));
        let position = self.center + self.to_world * (ray * depth);
        Comparison::Consistent(Member {
            view: self.index,
            slot: self.slot,
            pixel,
            position,
            normal,
            weight: weight(self.view, pixel, depth),
        })
    }
}
