//! Options that no run can be made with are refused by name.

use skep::simd::Level;
use skep::{Aggregation, Error, FusionOptions, Options, Scale};

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

/// What spoils an option, and the option's name and the value in the error.
type Spoiled = (fn(&mut Options), &'static str, &'static str);

#[test]
fn an_option_out_of_range_is_named_with_its_value() {
    let spoiled: Vec<Spoiled> = vec![
        (|o| o.scales.clear(), "scales", "[]"),
        (|o| o.scales.last_mut().unwrap().foods = 1, "scales.foods", "1"),
        (|o| o.scales.last_mut().unwrap().first_iterations = 1_000_000, "scales.first_iterations", "1000000"),
        (|o| o.scales.last_mut().unwrap().cycles = 1_000_000, "scales.cycles", "1000000"),
        (|o| o.scales.last_mut().unwrap().cycle_iterations = 1_000_000, "scales.cycle_iterations", "1000000"),
        (|o| o.window_radius = 0, "window_radius", "0"),
        (|o| o.window_radius = u32::MAX, "window_radius", "4294967295"),
        (|o| o.finest_window_radius = 17, "finest_window_radius", "17"),
        (|o| o.window_step = 0, "window_step", "0"),
        (|o| o.min_consistent = 0, "min_consistent", "0"),
        (|o| o.aggregation = Aggregation::BestViews(0), "best_views", "0"),
        (|o| o.aggregation = Aggregation::BestViews(9), "best_views", "9"),
        (|o| o.focused_views = 1, "focused_views", "1"),
        (|o| o.stop_share = 1.5, "stop_share", "1.5"),
        (|o| o.spatial_sigma = 0.0, "spatial_sigma", "0"),
        (|o| o.colour_sigma = -1.0, "colour_sigma", "-1"),
        (|o| o.min_variance = f64::NAN, "min_variance", "NaN"),
        (|o| o.noise_ratio = -0.5, "noise_ratio", "-0.5"),
        (|o| o.smoothing_passes = 1000, "smoothing_passes", "1000"),
        (|o| o.triangulation_angle.0 = -1.0, "triangulation_angle.min", "-1"),
        (|o| o.triangulation_angle = (20.0, 10.0), "triangulation_angle.max", "10"),
        (|o| o.max_incident_angle = 91.0, "max_incident_angle", "91"),
        (|o| o.occlusion_margin = -0.1, "occlusion_margin", "-0.1"),
        (|o| o.smoothness = -0.1, "smoothness", "-0.1"),
        (|o| o.smoothness_depth = 0.0, "smoothness_depth", "0"),
        (|o| o.smoothness_normal = 200.0, "smoothness_normal", "200"),
        (|o| o.reward = f64::INFINITY, "reward", "inf"),
        (|o| o.geometric_weight = -1.0, "geometric_weight", "-1"),
        (|o| o.geometric_limit = f64::NAN, "geometric_limit", "NaN"),
        (|o| o.geometric_unknown = -2.0, "geometric_unknown", "-2"),
        (|o| o.depth_tolerance = f64::NAN, "depth_tolerance", "NaN"),
        (|o| o.normal_tolerance = 181.0, "normal_tolerance", "181"),
        (|o| o.consistent_share = 70.0, "consistent_share", "70"),
        (|o| o.fusion.depth_tolerance = 2.0, "fusion.depth_tolerance", "2"),
        (|o| o.fusion.normal_tolerance = -3.0, "fusion.normal_tolerance", "-3"),
    ];
    for (spoil, option, spoiled_value) in spoiled {
        let mut options = Options::default();
        spoil(&mut options);
        let Err(Error::Argument { name, value, expected }) = options.check() else {
            panic!("{option} {spoiled_value} is taken");
        };
        assert_eq!((name, value.as_str()), (format!("options.{option}"), spoiled_value));
        assert!(!expected.is_empty());
    }
}

#[test]
fn scales_must_descend_one_by_one_to_full_size() {
    let with = |halvings: &[u32]| {
        let scale = |&halvings| Scale { halvings, ..Options::paper().scales[0] };
        Options { scales: halvings.iter().map(scale).collect(), ..Options::default() }.check()
    };
    for halvings in [&[0][..], &[1, 0], &[2, 1, 0]] {
        assert_eq!(with(halvings), Ok(()));
    }
    for halvings in [&[1][..], &[0, 1], &[2, 0], &[0, 0], &[9, 8, 7, 6, 5, 4, 3, 2, 1, 0], &[u32::MAX, 0]] {
        let error = with(halvings).unwrap_err().to_string();
        assert!(error.starts_with("options.scales"), "{error}");
    }
}

#[test]
fn every_option_is_listed_and_shows_its_change() {
    let changes: [fn(&mut Options); 6] = [
        |o| o.seed = 77,
        |o| o.simd = Some(Level::Scalar),
        |o| o.aggregation = Aggregation::BestViews(7),
        |o| o.scales[0].foods = 33,
        |o| o.occluders_abstain = !o.occluders_abstain,
        |o| o.fusion = FusionOptions { min_views: 17, ..o.fusion },
    ];
    let before = Options::default().entries();
    for change in changes {
        let mut options = Options::default();
        change(&mut options);
        let after = options.entries();
        let changed = before.iter().zip(&after).filter(|(before, after)| before != after).count();
        assert_eq!(changed, 1, "{after:?}");
    }
    let mut names: Vec<&str> = before.iter().map(|entry| entry.0).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), before.len());
}
