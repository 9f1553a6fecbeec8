//! Depth ranges that views take from the sparse points.

use glam::{DMat3, DVec3};
use skep::geometry::Camera;
use skep::image::Picture;
use skep::{DepthRange, Scene, SparsePoint, View};

/// A view of 5 x 5 pixels at `center`, along z or, turned, against it. Its image is as wide as 5/8 of the
/// depth.
fn view(name: &str, center: DVec3, is_turned: bool) -> View {
    let rotation = DMat3::from_rotation_y(if is_turned { std::f64::consts::PI } else { 0.0 });
    let translation = -(rotation * center);
    let camera = Camera { width: 5, height: 5, fx: 8.0, fy: 8.0, cx: 2.0, cy: 2.0, rotation, translation };
    let picture = Picture::from_gray(5, 5, vec![100; 25]).unwrap().into();
    View { name: name.to_owned(), picture, camera, mask: None, depth_range: None, sources: None }
}

/// Two views beside each other, and a third that looks away from what lies before these.
fn views() -> Vec<View> {
    vec![
        view("left", DVec3::ZERO, false),
        view("right", DVec3::X, false),
        view("turned", DVec3::new(0.0, 0.0, -1.0), true),
    ]
}

fn point(x: f64, z: f64, views: &[u32]) -> SparsePoint {
    SparsePoint { position: DVec3::new(x, 0.0, z), views: views.to_vec() }
}

/// Three quarters of the smallest to twice the largest depth.
fn around(smallest: f64, largest: f64) -> DepthRange {
    DepthRange { near: smallest * 0.75, far: largest * 2.0 }
}

fn ranges(scene: &Scene) -> Vec<DepthRange> {
    (0..scene.views().len()).map(|view| scene.depth_range(view)).collect()
}

#[test]
fn a_range_is_that_of_the_points_the_view_saw_and_of_no_other() {
    // The point of depth 40 is in both images, but was seen in neither.
    let points = vec![point(0.5, 4.0, &[0, 1]), point(0.5, 8.0, &[1]), point(0.5, 40.0, &[])];
    let scene = Scene::new(views()[..2].to_vec(), points).unwrap();
    assert_eq!(ranges(&scene), [around(4.0, 4.0), around(4.0, 8.0)]);
    assert!(scene.warnings().is_empty(), "{:?}", scene.warnings());
}

#[test]
fn outliers_do_not_widen_a_range() {
    let usual = (0..198).map(|index| point(0.0, 4.0 + f64::from(index) / 100.0, &[0, 1]));
    let outliers = [point(0.0, 0.01, &[0, 1]), point(0.0, 4000.0, &[0, 1])];
    let scene = Scene::new(views()[..2].to_vec(), usual.chain(outliers).collect()).unwrap();
    assert_eq!(scene.depth_range(0), around(4.01, 5.96));
}

#[test]
fn a_view_that_saw_no_point_takes_those_that_project_into_its_image() {
    // The last two lie beside the image of `right`, and behind it.
    let points = [(0.5, 4.0), (1.0, 6.0), (-8.0, 9.0), (1.0, -2.0)].map(|(x, z)| point(x, z, &[0]));
    let scene = Scene::new(views()[..2].to_vec(), points.to_vec()).unwrap();
    assert_eq!(ranges(&scene), [around(4.0, 9.0), around(4.0, 6.0)]);
    let warning = "right saw no sparse point; its depth range, 3 to 12, is that of the 2 points that project \
                   into its image";
    assert_eq!(scene.warnings(), [warning]);
}

#[test]
fn a_view_is_helped_as_well_when_all_points_it_saw_lie_behind_it() {
    let points = vec![point(0.5, 4.0, &[0]), point(1.0, -6.0, &[1])];
    let scene = Scene::new(views()[..2].to_vec(), points).unwrap();
    assert_eq!(scene.depth_range(1), around(4.0, 4.0));
    assert_eq!(scene.warnings().len(), 1);
}

#[test]
fn a_view_without_any_point_in_its_image_takes_the_ranges_of_the_others() {
    let mut views = views();
    views[1].depth_range = Some(DepthRange { near: 2.0, far: 2.5 });
    let scene = Scene::new(views, vec![point(0.5, 4.0, &[0, 1])]).unwrap();
    let own = DepthRange { near: 2.0, far: 2.5 };
    assert_eq!(ranges(&scene), [around(4.0, 4.0), own, DepthRange { near: 2.0, far: 8.0 }]);
    let warning = "turned saw no sparse point, and none projects into its image; its depth range, 2 to 8, is \
                   that of the other views together";
    assert_eq!(scene.warnings(), [warning]);
}

#[test]
fn points_without_tracks_give_ranges_with_one_warning() {
    let points = vec![point(0.5, 4.0, &[]), point(1.0, 6.0, &[]), point(0.0, 12_345.678, &[])];
    let scene = Scene::new(views()[..2].to_vec(), points.clone()).unwrap();
    assert_eq!(ranges(&scene), [around(4.0, 12_345.678); 2]);
    let warning = "none of the 3 sparse points names a view that saw it: the depth range of 2 view(s) is \
                   that of the points that project into the image";
    assert_eq!(scene.warnings(), [warning]);

    let scene = Scene::new(views(), points).unwrap();
    assert_eq!(scene.depth_range(2), around(4.0, 12_345.678));
    assert_eq!(scene.warnings().len(), 2);
    assert_eq!(scene.warnings()[0], warning);
    assert!(scene.warnings()[1].contains("its depth range, 3 to 24690, is"), "{}", scene.warnings()[1]);
}

#[test]
fn points_that_no_view_can_use_are_counted_in_the_error() {
    let behind = vec![point(0.0, -4.0, &[0]), point(0.0, -5.0, &[])];
    let error = Scene::new(views()[..2].to_vec(), behind).unwrap_err().to_string();
    let expected = "depth range of left is unknown (of 2 sparse points, none in front of this view names it \
                    or projects into its image); expected ";
    assert!(error.starts_with(expected), "{error}");
    assert!(error.contains("a depth range (--depth-range MIN MAX)"), "{error}");
}

#[test]
fn without_points_each_view_needs_a_range_of_its_own() {
    let mut views = views();
    views[0].depth_range = Some(around(4.0, 4.0));
    let error = Scene::new(views.clone(), Vec::new()).unwrap_err().to_string();
    assert!(error.starts_with("depth range of right is unknown (there are no sparse points)"), "{error}");
    views[1].depth_range = Some(around(4.0, 5.0));
    let error = Scene::new(views.clone(), Vec::new()).unwrap_err().to_string();
    assert!(error.starts_with("depth range of turned is unknown"), "{error}");
    views[2].depth_range = Some(around(1.0, 5.0));
    assert!(Scene::new(views, Vec::new()).unwrap().warnings().is_empty());
}
