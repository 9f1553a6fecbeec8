use super::*;

#[test]
fn every_number_is_set_and_read_back_by_its_own_name_and_no_other_changes() {
    for entry in numbers() {
        let before = Options::default();
        let mut options = before.clone();
        let now = (entry.get)(&before);
        let value = match entry.kind {
            Kind::Count { min, .. } => (now + 1.0).max(min as f64),
            Kind::Number { min, max } => (now + min.midpoint(max)) / 2.0,
            Kind::Switch => 1.0 - now,
            Kind::Text => unreachable!("numbers are no texts"),
        };
        options.set_number(entry.name(), value).unwrap();
        for other in numbers() {
            let expected = if other.name() == entry.name() { value } else { (other.get)(&before) };
            assert_eq!((other.get)(&options), expected, "{} after {}", other.name(), entry.name());
        }
    }
}

#[test]
fn every_option_is_read_back_from_its_text() {
    for preset in Options::PRESETS {
        let options = Options { seed: 77, threads: 3, ..Options::preset(preset).unwrap() };
        let mut copy = Options::paper();
        options.values().for_each(|(name, value)| copy.set(name, &value.to_string()).unwrap());
        assert_eq!(copy, options, "{preset}");
    }
}

#[test]
fn a_unique_name_needs_no_group() {
    assert_eq!(Options::info("window_radius").unwrap().name, "window.window_radius");
    let error = Options::info("depth_tolerance").unwrap_err().to_string();
    assert!(error.contains("check.depth_tolerance, fusion.depth_tolerance"), "{error}");
    let similar = Options::info("tolerance").unwrap_err().to_string();
    assert!(similar.contains("check.depth_tolerance") && !similar.contains("window_radius"), "{similar}");
    let unknown = Options::info("nonsense").unwrap_err().to_string();
    assert!(unknown.contains("view_selection, ") && unknown.contains("`skep info`"), "{unknown}");
    assert!(!unknown.contains("window_radius") && unknown.len() < 250, "{unknown}");
}

#[test]
fn an_invalid_value_is_refused_and_the_error_states_the_valid_ones() {
    let mut options = Options::default();
    let message = |result: Result<()>| result.unwrap_err().to_string();
    assert_eq!(
        message(options.set_number("window_radius", 17.0)),
        "options.window.window_radius is 17; expected a whole number from 1 to 16"
    );
    assert_eq!(
        message(options.set("window_radius", "five")),
        "options.window.window_radius is `five`; expected a whole number from 1 to 16"
    );
    for (name, value) in [
        ("window_radius", 2.5),
        ("window_radius", f64::NAN),
        ("smoothness_reward", -0.1),
        ("smoothness_reward", f64::INFINITY),
        ("view_propagation", 2.0),
        ("threads", -1.0),
        ("seed", -1.0),
        ("simd", 1.0),
        ("scales", 1.0),
    ] {
        assert!(options.set_number(name, value).is_err(), "{name} {value}");
    }
    for (name, text) in
        [("seed", "-1"), ("simd", "v9"), ("scales", "downscale=2"), ("view_propagation", "maybe")]
    {
        assert!(options.set(name, text).is_err(), "{name} {text}");
    }
    assert_eq!(options, Options::default());
}

#[test]
fn every_option_is_explained_with_a_unit() {
    for info in Options::infos() {
        assert!(info.explanation.ends_with('.') && !info.unit.is_empty(), "{}", info.name);
        assert!(!info.explanation.contains("  "), "{}", info.explanation);
    }
}
