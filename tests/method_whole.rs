//! The whole method on procedural scenes with ground truth.

mod common;

use common::changed;
use common::measure::{Share, normal_error, share_right};
use common::procedural::{self, MIDDLE, Procedural, Shape, Surface, Texture, looking_at, pixel_center};
use glam::{DVec2, DVec3};
use skep::simd::SimdLevel;
use skep::{
    DepthRange, Error, Maps, Options, Phase, PixelStatus, Progress, Reconstruction, Scale, ViewResult,
    ignore_progress, reconstruct,
};
use std::ops::ControlFlow;
use std::sync::Mutex;

/// Of true depth, as the fusion's tolerance.
const RIGHT: f64 = 0.01;

fn options() -> Options {
    changed(Options::default(), |o| {
        o.threads = 2;
    })
}

fn run(made: &Procedural, options: &Options) -> Reconstruction {
    let result = reconstruct(&made.scene(), options, &ignore_progress).unwrap();
    assert_eq!(result.views.len(), made.views.len());
    for (view, made) in result.views.iter().zip(&made.views) {
        let pixels = made.camera.pixels();
        assert_eq!(view.raw.depth.len(), pixels);
        assert_eq!(view.raw.normal.len(), pixels);
        assert_eq!(view.cost.len(), pixels);
        assert_eq!(view.status.len(), pixels);
    }
    result
}

fn share_right_of_estimates(
    made: &Procedural,
    result: &Reconstruction,
    chosen: impl Fn(usize, usize) -> bool,
) -> f64 {
    let maps = result.views.iter().map(|view| &view.raw).zip(&made.truth);
    share_right(maps, RIGHT, chosen).value()
}

fn is_validated(result: &Reconstruction, view: usize, pixel: usize) -> bool {
    result.views[view].status[pixel] == PixelStatus::Validated
}

#[test]
fn most_pixels_of_a_textured_scene_are_right() {
    let made = procedural::plane_and_sphere();
    let result = run(&made, &options());

    let raw = share_right_of_estimates(&made, &result, |_, _| true);
    assert!(raw > 0.85, "{raw} of the raw estimates are right");
    let precision =
        share_right_of_estimates(&made, &result, |view, pixel| is_validated(&result, view, pixel));
    assert!(precision > 0.93, "{precision} of the validated pixels are right");
    let filtered: Vec<Maps> = result.views.iter().map(ViewResult::validated).collect();
    let complete = share_right(filtered.iter().zip(&made.truth), RIGHT, |_, _| true).value();
    assert!(complete > 0.8, "{complete} of all pixels are validated and right");

    let mut close_normals = Share::default();
    for (view, truth) in result.views.iter().zip(&made.truth) {
        for pixel in (0..truth.depth.len()).filter(|&pixel| view.status[pixel] == PixelStatus::Validated) {
            close_normals.add(normal_error(&view.raw, truth, pixel) < 20.0);
        }
    }
    assert!(close_normals.value() > 0.75, "{close_normals:?}");

    let on_a_surface = |point: &[f64; 3]| {
        let point = DVec3::from_array(*point);
        made.surfaces.iter().any(|surface| surface.shape.distance(point) < 0.02)
    };
    let cloud = &result.points;
    let near = cloud.positions.iter().filter(|point| on_a_surface(point)).count();
    assert!(near as f64 > 0.9 * cloud.positions.len() as f64, "{near} of {}", cloud.positions.len());
    assert!(cloud.positions.len() > 10_000, "{} points", cloud.positions.len());
}

#[test]
fn every_pixel_has_a_depth_in_range_a_unit_normal_and_a_reason() {
    let made = procedural::plane_and_sphere().only(&[1, 3, 4, 5, 7]);
    let scene = made.scene();
    let result = run(&made, &options());
    for (index, view) in result.views.iter().enumerate() {
        let (camera, range) = (&made.views[index].camera, scene.depth_range(index));
        assert_eq!(view.status_counts().iter().sum::<u64>(), camera.pixels() as u64);
        for pixel in 0..camera.pixels() {
            let depth = f64::from(view.raw.depth[pixel]);
            // A derived range is searched beyond its ends.
            assert!((range.near * 0.699..=range.far * 4.001).contains(&depth), "depth {depth}");
            let normal = DVec3::from_array(view.raw.normal[pixel].map(f64::from));
            assert!((normal.length() - 1.0).abs() < 1e-3);
            assert!(normal.dot(camera.ray(pixel_center(camera, pixel))) < 0.0, "a normal turns away");
            assert!((0.0..=2.0).contains(&view.cost[pixel]), "cost {}", view.cost[pixel]);
        }
        assert!(view.sources.iter().all(|&source| source as usize != index && source < 5));
        assert!(
            view.counts.ncc_evaluations > 0 && view.counts.bilinear_samples > view.counts.ncc_evaluations
        );
        assert!(!view.cycles.is_empty());
    }
}

/// View sets of validated wall pixels against the true occlusion by the post.
struct SetShares {
    /// Members of the sets in which the point is visible.
    precision: Share,
    /// Hidden sources that are in the set.
    hidden_kept: Share,
    /// Visible sources that are in the set.
    visible_kept: Share,
}

fn set_shares(made: &Procedural, result: &Reconstruction) -> SetShares {
    let mut shares = SetShares {
        precision: Share::default(),
        hidden_kept: Share::default(),
        visible_kept: Share::default(),
    };
    for (index, view) in result.views.iter().enumerate() {
        for pixel in 0..view.status.len() {
            let hit = made.hit(index, pixel).unwrap();
            if view.status[pixel] != PixelStatus::Validated || hit.surface == procedural::POST {
                continue;
            }
            for (place, &source) in view.sources.iter().enumerate() {
                let camera = &made.views[source as usize].camera;
                let (projection, _) = camera.project(hit.position).unwrap();
                if camera.nearest_pixel(projection).is_none() {
                    continue;
                }
                let sees = made.is_visible(hit.position, source as usize);
                let kept = view.view_sets.contains(pixel, place);
                if kept {
                    shares.precision.add(sees);
                }
                if sees { &mut shares.visible_kept } else { &mut shares.hidden_kept }.add(kept);
            }
        }
    }
    shares
}

#[test]
fn views_that_are_occluded_are_dropped_from_the_pixel_s_set() {
    let made = procedural::occluding_post();
    let with = set_shares(&made, &run(&made, &options()));
    let without = set_shares(
        &made,
        &run(
            &made,
            &changed(options(), |o| {
                o.view_selection.pixelwise_view_selection = false;
            }),
        ),
    );

    assert!(with.hidden_kept.count > 2_000, "{:?}", with.hidden_kept);
    assert!(with.hidden_kept.value() < 0.25, "{:?} of the hidden sources stay", with.hidden_kept);
    assert!(with.visible_kept.value() > 0.9, "{:?} of the seeing sources stay", with.visible_kept);
    assert!(with.precision.value() > 0.97, "{:?}", with.precision);
    assert!(without.hidden_kept.value() > 0.9, "{:?}", without.hidden_kept);
    assert!(with.precision.value() > without.precision.value());
}

/// Pixels of the panel whose window holds nothing else.
fn is_inside_panel(made: &Procedural, view: usize, pixel: usize, margin: usize) -> bool {
    let width = made.views[view].camera.width as usize;
    let on_panel = |pixel: usize| made.hit(view, pixel).is_some_and(|hit| hit.surface == procedural::PANEL);
    on_panel(pixel)
        && [margin, margin * width].iter().all(|step| on_panel(pixel - step) && on_panel(pixel + step))
}

#[test]
fn a_panel_without_texture_is_recovered_with_the_reward_or_smoothness_and_not_without_both() {
    let made = procedural::textureless_panel().only(&[1, 3, 4, 5, 7]);
    // Other ways to propagate planes inwards are off: coarser scales, on which the panel is small, other
    // views, and filling.
    let scale = Scale { downscale: 1, food_sources: 3, first_iterations: 6, cycles: 16, cycle_iterations: 1 };
    let alone = changed(options(), |o| {
        o.schedule.scales = vec![scale];
        o.schedule.min_changed_fraction = 0.0;
        o.search.view_propagation = false;
        o.cost.geom_consistency_weight = 0.0;
        o.window.min_texture_to_noise = 0.0;
    });
    let margin = options().window.window_radius as usize + 1;
    let inside: Vec<Vec<bool>> = (0..made.views.len())
        .map(|view| {
            let pixels = 0..made.views[view].camera.pixels();
            pixels.map(|pixel| is_inside_panel(&made, view, pixel, margin)).collect()
        })
        .collect();
    let recovered = |reward: f64, smoothness: f64| {
        let result = run(
            &made,
            &changed(alone.clone(), |o| {
                o.search.smoothness_reward = reward;
                o.cost.smoothness_weight = smoothness;
            }),
        );
        share_right_of_estimates(&made, &result, |view, pixel| inside[view][pixel])
    };
    let without = recovered(0.0, 0.0);
    assert!(without < 0.1, "{without} without both");
    for (reward, smoothness) in
        [(options().search.smoothness_reward, 0.0), (0.0, options().cost.smoothness_weight)]
    {
        let with = recovered(reward, smoothness);
        assert!(with > 0.5, "{with} with reward {reward} and smoothness {smoothness}");
    }
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn assert_same_bits(one: &Reconstruction, other: &Reconstruction, what: &str) {
    for (a, b) in one.views.iter().zip(&other.views) {
        assert!(bits(&a.raw.depth) == bits(&b.raw.depth), "depths {what}");
        let (normals, others) = (a.raw.normal.as_flattened(), b.raw.normal.as_flattened());
        assert!(bits(normals) == bits(others), "normals {what}");
        assert!(bits(&a.cost) == bits(&b.cost), "costs {what}");
        assert!(a.status == b.status, "outcomes {what}");
        assert!(a.sources == b.sources && a.view_sets == b.view_sets, "sets {what}");
        assert_eq!(a.counts, b.counts);
        assert_eq!(a.cycles, b.cycles);
    }
    assert!(one.points == other.points, "points {what}");
    assert_eq!(one.warnings, other.warnings);
}

#[test]
fn the_result_is_the_same_bits_for_any_number_of_threads() {
    let made = procedural::plane_and_sphere().only(&[1, 3, 4, 5]);
    let one = run(
        &made,
        &changed(options(), |o| {
            o.threads = 1;
        }),
    );
    for threads in [2, 5] {
        let other = run(
            &made,
            &changed(options(), |o| {
                o.threads = threads;
            }),
        );
        assert_same_bits(&one, &other, &format!("on {threads} threads"));
    }
}

#[test]
fn the_result_is_the_same_bits_on_every_instruction_set() {
    let made = procedural::plane_and_sphere().only(&[3, 4, 5]);
    let on = |level: SimdLevel| {
        run(
            &made,
            &changed(options(), |o| {
                o.simd = Some(level);
            }),
        )
    };
    let scalar = on(SimdLevel::Scalar);
    for level in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
        assert_same_bits(&scalar, &on(level), &format!("on {}", level.name()));
    }
}

#[test]
fn another_seed_gives_other_bits() {
    let made = procedural::plane_and_sphere().only(&[3, 4, 5]);
    let depth = |seed: u64| {
        run(
            &made,
            &changed(options(), |o| {
                o.seed = seed;
            }),
        )
        .views[1]
            .raw
            .depth
            .clone()
    };
    assert!(depth(0) != depth(1));
}

#[test]
fn the_progress_function_is_called_and_can_cancel_in_every_phase() {
    let scene = procedural::plane_and_sphere().only(&[3, 4, 5]).scene();
    let seen = Mutex::new(Vec::new());
    let watch = |progress: &Progress| {
        seen.lock().unwrap().push(*progress);
        ControlFlow::Continue(())
    };
    reconstruct(&scene, &options(), &watch).unwrap();
    let seen = seen.into_inner().unwrap();
    assert!(seen.iter().all(|progress| progress.views == 3 && progress.view < 3));
    assert!(seen.iter().all(|progress| (0.0..=1.0).contains(&progress.done)));
    for phase in [Phase::Search, Phase::Check, Phase::Fusion] {
        assert!(seen.iter().any(|progress| progress.phase == phase), "{}", phase.name());
        let stop = |progress: &Progress| match progress.phase == phase {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        assert_eq!(reconstruct(&scene, &options(), &stop).err(), Some(Error::Cancelled), "{}", phase.name());
    }
}

/// Asserts that a run has no validated pixel or point, and a reason for every pixel.
fn assert_ends_with_reasons(made: &Procedural) {
    for options in [
        changed(options(), |o| o.check.few_views = 0),
        changed(Options::paper(), |o| {
            o.threads = 2;
        }),
    ] {
        let result = run(made, &options);
        assert!(result.points.positions.is_empty());
        assert!(!result.warnings.is_empty(), "an empty result without a warning");
        for view in &result.views {
            let reasons = [
                PixelStatus::NoSources,
                PixelStatus::NoTexture,
                PixelStatus::Inconsistent,
                PixelStatus::OutOfRange,
            ];
            assert!(view.status.iter().all(|status| reasons.contains(status)));
            let without_sources = view.status.iter().filter(|&&o| o == PixelStatus::NoSources).count();
            assert!(without_sources * 2 > view.status.len(), "{:?}", view.status_counts());
        }
    }
}

#[test]
fn two_views_finish_without_validated_pixels_and_with_reasons() {
    assert_ends_with_reasons(&procedural::plane_and_sphere().only(&[3, 4]));
}

#[test]
fn two_views_suffice_if_one_consistent_source_does() {
    let made = procedural::plane_and_sphere().only(&[0, 1]);
    let mut options = changed(options(), |o| {
        o.check.min_consistent_views = 1;
    });
    options.fusion.min_agreeing_views = 1;
    let result = run(&made, &options);
    let validated = result.views[0].status_counts()[0] as f64 / result.views[0].status.len() as f64;
    assert!(validated > 0.6, "{validated} of the pixels are validated");
    let right = share_right_of_estimates(&made, &result, |view, pixel| is_validated(&result, view, pixel));
    assert!(right > 0.85, "{right} of the validated pixels are right");
    assert!(result.points.positions.len() > 5_000);
}

#[test]
fn views_without_overlap_finish_without_validated_pixels_and_with_reasons() {
    // Four cameras back to back, each in front of its own wall.
    let yaws = [0.0, 90.0, 180.0, 270.0];
    let outwards = |yaw: f64| DVec3::new(-yaw.to_radians().sin(), 0.0, yaw.to_radians().cos());
    let walls = yaws.map(|yaw| Surface {
        shape: Shape::upright(outwards(yaw) * 4.0, yaw, DVec2::splat(4.0)),
        texture: Texture::Noise,
    });
    let cameras = yaws.map(|yaw| looking_at(outwards(yaw) * 0.1, outwards(yaw), (64, 48), 70.0));
    let mut made = Procedural::new(walls.to_vec(), &cameras);
    for view in &mut made.views {
        view.depth_range = Some(DepthRange { near: 2.0, far: 6.0 });
    }
    assert!(made.points.is_empty());
    assert_ends_with_reasons(&made);
}

#[test]
fn masked_pixels_get_no_estimate_but_serve_other_views() {
    let mut made = procedural::plane_and_sphere();
    let width = procedural::SIZE.0 as usize;
    let is_masked = |pixel: usize| pixel % width < width / 2;
    let pixels = made.views[MIDDLE].camera.pixels();
    made.views[MIDDLE].mask = Some((0..pixels).map(|pixel| !is_masked(pixel)).collect::<Vec<_>>().into());
    // A mask that excludes every pixel.
    made.views[0].mask = Some(vec![false; pixels].into());
    let result = run(&made, &options());

    for pixel in 0..pixels {
        assert_eq!(result.views[0].status[pixel], PixelStatus::Masked);
        let view = &result.views[MIDDLE];
        assert_eq!(view.status[pixel] == PixelStatus::Masked, is_masked(pixel));
        assert_eq!(view.raw.depth[pixel] > 0.0, !is_masked(pixel));
        if is_masked(pixel) {
            assert_eq!(view.raw.normal[pixel], [0.0; 3]);
        }
    }
    assert!(result.views[0].raw.depth.iter().all(|&depth| depth == 0.0));
    let wanted = share_right_of_estimates(&made, &result, |view, pixel| view == MIDDLE && !is_masked(pixel));
    assert!(wanted > 0.8, "{wanted} of the wanted half is right");
    let others = share_right_of_estimates(&made, &result, |view, _| view != MIDDLE && view != 0);
    assert!(others > 0.8, "{others} of the other views is right");
    for point in 0..result.points.views.len() {
        assert!(!result.points.views.get(point).contains(&0), "a masked view is no part of a point");
    }
}

#[test]
fn a_view_s_own_depth_range_is_kept() {
    let mut made = procedural::plane_and_sphere().only(&[1, 3, 4, 5]);
    // The wall lies beyond, the sphere inside.
    let range = DepthRange { near: 3.0, far: 4.2 };
    made.views[1].depth_range = Some(range);
    let result = run(&made, &options());
    let depths = &result.views[1].raw.depth;
    assert!(depths.iter().all(|&depth| (2.999..4.201).contains(&depth)));
    let beyond = |pixel: usize| made.truth[1].depth[pixel] > 4.4;
    let validated =
        (0..depths.len()).filter(|&pixel| beyond(pixel) && is_validated(&result, 1, pixel)).count();
    let count = (0..depths.len()).filter(|&pixel| beyond(pixel)).count();
    assert!(count > 1000 && validated * 20 < count, "{validated} of {count} beyond the range are validated");
    let within = share_right_of_estimates(&made, &result, |view, pixel| {
        view == 1 && f64::from(made.truth[1].depth[pixel]) < 0.98 * range.far
    });
    assert!(within > 0.7, "{within} within the range are right");
}
