//! Planes and the homographies they induce, against the projections of the plane's points.

use glam::{DMat3, DQuat, DVec2, DVec3, EulerRot, Vec3};
use proptest::prelude::*;
use skep::geometry::{Camera, Plane, RelativePose, SlantedPlane, plane_homography};
use skep::matching::PatchHomography;

const WIDTH: u32 = 640;
const HEIGHT: u32 = 480;

/// Tolerance of f32 projections, in px: homogeneous coordinates of some thousands, divided by a third
/// coordinate that [`Case::target`] keeps above 0.2, have errors of some thousandths.
const F32_PIXELS: f64 = 0.01;

prop_compose! {
    /// A camera near (0, 0, -4) that looks approximately along z.
    fn camera()(
        focal in prop::array::uniform2(300.0..900.0f64),
        principal in prop::array::uniform2(0.3..0.7f64),
        turn in prop::array::uniform3(-0.3..0.3f64),
        position in prop::array::uniform3(-1.0..1.0f64),
    ) -> Camera {
        let rotation = DMat3::from_quat(DQuat::from_euler(EulerRot::XYZ, turn[0], turn[1], turn[2]));
        let center = DVec3::from_array(position) - 4.0 * DVec3::Z;
        Camera {
            width: WIDTH,
            height: HEIGHT,
            fx: focal[0],
            fy: focal[1],
            cx: principal[0] * f64::from(WIDTH),
            cy: principal[1] * f64::from(HEIGHT),
            rotation,
            translation: -(rotation * center),
        }
    }
}

/// Two cameras, a plane through a pixel of the first, and another pixel near it.
#[derive(Debug, Clone)]
struct Case {
    reference: Camera,
    source: Camera,
    pixel: DVec2,
    offset: DVec2,
    depth: f64,
    normal: DVec3,
}

prop_compose! {
    fn case()(
        reference in camera(),
        source in camera(),
        // Integers, exact in f32.
        pixel in (0..WIDTH, 0..HEIGHT),
        offset in (-8..=8i32, -8..=8i32),
        depth in 2.0..8.0f64,
        tilt in prop::array::uniform2(-0.7..0.7f64),
    ) -> Case {
        let pixel = DVec2::new(f64::from(pixel.0), f64::from(pixel.1));
        let normal = -(reference.ray(pixel).normalize() + DVec3::new(tilt[0], tilt[1], 0.0)).normalize();
        let offset = DVec2::new(f64::from(offset.0), f64::from(offset.1));
        Case { reference, source, pixel, offset, depth, normal }
    }
}

impl Case {
    fn plane(&self) -> Plane {
        Plane::at(&self.reference, self.pixel, self.depth, self.normal)
    }

    fn slanted_plane(&self) -> SlantedPlane {
        let ray = self.reference.ray(self.pixel).as_vec3();
        let inverse_focal = ((1.0 / self.reference.fx) as f32, (1.0 / self.reference.fy) as f32);
        SlantedPlane::new(self.depth as f32, self.normal.as_vec3(), ray, inverse_focal)
    }

    /// The projection of the plane's point at `pixel` into the source; `None` far outside its image or behind
    /// its camera.
    fn target(&self, pixel: DVec2) -> Option<DVec2> {
        let depth = self.plane().depth(&self.reference, pixel);
        let (target, source_depth) = self.source.project(self.reference.unproject(pixel, depth))?;
        (depth > 0.0 && source_depth > 0.2 * depth && target.length() < 4000.0).then_some(target)
    }
}

fn dehomogenize(point: DVec3) -> DVec2 {
    point.truncate() / point.z
}

fn distance_of(point: Vec3, target: DVec2) -> f64 {
    dehomogenize(point.as_dvec3()).distance(target)
}

proptest! {
    #[test]
    fn planes_go_through_their_point_and_depths_lie_on_them(case in case()) {
        let (camera, plane) = (&case.reference, case.plane());
        prop_assert!(plane.distance > 0.0);
        prop_assert!((plane.depth(camera, case.pixel) - case.depth).abs() < 1e-9);
        let elsewhere = case.pixel + case.offset;
        let point = camera.ray(elsewhere) * plane.depth(camera, elsewhere);
        prop_assert!((plane.normal.dot(point) + plane.distance).abs() < 1e-9);
    }

    #[test]
    fn plane_homographies_map_pixels_to_projections_of_the_plane(case in case()) {
        let elsewhere = case.pixel + case.offset;
        let Some(target) = case.target(elsewhere) else { return Ok(()) };
        let homography = plane_homography(&case.reference, &case.source, &case.plane());
        let mapped = dehomogenize(homography * elsewhere.extend(1.0));
        prop_assert!(mapped.distance(target) < 1e-6, "{mapped} instead of {target}");
    }

    #[test]
    fn inverse_depth_is_linear_in_the_pixel(case in case()) {
        let depth = case.plane().depth(&case.reference, case.pixel + case.offset);
        prop_assume!(depth > 0.5 && depth < 50.0);
        let inverse = case.slanted_plane().inverse_depth_at(case.offset.x as f32, case.offset.y as f32);
        prop_assert!((f64::from(inverse) * depth - 1.0).abs() < 1e-5, "{inverse} instead of {}", 1.0 / depth);
    }

    #[test]
    fn relative_poses_project_points_like_cameras(case in case()) {
        let Some(target) = case.target(case.pixel) else { return Ok(()) };
        let pose = RelativePose::new(&case.reference, &case.source);
        let at_infinity = pose.at_infinity(case.pixel.x as f32, case.pixel.y as f32);
        let point = at_infinity + pose.epipole / case.depth as f32;
        prop_assert!(distance_of(point, target) < F32_PIXELS);
        let (_, depth) = case.source.project(case.reference.unproject(case.pixel, case.depth)).unwrap();
        prop_assert!((f64::from(point.z) * case.depth / depth - 1.0).abs() < 1e-5);
    }

    #[test]
    fn patch_homographies_map_offsets_to_projections_of_the_plane(case in case()) {
        let Some(target) = case.target(case.pixel + case.offset) else { return Ok(()) };
        let pose = RelativePose::new(&case.reference, &case.source);
        let at_infinity = pose.at_infinity(case.pixel.x as f32, case.pixel.y as f32);
        let homography = PatchHomography::of_plane(&pose, at_infinity, &case.slanted_plane());
        let (dx, dy) = (case.offset.x as f32, case.offset.y as f32);
        let mapped = homography.center + homography.along_x * dx + homography.along_y * dy;
        prop_assert!(distance_of(mapped, target) < F32_PIXELS);
    }

    #[test]
    fn large_world_coordinates_lose_no_digits(case in case()) {
        let moved = |camera: &Camera| {
            let shift = DVec3::new(1e6, -2e6, 1.5e6);
            Camera { translation: camera.translation - camera.rotation * shift, ..*camera }
        };
        let (reference, source) = (moved(&case.reference), moved(&case.source));
        let near = RelativePose::new(&case.reference, &case.source);
        let far = RelativePose::new(&reference, &source);
        prop_assert_eq!(near.infinite, far.infinite);
        prop_assert!((near.epipole - far.epipole).length() <= 1e-6 * near.epipole.length().max(1.0));
        let Some(target) = case.target(case.pixel) else { return Ok(()) };
        let homography = plane_homography(&reference, &source, &case.plane());
        prop_assert!(dehomogenize(homography * case.pixel.extend(1.0)).distance(target) < 1e-4);
    }

    #[test]
    fn centers_of_coarse_pixels_lie_between_four_fine_pixels(
        camera in camera(),
        pixel in prop::array::uniform2(0.0..400.0f64),
        depth in 1.0..9.0f64,
    ) {
        let (coarse, pixel) = (camera.halved(), DVec2::from_array(pixel));
        prop_assert!(coarse.ray(pixel).distance(camera.ray(2.0 * pixel + 0.5)) < 1e-12);
        let (projected, same_depth) = coarse.project(camera.unproject(2.0 * pixel + 0.5, depth)).unwrap();
        prop_assert!(projected.distance(pixel) < 1e-9 && (same_depth - depth).abs() < 1e-9);
    }
}

#[test]
fn halved_cameras_round_odd_sides_up() {
    let camera = Camera {
        width: 7,
        height: 1,
        fx: 8.0,
        fy: 6.0,
        cx: 3.0,
        cy: 0.0,
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    };
    let halved = camera.halved();
    assert_eq!((halved.width, halved.height, halved.fx, halved.fy), (4, 1, 4.0, 3.0));
    assert_eq!((halved.cx, halved.cy), (1.25, -0.25));
}

#[test]
fn points_behind_the_camera_and_outside_the_image_have_no_pixel() {
    let camera = Camera {
        width: 4,
        height: 3,
        fx: 2.0,
        fy: 2.0,
        cx: 1.5,
        cy: 1.0,
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    };
    assert_eq!(camera.project(DVec3::new(0.0, 0.0, -1.0)), None);
    assert_eq!(camera.project(DVec3::new(1.0, 0.0, 0.0)), None);
    assert_eq!(camera.project(DVec3::new(0.0, 0.0, 2.0)), Some((DVec2::new(1.5, 1.0), 2.0)));
    assert_eq!(camera.nearest_pixel(DVec2::new(-0.5, 2.49)), Some((0, 2)));
    assert_eq!(camera.nearest_pixel(DVec2::new(-0.51, 0.0)), None);
    assert_eq!(camera.nearest_pixel(DVec2::new(3.5, 0.0)), None);
    assert_eq!(camera.nearest_pixel(DVec2::splat(f64::NAN)), None);
}
