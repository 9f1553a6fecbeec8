//! What photographs have and renderings of tables do not: a sky, plain walls, small triangulation angles, views
//! in the direction of travel, poses that are not exact.

mod common;

use common::measure::share_right;
use common::procedural::{Procedural, SIZE, Shape, Surface, Texture, looking_at, plane_and_sphere, wall};
use glam::{DMat3, DVec2, DVec3};
use skep::geometry::Camera;
use skep::{Maps, Options, PixelStatus, Reconstruction, ViewResult, ignore_progress, reconstruct};

/// Focal length in pixels.
const FOCAL: f64 = 130.0;

fn run(made: &Procedural) -> Reconstruction {
    let options = Options { threads: 2, ..Options::default() };
    reconstruct(&made.scene(), &options, &ignore_progress).unwrap()
}

/// Fraction of the pixels that are validated, and of those that are right, within `tolerance` of the depth.
fn validated_and_right(made: &Procedural, result: &Reconstruction, tolerance: f64) -> (f64, f64) {
    let is_validated = |view: usize, pixel: usize| result.views[view].status[pixel] == PixelStatus::Validated;
    let pixels: usize = result.views.iter().map(|view| view.status.len()).sum();
    let validated: u64 = result.views.iter().map(|view| view.status_counts()[0]).sum();
    let raw = result.views.iter().map(|view| &view.raw);
    let right = share_right(raw.zip(&made.truth), tolerance, is_validated).value();
    (validated as f64 / pixels as f64, right)
}

/// Cameras in a row along x, `step` apart, that look at the origin from a distance of 4.
fn row(count: usize, step: f64) -> Vec<Camera> {
    let place = |index: usize| (index as f64 - (count - 1) as f64 / 2.0) * step;
    let camera = |index: usize| looking_at(DVec3::new(place(index), 0.0, -4.0), DVec3::ZERO, SIZE, FOCAL);
    (0..count).map(camera).collect()
}

/// Fraction of a surface's pixels, farther than `margin` pixels from all other surfaces, that are validated.
fn validated_inside(made: &Procedural, result: &Reconstruction, surface: usize, margin: isize) -> f64 {
    let (width, height) = (SIZE.0 as isize, SIZE.1 as isize);
    let (mut inside, mut validated) = (0, 0);
    for (index, view) in result.views.iter().enumerate() {
        let of = |x: isize, y: isize| {
            made.hit(index, (y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize)
                .map(|hit| hit.surface)
        };
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let around = [(0, 0), (-margin, 0), (margin, 0), (0, -margin), (0, margin)];
            let diagonal = margin * 7 / 10;
            let corners =
                [(-diagonal, -diagonal), (diagonal, -diagonal), (-diagonal, diagonal), (diagonal, diagonal)];
            if around.into_iter().chain(corners).all(|(dx, dy)| of(x + dx, y + dy) == Some(surface)) {
                inside += 1;
                validated += u64::from(view.status[(y * width + x) as usize] == PixelStatus::Validated);
            }
        }
    }
    assert!(inside > 1000, "{inside} pixels inside of the surface");
    validated as f64 / f64::from(inside)
}

#[test]
fn a_roof_has_no_halo_of_sky() {
    // A gable before a bright sky that is far behind.
    let turn = DMat3::from_rotation_z(45f64.to_radians());
    let shape = Shape::Rectangle {
        center: DVec3::new(0.0, 1.4, 0.0),
        right: turn * DVec3::X,
        down: turn * DVec3::Y,
        half_size: DVec2::splat(1.2),
    };
    let sky = Shape::upright(DVec3::new(0.0, 0.0, 60.0), 0.0, DVec2::splat(200.0));
    let surfaces =
        vec![Surface { shape, texture: Texture::Noise }, Surface { shape: sky, texture: Texture::Gradient }];
    let made = Procedural::new(surfaces, &row(7, 0.4)).with_noise(0.4);
    let result = run(&made);
    let roof = validated_inside(&made, &result, 0, 2);
    // Windows have a radius of 3 pixels, 4.2 at their corners.
    let sky = validated_inside(&made, &result, 1, 6);
    assert!(roof > 0.8, "{roof} of the roof is validated");
    assert!(sky < 0.02, "{sky} of the sky is validated");
}

#[test]
fn a_box_does_not_grow_over_the_plain_wall_behind_it() {
    let front = Shape::upright(DVec3::new(0.0, 0.0, -0.6), 0.0, DVec2::new(0.6, 0.5));
    let back = Shape::upright(DVec3::new(0.0, 0.0, 1.0), 0.0, DVec2::splat(20.0));
    let surfaces = vec![
        Surface { shape: front, texture: Texture::Noise },
        Surface { shape: back, texture: Texture::Uniform },
    ];
    let made = Procedural::new(surfaces, &row(7, 0.4)).with_noise(1.0);
    let result = run(&made);
    let front = validated_inside(&made, &result, 0, 2);
    let back = validated_inside(&made, &result, 1, 4);
    assert!(front > 0.8, "{front} of the box is validated");
    assert!(back < 0.01, "{back} of the wall is validated");
}

#[test]
fn two_views_at_three_degrees_are_enough() {
    let made = Procedural::new(plane_and_sphere().surfaces, &row(2, 0.21));
    let result = run(&made);
    // Half a pixel is 7 % of the depth.
    let (validated, right) = validated_and_right(&made, &result, 0.07);
    assert!(validated > 0.7, "{validated} of the pixels are validated");
    assert!(right > 0.9, "{right} of those are right");
    assert!(result.points.positions.len() > 5_000, "{} points", result.points.positions.len());
}

#[test]
fn a_walk_straight_ahead_has_depths() {
    let camera = |index: usize| {
        let position = DVec3::new(0.15, 0.1, -4.5 + 0.25 * index as f64);
        looking_at(position, position + DVec3::Z, SIZE, FOCAL)
    };
    let cameras: Vec<Camera> = (0..7).map(camera).collect();
    let made = Procedural::new(plane_and_sphere().surfaces, &cameras);
    let result = run(&made);
    let (validated, right) = validated_and_right(&made, &result, 0.05);
    assert!(validated > 0.5, "{validated} of the pixels are validated");
    assert!(right > 0.85, "{right} of those are right");
}

#[test]
fn poses_with_a_pixel_of_noise_keep_most_depths() {
    let exact = Procedural::new(vec![wall(Texture::Noise)], &row(7, 0.35));
    let mut noisy = Procedural::new(vec![wall(Texture::Noise)], &row(7, 0.35));
    for (index, view) in noisy.views.iter_mut().enumerate() {
        // Rotations by a pixel in directions that differ from view to view.
        let angle = 2.4 * index as f64;
        let axis = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let turn = DMat3::from_axis_angle(axis, 1.0 / FOCAL);
        view.camera.rotation = turn * view.camera.rotation;
        view.camera.translation = turn * view.camera.translation;
    }
    let [of_exact, of_noisy] = [&exact, &noisy].map(run);
    let residual = |result: &Reconstruction| {
        let last = |view: &ViewResult| view.cycles.last().map_or(0.0, |cycle| cycle.median_residual);
        result.views.iter().map(last).sum::<f64>() / result.views.len() as f64
    };
    let (before, after) = (residual(&of_exact), residual(&of_noisy));
    assert!(after > 2.0 * before, "{before} px with exact poses, {after} px with noise");
    let (validated, right) = validated_and_right(&noisy, &of_noisy, 0.05);
    assert!(validated > 0.6, "{validated} of the pixels are validated");
    assert!(right > 0.9, "{right} of those are right");
    let kept: Vec<Maps> = of_noisy.views.iter().map(ViewResult::validated).collect();
    assert_eq!(kept.len(), 7);
}
