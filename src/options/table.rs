//! Every option that is a number, by name: for checks, listings and hosts that set options by name.

use super::{Aggregation, Options};
use crate::error::{Error, Result};
use std::ffi::CStr;

/// What values an option takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// Whole numbers from the first to the second.
    Whole(u32, u32),
    /// Numbers from the first to the second.
    Number(f64, f64),
    /// 0 or 1.
    Switch,
}

/// An option.
pub(super) struct Entry {
    c_name: &'static CStr,
    pub kind: Kind,
    pub get: fn(&Options) -> f64,
    set: fn(&mut Options, f64),
}

/// A row of the table for a field that an `as` cast or a comparison with 0 turns into a number and back.
macro_rules! entry {
    (whole $name:literal, $min:expr, $max:expr, $($field:ident).+ as $type:ty) => {
        Entry {
            c_name: $name,
            kind: Kind::Whole($min, $max),
            get: |options| options.$($field).+ as f64,
            set: |options, value| options.$($field).+ = value as $type,
        }
    };
    (number $name:literal, $min:expr, $max:expr, $($field:tt).+) => {
        Entry {
            c_name: $name,
            kind: Kind::Number($min, $max),
            get: |options| options.$($field).+,
            set: |options, value| options.$($field).+ = value,
        }
    };
    (switch $name:literal, $field:ident) => {
        Entry {
            c_name: $name,
            kind: Kind::Switch,
            get: |options| f64::from(u8::from(options.$field)),
            set: |options, value| options.$field = value != 0.0,
        }
    };
}

/// The table, in the order of the fields of [`Options`].
pub(super) const TABLE: &[Entry] = &[
    entry!(whole c"threads", 0, 4096, threads as usize),
    entry!(whole c"trial_limit", 0, u32::MAX, trial_limit as u32),
    entry!(number c"stop_share", 0.0, 1.0, stop_share),
    entry!(whole c"window_radius", 1, 16, window_radius as u32),
    entry!(whole c"finest_window_radius", 0, 16, finest_window_radius as u32),
    entry!(whole c"window_step", 1, 8, window_step as u32),
    entry!(switch c"round_window", round_window),
    entry!(number c"spatial_sigma", 1e-3, 1e6, spatial_sigma),
    entry!(number c"colour_sigma", 1e-3, 1e6, colour_sigma),
    entry!(number c"min_variance", 0.0, 1.0, min_variance),
    entry!(number c"noise_ratio", 0.0, 1e3, noise_ratio),
    Entry {
        c_name: c"best_views",
        kind: Kind::Whole(0, 8),
        get: |options| match options.aggregation {
            Aggregation::AllViews => 0.0,
            Aggregation::BestViews(views) => f64::from(views),
        },
        set: |options, value| {
            options.aggregation = match value as u32 {
                0 => Aggregation::AllViews,
                views => Aggregation::BestViews(views),
            }
        },
    },
    entry!(whole c"focused_views", 0, u32::MAX, focused_views as u32),
    entry!(number c"restart_spread", 0.0, 0.5, restart_spread),
    entry!(number c"restart_tilt", 0.0, 10.0, restart_tilt),
    entry!(number c"smoothness", 0.0, 1e3, smoothness),
    entry!(number c"smoothness_depth", 1e-6, 1.0, smoothness_depth),
    entry!(number c"smoothness_normal", 1e-3, 180.0, smoothness_normal),
    entry!(whole c"employed_foods", 0, 64, employed_foods as u32),
    entry!(whole c"neighbours_drawn", 1, 20, neighbours_drawn as u32),
    entry!(number c"plane_fit", 0.0, 1.0, plane_fit),
    entry!(whole c"edge_passes", 0, 100, edge_passes as u32),
    entry!(whole c"smoothing_passes", 0, 100, smoothing_passes as u32),
    entry!(switch c"average_views", average_views),
    entry!(switch c"close_gaps", close_gaps),
    entry!(switch c"view_selection", view_selection),
    entry!(number c"triangulation_angle.min", 0.0, 180.0, triangulation_angle.0),
    entry!(number c"triangulation_angle.max", 0.0, 180.0, triangulation_angle.1),
    entry!(whole c"max_sources", 0, u32::MAX, max_sources as u32),
    entry!(number c"max_incident_angle", 0.0, 90.0, max_incident_angle),
    entry!(number c"occlusion_margin", 0.0, 1.0, occlusion_margin),
    entry!(number c"reward", 0.0, 1.0, reward),
    entry!(switch c"propagation", propagation),
    entry!(number c"geometric_weight", 0.0, 1e3, geometric_weight),
    entry!(number c"geometric_limit", 1e-3, 1e3, geometric_limit),
    entry!(number c"geometric_unknown", 0.0, 1e3, geometric_unknown),
    entry!(number c"depth_tolerance", 0.0, 1.0, depth_tolerance),
    entry!(number c"normal_tolerance", 0.0, 180.0, normal_tolerance),
    entry!(whole c"min_consistent", 1, u32::MAX, min_consistent as u32),
    entry!(number c"consistent_share", 0.0, 1.0, consistent_share),
    entry!(switch c"occluders_abstain", occluders_abstain),
    entry!(number c"fusion.depth_tolerance", 0.0, 1.0, fusion.depth_tolerance),
    entry!(number c"fusion.normal_tolerance", 0.0, 180.0, fusion.normal_tolerance),
    entry!(whole c"fusion.min_views", 0, u32::MAX, fusion.min_views as u32),
];

impl Entry {
    pub fn name(&self) -> &'static str {
        self.c_name.to_str().unwrap_or_default()
    }
}

impl Kind {
    /// Refuses values of another kind or out of range; `name` is how the error calls the option.
    pub fn check(self, name: &str, value: f64) -> Result<()> {
        let (holds, expected) = match self {
            Kind::Whole(min, max) => (
                value.fract() == 0.0 && (f64::from(min)..=f64::from(max)).contains(&value),
                format!("a whole number from {min} to {max}"),
            ),
            Kind::Number(min, max) => ((min..=max).contains(&value), format!("a number from {min} to {max}")),
            Kind::Switch => (value == 0.0 || value == 1.0, "0 or 1".to_owned()),
        };
        if holds { Ok(()) } else { Err(Error::argument(format!("options.{name}"), value, expected)) }
    }
}

impl Options {
    /// The names of the options that are numbers, in the order of the fields. `.min` and `.max` stand for the ends of
    /// a range, `best_views` is the number of [`Aggregation::BestViews`] or 0 for [`Aggregation::AllViews`], and
    /// switches are 0 or 1. The seed, the scales and the instruction set are not numbers in this sense.
    pub fn names() -> impl ExactSizeIterator<Item = &'static str> {
        TABLE.iter().map(Entry::name)
    }

    /// The name with this index in [`Options::names`], as C has it.
    #[cfg(feature = "capi")]
    pub(crate) fn c_name(index: usize) -> Option<&'static CStr> {
        TABLE.get(index).map(|entry| entry.c_name)
    }

    /// The option of this name.
    ///
    /// # Errors
    /// No option of this name.
    pub fn get(&self, name: &str) -> Result<f64> {
        Ok((find(name)?.get)(self))
    }

    /// Sets the option of this name.
    ///
    /// # Errors
    /// No option of this name; a value out of its range. Nothing is changed then.
    pub fn set(&mut self, name: &str, value: f64) -> Result<()> {
        let entry = find(name)?;
        entry.kind.check(name, value)?;
        (entry.set)(self, value);
        Ok(())
    }
}

fn find(name: &str) -> Result<&'static Entry> {
    let found = TABLE.iter().find(|entry| entry.name() == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = Options::names().collect();
        Error::argument("option", name, format!("one of {}", names.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_set_and_read_back_by_its_own_name_and_no_other_changes() {
        for entry in TABLE {
            let before = Options::default();
            let mut options = before.clone();
            let value = match entry.kind {
                Kind::Whole(min, _) => (before.get(entry.name()).unwrap() + 1.0).max(f64::from(min)),
                Kind::Number(min, max) => (before.get(entry.name()).unwrap() + min.midpoint(max)) / 2.0,
                Kind::Switch => 1.0 - before.get(entry.name()).unwrap(),
            };
            options.set(entry.name(), value).unwrap();
            for other in Options::names() {
                let expected = if other == entry.name() { value } else { before.get(other).unwrap() };
                assert_eq!(options.get(other).unwrap(), expected, "{other} after {}", entry.name());
            }
        }
    }

    #[test]
    fn a_wrong_name_or_value_is_refused_with_what_would_be_right() {
        let mut options = Options::default();
        let message = |result: Result<()>| result.unwrap_err().to_string();
        assert!(message(options.set("window", 3.0)).contains("window_radius"));
        assert_eq!(
            message(options.set("window_radius", 17.0)),
            "options.window_radius is 17; expected a whole number from 1 to 16"
        );
        for (name, value) in [
            ("window_radius", 2.5),
            ("window_radius", f64::NAN),
            ("reward", -0.1),
            ("reward", f64::INFINITY),
            ("propagation", 2.0),
            ("threads", -1.0),
        ] {
            assert!(options.set(name, value).is_err(), "{name} {value}");
        }
        assert_eq!(options, Options::default());
    }
}
