//! Fusion of exact maps and of maps with known errors.

mod common;

use common::procedural::{self, Procedural, Shape, Surface, Texture, pixel_center};
use glam::{DVec2, DVec3};
use skep::fusion::{FusionView, fuse};
use skep::geometry::Camera;
use skep::{Error, FusionOptions, Maps, Phase, PixelStatus, PointCloud, Progress, ignore_progress};
use std::ops::ControlFlow;
use std::sync::Mutex;

const OPTIONS: FusionOptions = FusionOptions {
    depth_tolerance: 0.01,
    normal_tolerance: 30.0,
    reprojection_tolerance: 0.0,
    min_agreeing_views: 3,
    min_agreeing_fraction: 0.0,
    min_confidence: 0.0,
    compensate_exposure: false,
    voxel_size: 0.0,
    max_points: 0,
};

/// For every view all the others.
fn all_others(views: usize) -> Vec<Vec<u32>> {
    (0..views as u32).map(|view| (0..views as u32).filter(|&other| other != view).collect()).collect()
}

fn fusion_views<'a>(made: &'a Procedural, maps: &'a [Maps], overlap: &'a [Vec<u32>]) -> Vec<FusionView<'a>> {
    let view = |index: usize| FusionView {
        camera: &made.views[index].camera,
        maps: &maps[index],
        status: None,
        confidence: None,
        picture: made.views[index].picture.decoded(),
        overlap: &overlap[index],
    };
    (0..maps.len()).map(view).collect()
}

fn fuse_maps(made: &Procedural, maps: &[Maps], options: FusionOptions) -> PointCloud {
    let overlap = all_others(maps.len());
    fuse(&fusion_views(made, maps, &overlap), &options, &ignore_progress).unwrap()
}

/// Distance to the nearest surface.
fn error(made: &Procedural, position: [f64; 3]) -> f64 {
    let point = DVec3::from_array(position);
    made.surfaces.iter().map(|surface| surface.shape.distance(point)).fold(f64::INFINITY, f64::min)
}

fn mean_error(made: &Procedural, cloud: &PointCloud) -> f64 {
    assert!(!cloud.positions.is_empty());
    cloud.positions.iter().map(|&point| error(made, point)).sum::<f64>() / cloud.positions.len() as f64
}

/// A pseudo-random number from -1 to 1.
fn noise(seed: usize) -> f64 {
    let hash = (seed as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((hash ^ hash >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// The truth with relative errors up to `amplitude` in every depth.
fn noisy(truth: &[Maps], amplitude: f64) -> Vec<Maps> {
    let mut maps = truth.to_vec();
    for (view, maps) in maps.iter_mut().enumerate() {
        for (pixel, depth) in maps.depth.iter_mut().enumerate() {
            *depth *= 1.0 + (amplitude * noise(view << 20 | pixel)) as f32;
        }
    }
    maps
}

#[test]
fn exact_maps_become_points_on_the_surface() {
    let made = procedural::plane_and_sphere();
    let cloud = fuse_maps(&made, &made.truth, OPTIONS);
    assert!(mean_error(&made, &cloud) < 1e-4, "{}", mean_error(&made, &cloud));
    // A pixel is 0.03 wide.
    let worst = cloud.positions.iter().map(|&point| error(&made, point)).fold(0.0, f64::max);
    assert!(worst < 5e-3, "{worst}");
    assert_eq!(cloud.positions.len(), cloud.normals.len());
    assert_eq!(cloud.positions.len(), cloud.colors.len());
    assert_eq!(cloud.positions.len(), cloud.views.len());
}

#[test]
fn the_cloud_keeps_about_one_point_for_each_surface_pixel() {
    let made = procedural::plane_and_sphere();
    let cloud = fuse_maps(&made, &made.truth, OPTIONS);
    let middle = &made.views[procedural::MIDDLE].camera;
    let mut points_at = vec![0; middle.pixels()];
    for &point in &cloud.positions {
        let point = DVec3::from_array(point);
        let Some((column, row)) = middle.project(point).and_then(|(pixel, _)| middle.nearest_pixel(pixel))
        else {
            continue;
        };
        if made.is_visible(point, procedural::MIDDLE) {
            points_at[(row * middle.width + column) as usize] += 1;
        }
    }
    let mean = points_at.iter().sum::<usize>() as f64 / points_at.len() as f64;
    assert!((0.9..1.4).contains(&mean), "{mean} points a pixel");
    let covered = points_at.iter().filter(|&&points| points > 0).count() as f64 / points_at.len() as f64;
    assert!(covered > 0.8, "{covered} of the pixels have a point");
}

#[test]
fn averaging_reduces_noise() {
    let made = procedural::plane_and_sphere();
    let maps = noisy(&made.truth, 0.004);
    let alone =
        fuse_maps(&made, &maps, FusionOptions { min_agreeing_views: 0, depth_tolerance: 0.0, ..OPTIONS });
    let together = fuse_maps(&made, &maps, OPTIONS);
    let (alone, together) = (mean_error(&made, &alone), mean_error(&made, &together));
    assert!(together < 0.6 * alone, "{together} against {alone}");
}

#[test]
fn one_view_with_an_error_within_the_tolerance_does_not_bias_the_points() {
    let made = procedural::plane_and_sphere();
    let mut maps = noisy(&made.truth, 0.0005);
    let without = mean_error(&made, &fuse_maps(&made, &maps, OPTIONS));
    maps[0].depth.iter_mut().for_each(|depth| *depth *= 1.007);
    let with = mean_error(&made, &fuse_maps(&made, &maps, OPTIONS));
    assert!(with < 2.0 * without, "{with} against {without}");
}

#[test]
fn a_wrong_region_in_one_view_is_dropped() {
    let made = procedural::plane_and_sphere();
    for factor in [0.9, 1.1] {
        let mut maps = made.truth.to_vec();
        maps[0].depth[2000..6000].iter_mut().for_each(|depth| *depth *= factor);
        let cloud = fuse_maps(&made, &maps, OPTIONS);
        let worst = cloud.positions.iter().map(|&point| error(&made, point)).fold(0.0, f64::max);
        // The sphere's rim lies on sight lines whose nearest pixel is half a pixel off.
        assert!(worst < 0.06, "{worst}");
        assert!(mean_error(&made, &cloud) < 2e-4);
    }
}

/// Maps of a wall in which the first `outliers` views have a false surface in front of it.
fn with_false_surface(outliers: usize) -> (Procedural, Vec<Maps>, f64) {
    let wall = procedural::wall(Texture::Noise);
    let depth = -0.6;
    let false_surface = Shape::upright(DVec3::Z * depth, 0.0, DVec2::splat(0.4));
    let cameras = &procedural::cameras()[..7];
    let with =
        Procedural::new(vec![Surface { shape: false_surface, texture: Texture::Noise }, wall], cameras);
    let without = Procedural::new(vec![wall], cameras);
    let maps =
        (0..7).map(|view| if view < outliers { &with } else { &without }.truth[view].clone()).collect();
    (without, maps, depth)
}

#[test]
fn a_surface_with_more_conflicting_than_consistent_views_is_dropped() {
    let false_points = |outliers: usize| {
        let (made, maps, depth) = with_false_surface(outliers);
        let cloud = fuse_maps(&made, &maps, FusionOptions { min_agreeing_views: 2, ..OPTIONS });
        cloud.positions.iter().filter(|point| (point[2] - depth).abs() < 0.1).count()
    };
    assert_eq!(false_points(3), 0, "three consistent views, four conflicting ones");
    assert!(false_points(4) > 300, "four consistent views, three conflicting ones");
}

#[test]
fn too_few_agreeing_views_make_no_points() {
    let made = procedural::plane_and_sphere();
    assert!(fuse_maps(&made, &made.truth[..3], OPTIONS).positions.is_empty());
    assert!(!fuse_maps(&made, &made.truth[..4], OPTIONS).positions.is_empty());
    assert!(
        !fuse_maps(&made, &made.truth[..3], FusionOptions { min_agreeing_views: 2, ..OPTIONS })
            .positions
            .is_empty()
    );
}

#[test]
fn only_overlapping_views_count() {
    let made = procedural::plane_and_sphere();
    let overlap: Vec<Vec<u32>> =
        all_others(made.views.len()).into_iter().map(|others| others[..2].to_vec()).collect();
    let cloud = fuse(&fusion_views(&made, &made.truth, &overlap), &OPTIONS, &ignore_progress).unwrap();
    assert!(cloud.positions.is_empty());
    let options = FusionOptions { min_agreeing_views: 2, ..OPTIONS };
    let cloud = fuse(&fusion_views(&made, &made.truth, &overlap), &options, &ignore_progress).unwrap();
    assert!(!cloud.positions.is_empty());
    for point in 0..cloud.views.len() {
        let views = cloud.views.get(point);
        assert!(views[1..].iter().all(|view| overlap[views[0] as usize].contains(view)));
    }
}

#[test]
fn normals_are_unit_and_in_the_world_frame() {
    let made = procedural::plane_and_sphere();
    let mut maps = made.truth.to_vec();
    for (view, maps) in maps.iter_mut().enumerate() {
        for (pixel, normal) in maps.normal.iter_mut().enumerate() {
            let tilt = |seed: usize| (0.15 * noise(view << 22 | pixel << 2 | seed)) as f32;
            let tilted = [normal[0] + tilt(0), normal[1] + tilt(1), normal[2]];
            *normal = glam::Vec3::from_array(tilted).normalize().to_array();
        }
    }
    let Shape::Sphere { center, .. } = made.surfaces[0].shape else { unreachable!() };
    let Shape::Rectangle { right, down, .. } = made.surfaces[1].shape else { unreachable!() };
    let cloud = fuse_maps(&made, &maps, OPTIONS);
    let (mut single, mut fused) = (0.0, 0.0);
    for (&position, &normal) in cloud.positions.iter().zip(&cloud.normals) {
        let normal = DVec3::from_array(normal.map(f64::from));
        assert!((normal.length() - 1.0).abs() < 1e-5);
        let outward = DVec3::from_array(position) - center;
        let truth = if outward.length() < 0.71 { outward.normalize() } else { -right.cross(down) };
        fused += normal.angle_between(truth) / cloud.normals.len() as f64;
    }
    for (normal, truth) in maps[0].normal.iter().zip(&made.truth[0].normal) {
        let (normal, truth) = (glam::Vec3::from_array(*normal), glam::Vec3::from_array(*truth));
        single += f64::from(normal.angle_between(truth)) / maps[0].normal.len() as f64;
    }
    assert!(fused < 0.6 * single, "{fused} against {single}");
}

#[test]
fn colors_are_the_pictures_at_the_point_and_gray_without() {
    let made = procedural::plane_and_sphere();
    let cloud = fuse_maps(&made, &made.truth, OPTIONS);
    let mut difference = 0.0;
    for (point, &position) in cloud.positions.iter().enumerate() {
        let view = &made.views[cloud.views.get(point)[0] as usize];
        let (pixel, _) = view.camera.project(DVec3::from_array(position)).unwrap();
        let (column, row) = view.camera.nearest_pixel(pixel).unwrap();
        let seen = view.picture.decoded().unwrap().rgb((row * view.camera.width + column) as usize);
        difference += (0..3).map(|c| f64::from(seen[c].abs_diff(cloud.colors[point][c]))).sum::<f64>() / 3.0;
    }
    assert!(difference / (cloud.positions.len() as f64) < 12.0, "{difference}");

    let overlap = all_others(made.views.len());
    let mut views = fusion_views(&made, &made.truth, &overlap);
    views.iter_mut().for_each(|view| view.picture = None);
    let cloud = fuse(&views, &OPTIONS, &ignore_progress).unwrap();
    assert!(cloud.colors.iter().all(|&color| color == [128; 3]));
}

#[test]
fn a_point_names_the_view_it_started_in_and_then_views_that_see_it() {
    let made = procedural::occluding_post();
    let cloud = fuse_maps(&made, &made.truth, OPTIONS);
    let (mut named, mut visible) = (0, 0);
    for (point, &position) in cloud.positions.iter().enumerate() {
        let views = cloud.views.get(point);
        assert!(views.len() > OPTIONS.min_agreeing_views as usize);
        assert!(views[1..].windows(2).all(|pair| pair[0] < pair[1]));
        assert!(!views[1..].contains(&views[0]));
        for &view in views {
            let camera = &made.views[view as usize].camera;
            let (pixel, depth) = camera.project(DVec3::from_array(position)).unwrap();
            // The average may lie over the pixel's border: any pixel around may be the one that agreed.
            let agrees = (0..9).any(|place| {
                let offset = DVec2::new(f64::from(place % 3) - 1.0, f64::from(place / 3) - 1.0);
                camera.nearest_pixel(pixel + offset).is_some_and(|(column, row)| {
                    let there = made.truth[view as usize].depth[(row * camera.width + column) as usize];
                    (f64::from(there) - depth).abs() < 0.011 * depth
                })
            });
            assert!(agrees, "view {view} does not see point {point}");
            named += 1;
            visible += usize::from(made.is_visible(before(position, camera), view as usize));
        }
    }
    assert!(f64::from(visible as u32) > 0.98 * f64::from(named), "{visible} of {named}");
}

/// The point a little nearer to the camera: its own surface must not hide it.
fn before(position: [f64; 3], camera: &Camera) -> DVec3 {
    DVec3::from_array(position).lerp(camera.center(), 1e-3)
}

#[test]
fn the_cloud_is_the_same_bits_for_any_number_of_threads() {
    let made = procedural::plane_and_sphere();
    let maps = noisy(&made.truth, 0.004);
    let on_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fuse_maps(&made, &maps, OPTIONS))
    };
    let one = on_threads(1);
    assert!(one == on_threads(2));
    assert!(one == on_threads(5));
}

#[test]
fn pixels_without_a_usable_estimate_make_no_points() {
    let made = procedural::plane_and_sphere();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, f32::MIN_POSITIVE] {
        let mut maps = made.truth.to_vec();
        for maps in &mut maps {
            maps.depth.iter_mut().step_by(3).for_each(|depth| *depth = bad);
            maps.normal.iter_mut().step_by(5).for_each(|normal| normal[1] = f32::NAN);
        }
        let cloud = fuse_maps(&made, &maps, OPTIONS);
        assert!(cloud.positions.len() > 1000);
        assert!(mean_error(&made, &cloud) < 1e-3);
        assert!(cloud.normals.iter().flatten().all(|coordinate| coordinate.is_finite()));
        for maps in &mut maps {
            maps.depth.fill(bad);
        }
        assert!(fuse_maps(&made, &maps, OPTIONS).positions.is_empty());
    }
}

#[test]
fn large_world_coordinates_lose_no_digits() {
    let mut made = procedural::plane_and_sphere();
    let here = fuse_maps(&made, &made.truth, OPTIONS);
    let away = DVec3::new(450_000.0, 5_400_000.0, 300.0);
    for view in &mut made.views {
        view.camera.translation -= view.camera.rotation * away;
    }
    let there = fuse_maps(&made, &made.truth, OPTIONS);
    let count = here.positions.len() as f64;
    assert!((there.positions.len() as f64 - count).abs() < 0.01 * count);
    let moved = |&point: &[f64; 3]| (DVec3::from_array(point) - away).to_array();
    let back = PointCloud { positions: there.positions.iter().map(moved).collect(), ..there };
    assert!(mean_error(&made, &back) < 1e-4);
}

#[test]
fn progress_follows_the_fusion_and_can_cancel_it() {
    let made = procedural::occluding_post();
    let overlap = all_others(made.views.len());
    let views = fusion_views(&made, &made.truth, &overlap);
    let seen = Mutex::new(Vec::new());
    let watch = |progress: &Progress| {
        seen.lock().unwrap().push(*progress);
        ControlFlow::Continue(())
    };
    fuse(&views, &OPTIONS, &watch).unwrap();
    let seen = seen.into_inner().unwrap();
    assert!(seen.iter().all(|progress| progress.phase == Phase::Fusion && progress.views == 9));
    assert!(seen.windows(2).all(|pair| pair[0].done <= pair[1].done && pair[0].view <= pair[1].view));
    assert_eq!((seen[0].done, seen[seen.len() - 1].done), (0.0, 1.0));

    let stop = |progress: &Progress| match progress.view {
        3 => ControlFlow::Break(()),
        _ => ControlFlow::Continue(()),
    };
    assert_eq!(fuse(&views, &OPTIONS, &stop), Err(Error::Cancelled));
}

#[test]
fn only_validated_pixels_count_where_statuses_are_given() {
    let made = procedural::textureless_panel();
    let overlap = all_others(made.truth.len());
    let left_out = |pixel: usize| pixel.is_multiple_of(3);
    let statuses: Vec<PixelStatus> = (0..made.truth[0].depth.len())
        .map(|pixel| if left_out(pixel) { PixelStatus::Inconsistent } else { PixelStatus::Validated })
        .collect();
    let mut with_status = fusion_views(&made, &made.truth, &overlap);
    with_status.iter_mut().for_each(|view| view.status = Some(&statuses));
    let mut without = made.truth.to_vec();
    for maps in &mut without {
        maps.depth
            .iter_mut()
            .enumerate()
            .filter(|(pixel, _)| left_out(*pixel))
            .for_each(|(_, depth)| *depth = 0.0);
    }
    let cloud = fuse(&with_status, &OPTIONS, &ignore_progress).unwrap();
    assert!(!cloud.positions.is_empty());
    assert!(cloud == fuse_maps(&made, &without, OPTIONS));
}

#[test]
fn bad_input_is_named() {
    let made = procedural::textureless_panel();
    let overlap = all_others(2);
    let views = fusion_views(&made, &made.truth[..2], &overlap);
    let refused = |view: FusionView, options: FusionOptions| {
        fuse(&[view, views[1]], &options, &ignore_progress).unwrap_err().to_string()
    };
    let short = Maps { depth: vec![1.0; 5], normal: made.truth[0].normal.clone() };
    let text = refused(FusionView { maps: &short, ..views[0] }, OPTIONS);
    assert!(text.contains("views[0].maps.depth is 5 values") && text.contains("12288"), "{text}");
    let text = refused(FusionView { status: Some(&[PixelStatus::Validated; 5]), ..views[0] }, OPTIONS);
    assert!(text.contains("views[0].status is 5 values") && text.contains("12288"), "{text}");
    let small = skep::image::Picture::from_gray(2, 1, vec![0; 2]).unwrap();
    for wrong in [f32::NAN, f32::INFINITY, -0.1, 1.1] {
        let confidence = vec![wrong; views[0].camera.pixels()];
        let text = refused(FusionView { confidence: Some(&confidence), ..views[0] }, OPTIONS);
        assert!(text.contains("views[0].confidence[0]") && text.contains("0 to 1"), "{text}");
    }
    let text = refused(FusionView { picture: Some(&small), ..views[0] }, OPTIONS);
    assert!(text.contains("views[0].picture is 2x1") && text.contains("128x96"), "{text}");
    for overlap in [&[0][..], &[2], &[1, 1]] {
        let text = refused(FusionView { overlap, ..views[0] }, OPTIONS);
        assert!(text.contains("views[0].overlap["), "{text}");
    }
    let text = refused(views[0], FusionOptions { depth_tolerance: f64::NAN, ..OPTIONS });
    assert!(text.contains("options.fusion.depth_tolerance is NaN"), "{text}");
    let text = refused(views[0], FusionOptions { normal_tolerance: -1.0, ..OPTIONS });
    assert!(text.contains("options.fusion.normal_tolerance is -1"), "{text}");
}

#[test]
fn no_views_make_an_empty_cloud() {
    assert_eq!(fuse(&[], &OPTIONS, &ignore_progress), Ok(PointCloud::default()));
}

#[test]
fn a_pixel_that_became_part_of_a_point_starts_none() {
    let made = procedural::plane_and_sphere();
    let cloud = fuse_maps(&made, &made.truth, OPTIONS);
    // The first view starts a point for each of its pixels that enough others see; later ones fill what is
    // left.
    let starts =
        |view: u32| (0..cloud.views.len()).filter(|&point| cloud.views.get(point)[0] == view).count();
    let first = starts(0);
    let camera = &made.views[0].camera;
    let seen = (0..camera.pixels()).filter(|&pixel| {
        let position = camera.unproject(pixel_center(camera, pixel), f64::from(made.truth[0].depth[pixel]));
        (1..9).filter(|&view| made.is_visible(before(position.to_array(), camera), view)).count() >= 3
    });
    let seen = seen.count();
    assert!(first as f64 > 0.95 * seen as f64, "{first} of {seen}");
    for view in 2..9 {
        assert!(starts(view) * 2 < first, "view {view} starts {} points", starts(view));
    }
}

#[test]
fn photographs_of_different_exposure_agree_on_the_colors_of_their_points() {
    let mut made = procedural::plane_and_sphere();
    for (index, view) in made.views.iter_mut().enumerate() {
        let (width, height) = view.picture.size();
        let gray = [100, 80, 120, 90, 110][index % 5];
        let grays = vec![gray; (width * height) as usize];
        view.picture = skep::image::Picture::from_gray(width, height, grays).unwrap().into();
    }
    // Between the darkest and the brightest point: their sets of views differ.
    let spread = |compensate_exposure| {
        let cloud = fuse_maps(&made, &made.truth, FusionOptions { compensate_exposure, ..OPTIONS });
        let grays = || cloud.colors.iter().map(|color| color[0]);
        grays().max().unwrap() - grays().min().unwrap()
    };
    assert!(spread(false) > 5, "{}", spread(false));
    assert!(spread(true) <= 1, "{}", spread(true));
}
