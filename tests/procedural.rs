//! The procedural scenes that other tests measure against are themselves exact.

mod common;

use common::procedural::{self, MIDDLE, Procedural, Texture, pixel_center};
use glam::DVec3;
use skep::View;
use skep::geometry::Plane;

fn scenes() -> Vec<Procedural> {
    vec![procedural::plane_and_sphere(), procedural::occluding_post(), procedural::textureless_panel()]
}

/// Whether another surface is seen within a pixel.
fn is_on_edge(made: &Procedural, view: usize, pixel: usize) -> bool {
    let camera = &made.views[view].camera;
    let (width, surface) = (camera.width as usize, made.hit(view, pixel).map(|hit| hit.surface));
    let (column, row) = (pixel % width, pixel / width);
    (row.saturating_sub(1)..=(row + 1).min(camera.height as usize - 1)).any(|row| {
        (column.saturating_sub(1)..=(column + 1).min(width - 1))
            .any(|column| made.hit(view, row * width + column).map(|hit| hit.surface) != surface)
    })
}

#[test]
fn truth_agrees_between_views_where_the_ray_test_says_visible() {
    for made in scenes() {
        let (mut visible, mut hidden) = (0, 0);
        for pixel in (0..made.truth[0].depth.len()).step_by(5) {
            let camera = &made.views[0].camera;
            let depth = f64::from(made.truth[0].depth[pixel]);
            let position = camera.unproject(pixel_center(camera, pixel), depth);
            for (view, other) in made.views.iter().enumerate().skip(1) {
                let Some((projection, depth)) = other.camera.project(position) else { continue };
                let Some((column, row)) = other.camera.nearest_pixel(projection) else { continue };
                let nearest = (row * other.camera.width + column) as usize;
                // From the pixel's center to the projection along its tangent plane.
                let normal = DVec3::from_array(made.truth[view].normal[nearest].map(f64::from));
                let center = pixel_center(&other.camera, nearest);
                let there = f64::from(made.truth[view].depth[nearest]);
                let there = Plane::at(&other.camera, center, there, normal).depth(&other.camera, projection);
                // At the rim of the sphere a tangent plane says little, at an edge the nearest pixel.
                if normal.z > -0.35 || is_on_edge(&made, view, nearest) {
                    continue;
                }
                if made.is_visible(position, view) {
                    visible += 1;
                    assert!((there - depth).abs() < 5e-3 * depth, "{there} is {depth}");
                } else {
                    hidden += 1;
                    assert!(there < depth * 0.99, "{there} hides {depth}");
                }
            }
        }
        assert!(visible > 10_000, "{visible} visible");
        let occludes = made.surfaces.len() == 2 && made.surfaces[0].texture == Texture::Noise;
        assert_eq!(hidden > 100, occludes, "{hidden} hidden");
    }
}

#[test]
fn depth_fills_every_image_and_normals_are_unit_and_face_the_camera() {
    for made in scenes() {
        for (view, truth) in made.views.iter().zip(&made.truth) {
            for (pixel, (&depth, &normal)) in truth.depth.iter().zip(&truth.normal).enumerate() {
                let normal = DVec3::from_array(normal.map(f64::from));
                assert!(depth > 1.0 && depth < 10.0);
                assert!((normal.length() - 1.0).abs() < 1e-6);
                assert!(normal.dot(view.camera.ray(pixel_center(&view.camera, pixel))) < 0.0);
            }
        }
    }
}

#[test]
fn pictures_of_a_surface_point_look_alike_and_have_texture() {
    let made = procedural::plane_and_sphere();
    let (mut difference, mut contrast, mut count) = (0.0, 0.0, 0.0);
    for point in &made.points {
        let gray = |view: u32| {
            let View { camera, picture, .. } = &made.views[view as usize];
            let (column, row) = camera.nearest_pixel(camera.project(point.position).unwrap().0).unwrap();
            f64::from(picture.gray()[(row * camera.width + column) as usize])
        };
        difference += (gray(point.views[0]) - gray(point.views[1])).abs();
        contrast += (gray(point.views[0]) - 127.5).abs();
        count += 1.0;
    }
    assert!(contrast / count > 15.0, "mean contrast {}", contrast / count);
    assert!(difference < 0.6 * contrast, "{difference} against {contrast}");
}

#[test]
fn many_pairs_of_views_see_the_scene_under_a_good_angle() {
    let made = procedural::plane_and_sphere();
    for (index, view) in made.views.iter().enumerate() {
        let good = made.views.iter().filter(|other| {
            let angle = view.camera.center().angle_between(other.camera.center()).to_degrees();
            (10.0..=30.0).contains(&angle)
        });
        assert!(good.count() >= 4, "view {index}");
    }
    assert!(made.points.len() > 1000);
    made.scene();
}

#[test]
fn the_panel_has_one_gray_value_and_no_sparse_points() {
    let made = procedural::textureless_panel();
    let mut panel = 0;
    for (pixel, &gray) in made.views[MIDDLE].picture.gray().iter().enumerate() {
        if made.hit(MIDDLE, pixel).unwrap().surface == procedural::PANEL && !is_on_edge(&made, MIDDLE, pixel)
        {
            assert_eq!(gray, 128);
            panel += 1;
        }
    }
    assert!((400..3000).contains(&panel), "{panel} pixels of panel");
    let on_panel = |point: DVec3| {
        let (pixel, _) = made.views[MIDDLE].camera.project(point).unwrap();
        made.views[MIDDLE].camera.nearest_pixel(pixel).is_some_and(|(column, row)| {
            let pixel = (row * made.views[MIDDLE].camera.width + column) as usize;
            made.hit(MIDDLE, pixel).unwrap().surface == procedural::PANEL && !is_on_edge(&made, MIDDLE, pixel)
        })
    };
    assert!(!made.points.iter().any(|point| on_panel(point.position)));
}
