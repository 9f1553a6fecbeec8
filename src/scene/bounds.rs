//! The box of the world that a run is limited to.

use super::{Scene, View};
use crate::geometry::{Camera, DepthRange};
use crate::image::Mask;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// The corners of a box along the axes of the world, the smaller coordinates first.
pub(crate) type Bounds = [DVec3; 2];

impl Scene {
    /// The scene limited to a box: pixels whose rays miss it are masked, and depth ranges end where it does.
    pub(crate) fn bounded(&self, bounds: Bounds) -> Scene {
        let mut scene = self.clone();
        for (index, view) in scene.views.iter_mut().enumerate() {
            let Some(extent) = extent(&view.camera, bounds) else {
                view.mask = Some(vec![false; view.camera.pixels()].into());
                continue;
            };
            for range in [&mut scene.depth_ranges[index], &mut scene.outer_ranges[index]] {
                *range = common(*range, extent);
            }
            let wanted = view.mask.as_ref().map(Mask::to_vec);
            view.mask = Some(visible(view, wanted.as_deref(), scene.outer_ranges[index], bounds).into());
        }
        scene
    }
}

/// Whether a point lies in the box.
pub(crate) fn is_inside([least, most]: Bounds, point: DVec3) -> bool {
    point.cmpge(least).all() && point.cmple(most).all()
}

/// The depths of a box in front of a camera; `None` where it is behind.
fn extent(camera: &Camera, [least, most]: Bounds) -> Option<DepthRange> {
    let corner = |index: u32| {
        let pick = |bit: u32, a: f64, b: f64| if index >> bit & 1 == 0 { a } else { b };
        let corner = DVec3::new(pick(0, least.x, most.x), pick(1, least.y, most.y), pick(2, least.z, most.z));
        camera.to_camera(corner).z
    };
    let depths = (0..8).map(corner);
    let (near, far) =
        depths.fold((f64::INFINITY, 0.0), |(near, far): (f64, f64), z| (near.min(z), far.max(z)));
    // A box around the camera begins at no distance: the other bound is as small as any range may be.
    let range = DepthRange { near: near.max(far * 1e-4), far };
    range.check("bounds").is_ok().then_some(range)
}

/// What two ranges have in common; the second where that is nothing.
fn common(range: DepthRange, extent: DepthRange) -> DepthRange {
    let both = DepthRange { near: range.near.max(extent.near), far: range.far.min(extent.far) };
    if both.check("bounds").is_ok() { both } else { extent }
}

/// The wanted pixels whose rays meet the box within the depth range.
fn visible(view: &View, wanted: Option<&[bool]>, range: DepthRange, [least, most]: Bounds) -> Vec<bool> {
    let camera = &view.camera;
    let (center, to_world) = (camera.center(), camera.rotation.transpose());
    let meets = |index: usize| {
        let (x, y) = (index as u32 % camera.width, index as u32 / camera.width);
        // At unit depth: distances along it are depths.
        let ray = to_world * camera.ray(DVec2::new(x.into(), y.into()));
        let (a, b) = ((least - center) / ray, (most - center) / ray);
        // A ray along a face gives NaN there, which neither limits it.
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        wanted.is_none_or(|wanted| wanted[index]) && enter.max(range.near) <= leave.min(range.far)
    };
    (0..camera.pixels()).into_par_iter().with_min_len(1 << 12).map(meets).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;
    use crate::scene::SparsePoint;
    use glam::DMat3;

    fn scene() -> Scene {
        let view = |name: &str, x: f64| View {
            name: name.to_owned(),
            picture: Picture::from_gray(41, 31, vec![0; 41 * 31]).unwrap().into(),
            camera: Camera {
                width: 41,
                height: 31,
                fx: 40.0,
                fy: 40.0,
                cx: 20.0,
                cy: 15.0,
                rotation: DMat3::IDENTITY,
                translation: DVec3::new(-x, 0.0, 0.0),
            },
            mask: None,
            depth_range: None,
            sources: None,
        };
        let point = |z| SparsePoint { position: DVec3::new(0.0, 0.0, z), views: vec![0, 1] };
        Scene::new(vec![view("a", 0.0), view("b", 1.0)], vec![point(2.0), point(8.0)]).unwrap()
    }

    #[test]
    fn pixels_whose_rays_miss_the_box_are_masked_and_ranges_end_with_it() {
        let bounds = [DVec3::new(-1.0, -10.0, 4.0), DVec3::new(1.0, 10.0, 6.0)];
        let bounded = scene().bounded(bounds);
        assert_eq!(bounded.depth_range(0), DepthRange { near: 4.0, far: 6.0 });
        let mask = bounded.views()[0].mask.as_ref().unwrap().to_vec();
        for (pixel, &is_set) in mask.iter().enumerate() {
            // The nearer face is 20 pixels wide.
            assert_eq!(is_set, (10..=30).contains(&(pixel % 41)), "{pixel}");
        }
    }

    #[test]
    fn a_box_behind_the_cameras_leaves_nothing_and_one_beyond_the_points_is_searched() {
        let behind = scene().bounded([DVec3::splat(-5.0), DVec3::splat(-4.0)]);
        assert!(!behind.views()[1].mask.as_ref().unwrap().to_vec().contains(&true));
        let beyond = scene().bounded([DVec3::new(-9.0, -9.0, 100.0), DVec3::new(9.0, 9.0, 120.0)]);
        assert_eq!(beyond.depth_range(1), DepthRange { near: 100.0, far: 120.0 });
        assert!(beyond.views()[0].mask.as_ref().unwrap().to_vec().contains(&true));
    }

    #[test]
    fn a_point_is_inside_up_to_the_faces() {
        let bounds = [DVec3::ZERO, DVec3::ONE];
        assert!(is_inside(bounds, DVec3::ONE) && !is_inside(bounds, DVec3::new(0.5, 0.5, 1.01)));
    }
}
