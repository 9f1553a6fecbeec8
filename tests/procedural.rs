//! The procedural scenes of the other tests: their truth is exact.

mod common;

use common::procedural::{self, MIDDLE, Procedural, Texture, pixel_center};
use glam::DVec3;
use skep::View;
use skep::geometry::Plane;

fn scenes() -> Vec<Procedural> {
    vec![procedural::plane_and_sphere(), procedural::occluding_post(), procedural::textureless_panel()]
}

/// Whether a neighboring pixel shows another surface.
fn is_on_edge(scene: &Procedural, view: usize, pixel: usize) -> bool {
    let camera = &scene.views[view].camera;
    let (width, surface) = (camera.width as usize, scene.hit(view, pixel).map(|hit| hit.surface));
    let (column, row) = (pixel % width, pixel / width);
    (row.saturating_sub(1)..=(row + 1).min(camera.height as usize - 1)).any(|row| {
        (column.saturating_sub(1)..=(column + 1).min(width - 1))
            .any(|column| scene.hit(view, row * width + column).map(|hit| hit.surface) != surface)
    })
}

#[test]
fn depths_of_visible_points_agree_between_views() {
    for scene in scenes() {
        let (mut visible, mut hidden) = (0, 0);
        for pixel in (0..scene.truth[0].depth.len()).step_by(5) {
            let camera = &scene.views[0].camera;
            let depth = f64::from(scene.truth[0].depth[pixel]);
            let position = camera.unproject(pixel_center(camera, pixel), depth);
            for (view, other) in scene.views.iter().enumerate().skip(1) {
                let Some((projection, depth)) = other.camera.project(position) else { continue };
                let Some((column, row)) = other.camera.nearest_pixel(projection) else { continue };
                let nearest = (row * other.camera.width + column) as usize;
                // The depth at the projection, by the tangent plane at the nearest pixel.
                let normal = DVec3::from_array(scene.truth[view].normal[nearest].map(f64::from));
                let center = pixel_center(&other.camera, nearest);
                let there = f64::from(scene.truth[view].depth[nearest]);
                let there = Plane::at(&other.camera, center, there, normal).depth(&other.camera, projection);
                // Tangent planes are inaccurate at the rim of the sphere, nearest pixels at edges.
                if normal.z > -0.35 || is_on_edge(&scene, view, nearest) {
                    continue;
                }
                if scene.is_visible(position, view) {
                    visible += 1;
                    assert!((there - depth).abs() < 5e-3 * depth, "{there} instead of {depth}");
                } else {
                    hidden += 1;
                    assert!(there < depth * 0.99, "{there} does not occlude {depth}");
                }
            }
        }
        assert!(visible > 10_000, "{visible} visible");
        let occludes = scene.surfaces.len() == 2 && scene.surfaces[0].texture == Texture::Noise;
        assert_eq!(hidden > 100, occludes, "{hidden} hidden");
    }
}

#[test]
fn every_pixel_has_a_depth_and_a_unit_normal_facing_the_camera() {
    for scene in scenes() {
        for (view, truth) in scene.views.iter().zip(&scene.truth) {
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
fn pictures_of_a_point_are_similar_and_textured() {
    let scene = procedural::plane_and_sphere();
    let (mut difference, mut contrast, mut count) = (0.0, 0.0, 0.0);
    for point in &scene.points {
        let gray = |view: u32| {
            let View { camera, picture, .. } = &scene.views[view as usize];
            let (column, row) = camera.nearest_pixel(camera.project(point.position).unwrap().0).unwrap();
            f64::from(picture.decoded().unwrap().gray()[(row * camera.width + column) as usize])
        };
        difference += (gray(point.views[0]) - gray(point.views[1])).abs();
        contrast += (gray(point.views[0]) - 127.5).abs();
        count += 1.0;
    }
    assert!(contrast / count > 15.0, "mean contrast {}", contrast / count);
    assert!(difference < 0.6 * contrast, "{difference} against {contrast}");
}

#[test]
fn every_view_has_four_views_with_a_useful_triangulation_angle() {
    let scene = procedural::plane_and_sphere();
    for (index, view) in scene.views.iter().enumerate() {
        let useful = scene.views.iter().filter(|other| {
            let angle = view.camera.center().angle_between(other.camera.center()).to_degrees();
            (10.0..=30.0).contains(&angle)
        });
        assert!(useful.count() >= 4, "view {index}");
    }
    assert!(scene.points.len() > 1000);
    scene.scene();
}

#[test]
fn the_panel_is_uniform_and_has_no_sparse_points() {
    let scene = procedural::textureless_panel();
    let mut panel = 0;
    for (pixel, &gray) in scene.views[MIDDLE].picture.decoded().unwrap().gray().iter().enumerate() {
        if scene.hit(MIDDLE, pixel).unwrap().surface == procedural::PANEL
            && !is_on_edge(&scene, MIDDLE, pixel)
        {
            assert_eq!(gray, 128);
            panel += 1;
        }
    }
    assert!((400..3000).contains(&panel), "{panel} pixels of panel");
    let on_panel = |point: DVec3| {
        let (pixel, _) = scene.views[MIDDLE].camera.project(point).unwrap();
        scene.views[MIDDLE].camera.nearest_pixel(pixel).is_some_and(|(column, row)| {
            let pixel = (row * scene.views[MIDDLE].camera.width + column) as usize;
            scene.hit(MIDDLE, pixel).unwrap().surface == procedural::PANEL
                && !is_on_edge(&scene, MIDDLE, pixel)
        })
    };
    assert!(!scene.points.iter().any(|point| on_panel(point.position)));
}
