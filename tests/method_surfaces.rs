//! Textureless regions, gap filling, averaging, smoothing and plane fitting.

mod common;

use common::changed;
use common::measure::{Share, normal_error, share_right};
use common::procedural::{self, Procedural};
use skep::{Options, PixelStatus, Reconstruction, ignore_progress, reconstruct};

fn run(made: &Procedural, options: Options) -> Reconstruction {
    reconstruct(
        &made.scene(),
        &changed(options, |o| {
            o.threads = 2;
        }),
        &ignore_progress,
    )
    .unwrap()
}

/// Pixels of the panel whose window holds nothing else.
fn is_inside_panel(made: &Procedural, view: usize, pixel: usize) -> bool {
    let width = made.views[view].camera.width as usize;
    let on_panel = |pixel: usize| made.hit(view, pixel).is_some_and(|hit| hit.surface == procedural::PANEL);
    let margin = Options::default().window.window_radius as usize + 1;
    on_panel(pixel)
        && [margin, margin * width].iter().all(|step| on_panel(pixel - step) && on_panel(pixel + step))
}

#[test]
fn a_panel_with_noise_only_gets_the_plane_of_the_wall_around_it() {
    let made = procedural::textureless_panel().only(&[1, 3, 4, 5, 7]).with_noise(1.0);
    let recovered = |options: Options| {
        let result = run(&made, options);
        let mut share = Share::default();
        for (index, (view, truth)) in result.views.iter().zip(&made.truth).enumerate() {
            for pixel in 0..truth.depth.len() {
                if is_inside_panel(&made, index, pixel) {
                    let off = (view.raw.depth[pixel] / truth.depth[pixel] - 1.0).abs();
                    share.add(view.status[pixel] == PixelStatus::Validated && off < 0.01);
                }
            }
        }
        share
    };
    let all = recovered(Options::default());
    assert!(all.count > 500, "{all:?}");
    assert!(all.value() > 0.9, "{} of the panel is validated and right", all.value());
    // All of these also propagate planes into so small a panel. Without them there is only filling, and the
    // coarser scale, on which the panel is smaller.
    let alone = changed(Options::default(), |o| {
        o.search.smoothness_reward = 0.0;
        o.cost.smoothness_weight = 0.0;
        o.search.local_plane_tolerance = 0.0;
        o.search.onlooker_tournament_size = 1;
        o.refine.fattening_passes = 0;
        o.search.view_propagation = false;
    });
    let with = recovered(alone.clone()).value();
    let without = recovered(changed(alone, |o| {
        o.window.min_texture_to_noise = 0.0;
    }))
    .value();
    assert!(with > 0.9 && without < with - 0.1, "{with} with filling alone and {without} without it");
}

/// Shares of all pixels and of the validated ones that are validated within half a percent of the truth.
fn right_depths(made: &Procedural, options: Options) -> (Share, Share) {
    let result = run(made, options);
    let is_validated = |view: usize, pixel: usize| result.views[view].status[pixel] == PixelStatus::Validated;
    let maps = || result.views.iter().zip(&made.truth).map(|(view, truth)| (&view.raw, truth));
    let of_validated = share_right(maps(), 0.005, is_validated);
    let count = share_right(maps(), 0.005, |_, _| true).count;
    (Share { count, ..of_validated }, of_validated)
}

#[test]
fn closing_gaps_completes_surfaces_without_wrong_ones() {
    let made = procedural::plane_and_sphere().only(&[1, 3, 4, 5, 7]);
    let (complete, right) = right_depths(&made, Options::default());
    let (complete_without, right_without) = right_depths(
        &made,
        changed(Options::default(), |o| {
            o.refine.fill_gaps = false;
        }),
    );
    let (with, without) = (complete.value(), complete_without.value());
    assert!(with > without + 0.003, "{with} of the pixels are right with closed gaps, {without} without");
    assert!(
        right.value() > right_without.value() - 0.005,
        "{} right, {}",
        right.value(),
        right_without.value()
    );
}

/// Median errors of the validated depths, relative, and normals, in degrees.
fn median_errors(made: &Procedural, options: Options) -> (f64, f64) {
    let result = run(made, options);
    let (mut depths, mut normals) = (Vec::new(), Vec::new());
    for (view, truth) in result.views.iter().zip(&made.truth) {
        for pixel in (0..truth.depth.len()).filter(|&pixel| view.status[pixel] == PixelStatus::Validated) {
            let off = f64::from(view.raw.depth[pixel]) / f64::from(truth.depth[pixel]) - 1.0;
            depths.push(off.abs());
            normals.push(normal_error(&view.raw, truth, pixel));
        }
    }
    let median = |mut errors: Vec<f64>| {
        errors.sort_unstable_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    (median(depths), median(normals))
}

fn median_normal_error(made: &Procedural, options: Options) -> f64 {
    median_errors(made, options).1
}

#[test]
fn averaging_between_views_makes_depths_and_normals_more_exact() {
    let made = procedural::plane_and_sphere().only(&[1, 3, 4, 5, 7]);
    let (depth, normal) = median_errors(&made, Options::default());
    let (own_depth, own_normal) = median_errors(
        &made,
        changed(Options::default(), |o| {
            o.refine.cross_view_averaging = false;
        }),
    );
    assert!(depth < 0.9 * own_depth, "{depth} with averaging and {own_depth} without");
    assert!(normal < 0.9 * own_normal, "{normal} degrees with averaging and {own_normal} without");
}

#[test]
fn smoothing_makes_normals_more_exact() {
    let made = procedural::plane_and_sphere().only(&[1, 3, 4, 5, 7]);
    let with = median_normal_error(&made, Options::default());
    let without = median_normal_error(
        &made,
        changed(Options::default(), |o| {
            o.refine.smoothing_passes = 0;
        }),
    );
    assert!(with < 0.8 * without, "{with} degrees with smoothing and {without} without");
}

#[test]
fn planes_fitted_to_depths_in_the_first_cycle_make_normals_more_exact() {
    let made = procedural::plane_and_sphere().only(&[1, 3, 4, 5, 7]);
    // Smoothing averages normals too.
    let plain = changed(Options::default(), |o| {
        o.refine.smoothing_passes = 0;
    });
    let with = median_normal_error(&made, plain.clone());
    let without = median_normal_error(
        &made,
        changed(plain, |o| {
            o.search.local_plane_tolerance = 0.0;
        }),
    );
    assert!(with < 0.95 * without, "{with} degrees with fitted planes and {without} without");
}
