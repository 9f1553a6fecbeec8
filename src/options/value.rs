//! Options by name: their values, ranges and text forms.

use super::Options;
use crate::error::{Error, Result};
use std::ffi::CStr;
use std::fmt;

/// The value of an option.
#[derive(Debug, Clone, PartialEq)]
pub enum OptionValue {
    /// A whole number.
    Count(u64),
    /// Any number.
    Number(f64),
    /// On or off.
    Switch(bool),
    /// A word, or the text of a schedule.
    Text(String),
}

impl fmt::Display for OptionValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OptionValue::Count(value) => write!(f, "{value}"),
            OptionValue::Number(value) => write!(f, "{value}"),
            OptionValue::Switch(value) => write!(f, "{value}"),
            OptionValue::Text(value) => f.write_str(value),
        }
    }
}

/// Description of an option, for listings and documentation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OptionInfo {
    /// Its name with its group, such as `window.window_radius`.
    pub name: &'static str,
    /// One sentence on what it does.
    pub explanation: &'static str,
    /// The unit of its value.
    pub unit: &'static str,
    /// The values it takes.
    pub kind: Kind,
}

/// The values an option takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A whole number within these bounds.
    Count {
        /// The least.
        min: u64,
        /// The largest.
        max: u64,
    },
    /// A number within these bounds.
    Number {
        /// The least.
        min: f64,
        /// The largest.
        max: f64,
    },
    /// `true` or `false`, as a number 1 or 0.
    Switch,
    /// A text, which the explanation describes.
    Text,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Kind::Count { min, max } => write!(f, "a whole number from {min} to {max}"),
            Kind::Number { min, max } => write!(f, "a number from {min} to {max}"),
            Kind::Switch => f.write_str("true or false"),
            Kind::Text => f.write_str("a text"),
        }
    }
}

impl Kind {
    /// Returns an error for numbers of another kind or out of range; `name` is the option's name in the
    /// error.
    pub(super) fn check(self, name: &str, value: f64) -> Result<()> {
        let holds = match self {
            Kind::Count { min, max } => value.fract() == 0.0 && (min as f64..=max as f64).contains(&value),
            Kind::Number { min, max } => (min..=max).contains(&value),
            Kind::Switch => value == 0.0 || value == 1.0,
            Kind::Text => false,
        };
        if holds { Ok(()) } else { Err(Error::argument(format!("options.{name}"), value, self.to_string())) }
    }
}

/// A line of the table: an option that is a number or a switch.
pub(super) struct Entry {
    pub c_name: &'static CStr,
    pub explanation: &'static str,
    pub unit: &'static str,
    pub kind: Kind,
    pub get: fn(&Options) -> f64,
    pub set: fn(&mut Options, f64),
}

impl Entry {
    pub(super) fn name(&self) -> &'static str {
        self.c_name.to_str().unwrap_or_default()
    }

    pub(super) fn value(&self, options: &Options) -> OptionValue {
        let value = (self.get)(options);
        match self.kind {
            Kind::Count { .. } => OptionValue::Count(value as u64),
            Kind::Number { .. } | Kind::Text => OptionValue::Number(value),
            Kind::Switch => OptionValue::Switch(value != 0.0),
        }
    }

    pub(super) fn info(&self) -> OptionInfo {
        OptionInfo {
            name: self.name(),
            explanation: self.explanation.trim_start(),
            unit: self.unit,
            kind: self.kind,
        }
    }
}
