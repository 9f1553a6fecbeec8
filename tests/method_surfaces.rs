//! Surfaces as wholes: continued into places without texture, and smoothed.

mod common;

use common::measure::{Share, normal_error};
use common::procedural::{self, Procedural};
use skep::{Options, Outcome, Reconstruction, ignore_progress, reconstruct};

fn run(made: &Procedural, options: Options) -> Reconstruction {
    reconstruct(&made.scene(), &Options { threads: 2, ..options }, &ignore_progress).unwrap()
}

#[test]
fn a_panel_that_shows_nothing_but_noise_continues_the_wall_around_it() {
    let made = procedural::textureless_panel().only(&[1, 3, 4, 5, 7]).with_noise(1.0);
    let recovered = |noise_ratio: f64| {
        let result = run(&made, Options { noise_ratio, ..Options::default() });
        let mut share = Share::default();
        for (index, (view, truth)) in result.views.iter().zip(&made.truth).enumerate() {
            for pixel in 0..truth.depth.len() {
                if made.hit(index, pixel).is_some_and(|hit| hit.surface == procedural::PANEL) {
                    let off = (view.estimate.depth[pixel] / truth.depth[pixel] - 1.0).abs();
                    share.add(view.outcome[pixel] == Outcome::Validated && off < 0.01);
                }
            }
        }
        share
    };
    let (with, without) = (recovered(Options::default().noise_ratio), recovered(0.0));
    assert!(with.count > 2_000, "{with:?}");
    assert!(with.value() > 0.8, "{} of the panel is validated and right", with.value());
    assert!(without.value() < with.value() - 0.2, "{} without and {} with", without.value(), with.value());
}

#[test]
fn smoothing_makes_normals_more_exact() {
    let made = procedural::plane_and_sphere().only(&[1, 3, 4, 5, 7]);
    let median = |smoothing_passes: u32| {
        let result = run(&made, Options { smoothing_passes, ..Options::default() });
        let mut errors = Vec::new();
        for (view, truth) in result.views.iter().zip(&made.truth) {
            let validated = (0..truth.depth.len()).filter(|&pixel| view.outcome[pixel] == Outcome::Validated);
            errors.extend(validated.map(|pixel| normal_error(&view.estimate, truth, pixel)));
        }
        errors.sort_unstable_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    let (with, without) = (median(1), median(0));
    assert!(with < 0.8 * without, "{with} degrees with smoothing and {without} without");
}
