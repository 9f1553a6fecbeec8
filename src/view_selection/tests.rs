//! View sets by incidence and visibility, source lists by triangulation angle.

use super::rules::{are_occluded, faces_sources};
use super::{SourceLists, ViewRules, ViewSelector, source_lists};
use crate::geometry::{Camera, DepthRange, SlantedPlane, ViewSets};
use crate::image::{PackedImage, Picture};
use crate::matching::{Problem, Source};
use crate::options::Options;
use crate::scene::{CompactPlane, Scene, SparsePoint, View};
use crate::simd::{Scalar, Simd};
use crate::testing::{changed, looking_at};
use glam::{DVec3, Vec3};

const WIDTH: usize = 41;
const HEIGHT: usize = 31;
const CENTER: (f32, f32) = (20.0, 15.0);
const RANGE: DepthRange = DepthRange { near: 1.8, far: 5.0 };
/// Depth, at the middle pixel of the reference view, of the point that all cameras look at.
const DEPTH: f32 = 4.0;

/// A camera that looks at the origin from `distance`, turned around it by `angle` degrees.
fn turned(angle: f64, distance: f64) -> Camera {
    let angle = angle.to_radians();
    let direction = DVec3::new(angle.sin(), 0.0, -angle.cos());
    looking_at(direction * distance, DVec3::ZERO, (WIDTH as u32, HEIGHT as u32), 40.0)
}

fn blank() -> Picture {
    Picture::from_gray(WIDTH as u32, HEIGHT as u32, vec![0; WIDTH * HEIGHT]).unwrap()
}

/// A reference camera in front of the point, and source cameras around it.
struct Views {
    image: PackedImage,
    reference: Camera,
    sources: Vec<Camera>,
    /// Validated planes of each source view.
    surfaces: Vec<Vec<CompactPlane>>,
}

impl Views {
    fn new(sources: Vec<Camera>) -> Views {
        let surfaces = vec![Vec::new(); sources.len()];
        let reference = turned(0.0, f64::from(DEPTH));
        Views { image: PackedImage::new(&blank()), reference, sources, surfaces }
    }

    fn at_angles(angles: &[f64]) -> Views {
        Views::new(angles.iter().map(|&angle| turned(angle, f64::from(DEPTH))).collect())
    }

    /// The view set of the middle pixel for a plane with this normal.
    fn set(&self, options: &Options, min_views: usize, normal: Vec3) -> Vec<usize> {
        let mut problem = Problem::new(&self.reference, &self.image, RANGE);
        let sources = self.sources.iter().zip(&self.surfaces);
        problem.sources = sources
            .map(|(camera, surface)| Source::new(&self.reference, camera, &self.image, surface))
            .collect();
        let mut words = vec![0u32; self.sources.len().div_ceil(32)];
        let rules = ViewRules::new(options, min_views);
        ViewSelector::new(Scalar, &problem, rules).select(&mut words, CENTER, DEPTH, normal);
        ViewSets::iter_words(&words).collect()
    }
}

/// Normal of a plane that faces the reference camera.
const FACING: Vec3 = Vec3::NEG_Z;

#[test]
fn sources_at_grazing_incidence_are_not_selected() {
    let views = Views::at_angles(&[79.0, 81.0, -79.0, -81.0, 0.5]);
    assert_eq!(views.set(&Options::default(), 0, FACING), [0, 2, 4]);
    let strict = changed(Options::default(), |o| {
        o.view_selection.max_incident_angle = 60.0;
    });
    assert_eq!(views.set(&strict, 0, FACING), [4]);
    // The incident angle is measured from the normal, not from the ray of the reference view.
    let tilted = Vec3::new(40f32.to_radians().sin(), 0.0, -40f32.to_radians().cos());
    assert_eq!(views.set(&Options::default(), 0, tilted), [0, 1, 4]);
}

#[test]
fn a_surface_faces_no_source_behind_it() {
    let normal = Vec3::new(0.0, 0.6, -0.8);
    let point = Vec3::new(1.0, 2.0, 5.0);
    let faces = |center: Vec3, min_cosine: f32| {
        let centers = center.to_array().map(|coordinate| Scalar.splat(coordinate));
        faces_sources(Scalar, point, normal, &centers, min_cosine)
    };
    assert_eq!(faces(point + normal * 3.0, 0.99), 0xff);
    assert_eq!(faces(point - normal * 3.0, 0.0), 0);
    assert_eq!(faces(point - normal * 3.0, 0.17), 0);
}

#[test]
fn sources_with_a_validated_surface_in_front_are_not_selected() {
    let mut views = Views::at_angles(&[10.0; 5]);
    let nearest = CENTER.1 as usize * WIDTH + CENTER.0 as usize;
    for (surface, factor) in views.surfaces.iter_mut().zip([0.5, 0.985, 0.995, 1.0, 1.5]) {
        *surface = vec![CompactPlane::default(); WIDTH * HEIGHT];
        let inverse_depth = 1.0 / (DEPTH * factor);
        surface[nearest] = SlantedPlane { inverse_depth, slope_x: 0.0, slope_y: 0.0 }.into();
    }
    let options = changed(Options::default(), |o| {
        o.view_selection.occlusion_tolerance = 0.01;
    });
    assert_eq!(views.set(&options, 0, FACING), [2, 3, 4]);
    let wide = changed(options.clone(), |o| {
        o.view_selection.occlusion_tolerance = 0.02;
    });
    assert_eq!(views.set(&wide, 0, FACING), [1, 2, 3, 4]);
    // Without a validated surface there is no occlusion.
    for surface in &mut views.surfaces {
        surface[nearest] = CompactPlane::default();
    }
    assert_eq!(views.set(&options, 0, FACING), [0, 1, 2, 3, 4]);
}

#[test]
fn the_occlusion_tolerance_is_relative() {
    for scale in [1.0, 1000.0] {
        let factors = [0.5, 0.98, 0.995, 1.0, 1.1, 2.0, 1e6, f32::INFINITY];
        let validated = factors.map(|factor| 1.0 / (factor * scale));
        assert_eq!(are_occluded(Scalar, Scalar.splat(scale), validated, 0.01), 0b11);
    }
}

#[test]
fn sources_whose_image_does_not_contain_the_point_are_not_selected() {
    let mut away = turned(10.0, 4.0);
    away.cx += 50.0;
    let mut behind = turned(10.0, 4.0);
    behind.translation.z -= 8.0;
    let mut at_the_last_pixel = turned(10.0, 4.0);
    at_the_last_pixel.cx = WIDTH as f64 - 1.01;
    let views = Views::new(vec![away, turned(10.0, 4.0), behind, at_the_last_pixel]);
    assert_eq!(views.set(&Options::default(), 0, FACING), [1, 3]);
    // This holds without pixelwise view selection too.
    let off = changed(Options::default(), |o| {
        o.view_selection.pixelwise_view_selection = false;
    });
    assert_eq!(views.set(&off, 0, FACING), [1, 3]);
}

#[test]
fn without_pixelwise_view_selection_incidence_is_ignored() {
    let off = changed(Options::default(), |o| {
        o.view_selection.pixelwise_view_selection = false;
    });
    assert_eq!(Views::at_angles(&[85.0, 20.0]).set(&off, 0, FACING), [0, 1]);
}

#[test]
fn a_set_that_is_too_small_is_replaced_by_all_sources() {
    let views = Views::at_angles(&[85.0, 20.0, -85.0]);
    let options = Options::default();
    assert_eq!(views.set(&options, 0, FACING), [1]);
    assert_eq!(views.set(&options, 1, FACING), [1]);
    assert_eq!(views.set(&options, 2, FACING), [0, 1, 2]);
}

#[test]
fn sets_of_more_than_64_sources_are_selected() {
    let angles: Vec<f64> = (0..70).map(|source| if source % 3 == 0 { 20.0 } else { 85.0 }).collect();
    let views = Views::at_angles(&angles);
    let facing: Vec<usize> = (0..70).step_by(3).collect();
    assert_eq!(views.set(&Options::default(), 2, FACING), facing);
    // Too few: replaced by exactly the 70 sources.
    assert!(views.set(&Options::default(), 30, FACING).into_iter().eq(0..70));
}

/// The source lists of cameras that see some sparse points.
fn lists(cameras: &[Camera], points: &[(DVec3, &[u32])], options: &Options) -> SourceLists {
    let views = cameras.iter().enumerate().map(|(index, camera)| View {
        name: format!("view{index}"),
        picture: blank().into(),
        camera: *camera,
        mask: None,
        depth_range: Some(RANGE),
        sources: None,
    });
    let points = points.iter().map(|&(position, views)| SparsePoint { position, views: views.to_vec() });
    source_lists(&Scene::new(views.collect(), points.collect()).unwrap(), options)
}

fn ten_to_thirty() -> Options {
    changed(Options::default(), |o| {
        o.view_selection.min_triangulation_angle = 10.0;
        o.view_selection.max_triangulation_angle = 30.0;
        o.view_selection.min_sources = 0;
        o.view_selection.max_sources = 0;
        o.check.min_consistent_views = 1;
    })
}

/// Cameras around the origin, at a distance of 3, the middle of their depth range.
fn around(angles: &[f64]) -> Vec<Camera> {
    angles.iter().map(|&angle| turned(angle, 3.0)).collect()
}

#[test]
fn views_with_angles_in_the_range_are_sources_smallest_angle_first() {
    let cameras = around(&[0.0, 29.0, 31.0, 9.0, -11.0, -20.0]);
    let all: &[u32] = &[0, 1, 2, 3, 4, 5];
    // Three points at the same position: the minimum number.
    let result = lists(&cameras, &[(DVec3::ZERO, all); 3], &ten_to_thirty());
    assert_eq!(result.lists[0], [4, 5, 1]);
    assert!(result.warnings.is_empty(), "{:?}", result.warnings);
    // Without points the angles are those at the middle depth, about the same here; 9 and 31 are too near the
    // limits.
    let cameras = around(&[0.0, 26.0, 60.0, 5.0, -13.0, -20.0]);
    let result = lists(&cameras, &[], &ten_to_thirty());
    assert_eq!(result.lists[0], [4, 5, 1]);
}

#[test]
fn source_lists_of_the_scene_are_used_unchanged() {
    let views = |sources: Option<Vec<u32>>| -> Vec<View> {
        let view = |(index, camera): (usize, &Camera)| View {
            name: format!("view{index}"),
            picture: blank().into(),
            camera: *camera,
            mask: None,
            depth_range: Some(RANGE),
            sources: sources.clone().filter(|_| index == 0),
        };
        around(&[0.0, 20.0, 60.0, 15.0]).iter().enumerate().map(view).collect()
    };
    let result = source_lists(&Scene::new(views(Some(vec![2, 1])), vec![]).unwrap(), &ten_to_thirty());
    // 60 degrees lie far outside the range; the lists of the other views are computed.
    assert_eq!((&result.lists[0][..], &result.lists[3][..]), (&[2, 1][..], &[0][..]));
    for wrong in [vec![4], vec![0], vec![1, 1]] {
        let error = Scene::new(views(Some(wrong)), vec![]).unwrap_err().to_string();
        assert!(error.contains("views[0] (view0).sources["), "{error}");
    }
}

#[test]
fn the_angle_of_two_views_is_the_75th_percentile_at_shared_points() {
    let camera = |x: f64| looking_at(DVec3::new(x, 0.0, 0.0), DVec3::new(x, 0.0, 1.0), (41, 31), 40.0);
    let cameras = [camera(-0.5), camera(0.5)];
    // Triangulation angles of 28 and 6 degrees.
    let (near, far) = (DVec3::new(0.0, 0.0, 2.0), DVec3::new(0.0, 0.0, 10.0));
    let both: &[u32] = &[0, 1];
    let lists = |near_points: usize| {
        let points: Vec<_> = (0..5).map(|p| (if p < near_points { near } else { far }, both)).collect();
        lists(&cameras, &points, &ten_to_thirty())
    };
    assert!(!lists(1).warnings.is_empty());
    assert!(lists(2).warnings.is_empty());
    assert_eq!(lists(2).lists, [vec![1], vec![0]]);
}

#[test]
fn parallel_cameras_have_sources() {
    let camera = |x: f64| looking_at(DVec3::new(x, 0.0, 0.0), DVec3::new(x, 0.0, 1.0), (41, 31), 40.0);
    let result = lists(&[0.0, 0.5, 1.0, 1.5].map(camera), &[], &ten_to_thirty());
    assert!(result.warnings.is_empty(), "{:?}", result.warnings);
    // At a depth of 3: 9, 18 and 27 degrees.
    assert_eq!(result.lists[0], [2, 3]);
    assert_eq!(result.lists[1], [3]);
}

#[test]
fn views_of_large_scenes_are_tried_with_the_nearest_and_with_those_that_share_points() {
    let row = |views: u32| -> Vec<Camera> {
        let camera = |x: f64| looking_at(DVec3::new(x, 0.0, 0.0), DVec3::new(x, 0.0, 1.0), (41, 31), 40.0);
        (0..views).map(|view| camera(0.0015 * f64::from(view))).collect()
    };
    // 10 degrees at the middle depth are 353 views away, a little more at the sides of the image.
    let ordinary = lists(&row(1000), &[], &ten_to_thirty());
    assert!((340..380).contains(&ordinary.lists[0][0]), "{}", ordinary.lists[0][0]);
    // The 256 nearest views have smaller angles, of which the two largest are taken, with a warning.
    let large = lists(&row(1001), &[], &ten_to_thirty());
    assert_eq!(large.lists[0], [256, 255]);
    assert_eq!(large.warnings.len(), 1001);
    // Views that share points are tried at any distance.
    let both: &[u32] = &[0, 1000];
    let shared = lists(&row(1001), &[(DVec3::new(0.8, 0.0, 4.0), both); 3], &ten_to_thirty());
    assert_eq!((&shared.lists[0][..], &shared.lists[1000][..]), (&[1000][..], &[0][..]));
    assert_eq!(shared.warnings.len(), 999);
}

#[test]
fn without_angles_in_the_range_the_nearest_are_used_with_a_warning() {
    let points: [(DVec3, &[u32]); 3] = [(DVec3::ZERO, &[0, 1, 2, 3]); 3];
    let result = lists(&around(&[0.0, 2.0, 5.0, 7.0]), &points, &ten_to_thirty());
    let mut list = result.lists[0].clone();
    list.sort_unstable();
    assert_eq!(list, [2, 3]);
    assert!(result.warnings[0].contains("view0"), "{}", result.warnings[0]);
    assert!(result.warnings[0].contains("10 to 30 degrees"), "{}", result.warnings[0]);
    assert!(
        result.warnings[0].contains("7.0") && result.warnings[0].contains("5.0"),
        "{}",
        result.warnings[0]
    );
}

#[test]
fn a_view_without_overlap_gives_a_warning() {
    let away = looking_at(DVec3::new(0.0, 0.0, -4.0), DVec3::new(0.0, 0.0, -8.0), (41, 31), 40.0);
    let result = lists(&[turned(0.0, 3.0), turned(15.0, 3.0), away], &[], &ten_to_thirty());
    assert_eq!(result.lists, [vec![1], vec![0], vec![]]);
    let [warning] = &result.warnings[..] else { panic!("{:?}", result.warnings) };
    assert!(warning.contains("view2") && warning.contains("overlaps with no other view"), "{warning}");
}

#[test]
fn a_view_with_fewer_sources_than_must_agree_gives_a_warning() {
    let options = changed(ten_to_thirty(), |o| {
        o.check.min_consistent_views = 2;
        o.check.few_views = 0;
    });
    let result = lists(&around(&[0.0, 15.0]), &[], &changed(options.clone(), |o| o.check.few_views = 1));
    assert!(result.warnings.is_empty(), "a single view suffices: {:?}", result.warnings);
    let result = lists(&around(&[0.0, 15.0]), &[], &options);
    assert_eq!(result.lists, [vec![1], vec![0]]);
    assert_eq!(result.warnings.len(), 2, "{:?}", result.warnings);
    assert!(
        result.warnings[0].contains("view0 has 1 source view(s), but 2 must agree"),
        "{:?}",
        result.warnings
    );
}

#[test]
fn source_lists_are_cut_off_at_max_sources() {
    let points: [(DVec3, &[u32]); 3] = [(DVec3::ZERO, &[0, 1, 2, 3]); 3];
    let list = |max_sources| {
        let options = changed(ten_to_thirty(), |o| {
            o.view_selection.max_sources = max_sources;
        });
        lists(&around(&[0.0, 12.0, 18.0, 24.0]), &points, &options).lists[0].clone()
    };
    assert_eq!(list(0).len(), 3);
    assert_eq!(list(3).len(), 3);
    assert_eq!(list(2).len(), 2);
    assert_eq!(list(1).len(), 1);
}
