//! Invalid options are refused by name.

use skep::simd::SimdLevel;
use skep::{Error, Options, Scale};

#[test]
fn the_presets_are_in_order_and_found_by_name() {
    for name in Options::PRESETS {
        assert_eq!(Options::preset(name).unwrap().check(), Ok(()), "{name}");
    }
    assert_eq!(Options::preset("paper").unwrap(), Options::paper());
    assert_eq!(Options::preset("default").unwrap(), Options::default());
    assert_eq!(Options::preset("fast").unwrap(), Options::fast());
    let error = Options::preset("quick").unwrap_err().to_string();
    assert!(error.contains("quick") && error.contains("default, fast, paper"), "{error}");
}

/// A change that makes an option invalid, and the option's name and the value in the error.
type Spoiled = (fn(&mut Options), &'static str, &'static str);

fn last_scale(options: &mut Options) -> &mut Scale {
    options.schedule.scales.last_mut().unwrap()
}

#[test]
fn an_option_out_of_range_is_named_with_its_value() {
    let spoiled: Vec<Spoiled> = vec![
        (|o| o.schedule.scales.clear(), "schedule.scales: downscale", "[]"),
        (|o| last_scale(o).food_sources = 1, "schedule.scales: food_sources", "1"),
        (|o| last_scale(o).first_iterations = 1_000_000, "schedule.scales: first_iterations", "1000000"),
        (|o| last_scale(o).cycles = 1_000_000, "schedule.scales: cycles", "1000000"),
        (|o| last_scale(o).cycle_iterations = 1_000_000, "schedule.scales: cycle_iterations", "1000000"),
        (|o| o.schedule.min_changed_fraction = 1.5, "schedule.min_changed_fraction", "1.5"),
        (|o| o.threads = 5000, "threads", "5000"),
        (|o| o.window.window_radius = 0, "window.window_radius", "0"),
        (|o| o.window.window_radius = u32::MAX, "window.window_radius", "4294967295"),
        (|o| o.window.full_size_window_radius = 17, "window.full_size_window_radius", "17"),
        (|o| o.window.window_step = 0, "window.window_step", "0"),
        (|o| o.window.sigma_spatial = 0.0, "window.sigma_spatial", "0"),
        (|o| o.window.sigma_color = -1.0, "window.sigma_color", "-1"),
        (|o| o.window.min_variance = f64::NAN, "window.min_variance", "NaN"),
        (|o| o.window.min_texture_to_noise = -0.5, "window.min_texture_to_noise", "-0.5"),
        (|o| o.cost.best_views = 9, "cost.best_views", "9"),
        (|o| o.cost.max_views_per_pixel = 1, "cost.max_views_per_pixel", "1"),
        (|o| o.cost.geom_consistency_weight = -1.0, "cost.geom_consistency_weight", "-1"),
        (|o| o.cost.geom_consistency_max_error = f64::NAN, "cost.geom_consistency_max_error", "NaN"),
        (|o| o.cost.geom_consistency_missing_error = -2.0, "cost.geom_consistency_missing_error", "-2"),
        (|o| o.cost.smoothness_weight = -0.1, "cost.smoothness_weight", "-0.1"),
        (|o| o.cost.smoothness_max_depth_error = 0.0, "cost.smoothness_max_depth_error", "0"),
        (|o| o.cost.smoothness_max_normal_error = 200.0, "cost.smoothness_max_normal_error", "200"),
        (|o| o.search.smoothness_reward = f64::INFINITY, "search.smoothness_reward", "inf"),
        (|o| o.view_selection.min_triangulation_angle = -1.0, "view_selection.min_triangulation_angle", "-1"),
        (|o| o.view_selection.max_triangulation_angle = 2.0, "view_selection.max_triangulation_angle", "2"),
        (|o| o.view_selection.max_incident_angle = 91.0, "view_selection.max_incident_angle", "91"),
        (|o| o.view_selection.occlusion_tolerance = -0.1, "view_selection.occlusion_tolerance", "-0.1"),
        (|o| o.check.min_consistent_views = 0, "check.min_consistent_views", "0"),
        (|o| o.check.depth_tolerance = f64::NAN, "check.depth_tolerance", "NaN"),
        (|o| o.check.normal_tolerance = 181.0, "check.normal_tolerance", "181"),
        (|o| o.check.min_consistent_fraction = 70.0, "check.min_consistent_fraction", "70"),
        (|o| o.refine.smoothing_passes = 1000, "refine.smoothing_passes", "1000"),
        (|o| o.fusion.depth_tolerance = 2.0, "fusion.depth_tolerance", "2"),
        (|o| o.fusion.normal_tolerance = -3.0, "fusion.normal_tolerance", "-3"),
    ];
    for (spoil, option, spoiled_value) in spoiled {
        let mut options = Options::default();
        spoil(&mut options);
        let Err(Error::Argument { name, value, expected }) = options.check() else {
            panic!("{option} {spoiled_value} is accepted");
        };
        assert_eq!((name, value.as_str()), (format!("options.{option}"), spoiled_value));
        assert!(!expected.is_empty());
    }
}

#[test]
fn scales_must_double_from_one_to_the_next_up_to_full_size() {
    let check = |downscales: &[u32]| {
        let mut options = Options::paper();
        let scale = options.schedule.scales[0];
        options.schedule.scales = downscales.iter().map(|&downscale| Scale { downscale, ..scale }).collect();
        options.check()
    };
    for downscales in [&[1][..], &[2, 1], &[4, 2, 1]] {
        assert_eq!(check(downscales), Ok(()));
    }
    for downscales in
        [&[2][..], &[1, 2], &[4, 1], &[1, 1], &[3, 1], &[512, 256, 128, 64, 32, 16, 8, 4, 2, 1], &[0, 0, 1]]
    {
        let error = check(downscales).unwrap_err().to_string();
        assert!(error.starts_with("options.schedule.scales"), "{error}");
    }
}

#[test]
fn every_option_is_listed_and_shows_its_change() {
    let changes: [fn(&mut Options); 6] = [
        |o| o.seed = 77,
        |o| o.simd = Some(SimdLevel::Scalar),
        |o| o.cost.best_views = 7,
        |o| o.schedule.scales[0].food_sources = 33,
        |o| o.check.ignore_occluders = !o.check.ignore_occluders,
        |o| o.fusion.min_agreeing_views = 17,
    ];
    let before: Vec<_> = Options::default().values().collect();
    for change in changes {
        let mut options = Options::default();
        change(&mut options);
        let changed = options.values().zip(&before).filter(|(after, before)| after != *before).count();
        assert_eq!(changed, 1, "{options:?}");
    }
    let mut names: Vec<&str> = before.iter().map(|entry| entry.0).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), before.len());
}
