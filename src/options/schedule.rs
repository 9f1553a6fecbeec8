//! The schedule: the scales of a run, coarse to fine, and its text form.

use super::Options;
use super::value::Kind;
use crate::error::{Error, Result};
use std::fmt;

/// The search on one scale of the image pyramid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scale {
    /// Factor by which the images are reduced: a power of two, 1 to 256.
    pub downscale: u32,
    /// Food sources of each colony (FoodNumber of the paper), 2 to 64.
    pub food_sources: u32,
    /// Iterations of the first cycle on this scale, 0 to 10,000; each is one pass of employed, onlooker and
    /// scout bees.
    pub first_iterations: u32,
    /// Cycles after the first, 0 to 1,000; a geometric consistency check follows every cycle.
    pub cycles: u32,
    /// Iterations of each of those cycles, 0 to 10,000.
    pub cycle_iterations: u32,
}

/// The schedule of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ScheduleOptions {
    /// The scales from coarse to fine, each twice as large as the one before; the last is full size.
    ///
    /// Their text form, wherever options are texts: `downscale=2 food_sources=3 iterations=5+4x1; downscale=1
    /// food_sources=2 iterations=1+2x1` is half size with 3 food sources a pixel, 5 iterations in the first
    /// cycle and 4 more cycles of 1, then full size.
    pub scales: Vec<Scale>,
    /// From the second cycle of a scale on, the scale ends early once fewer than this fraction of the pixels
    /// changed their depth.
    ///
    /// fraction of the pixels; 0 to 1
    pub min_changed_fraction: f64,
}

/// The text form of scales, for error texts.
const FORM: &str =
    "scales like `downscale=2 food_sources=3 iterations=5+4x1`, separated by `;`, from coarse to fine";

impl fmt::Display for Scale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Scale { downscale, food_sources, first_iterations, cycles, cycle_iterations } = self;
        write!(f, "downscale={downscale} food_sources={food_sources} ")?;
        write!(f, "iterations={first_iterations}+{cycles}x{cycle_iterations}")
    }
}

/// The text form of scales.
pub(super) fn scales_to_text(scales: &[Scale]) -> String {
    scales.iter().map(Scale::to_string).collect::<Vec<_>>().join("; ")
}

/// The scales of a text.
pub(super) fn scales_from_text(text: &str) -> Result<Vec<Scale>> {
    let scales = text.split(';').map(|part| scale_from_text(part).ok_or(part.trim()));
    let scales = scales.collect::<std::result::Result<Vec<Scale>, &str>>();
    scales.map_err(|part| Error::argument("options.schedule.scales", format!("`{part}`"), FORM))
}

fn scale_from_text(text: &str) -> Option<Scale> {
    let (mut downscale, mut food_sources, mut iterations) = (None, None, None);
    for word in text.split_whitespace() {
        let (name, value) = word.split_once('=')?;
        let place = match name {
            "downscale" => &mut downscale,
            "food_sources" => &mut food_sources,
            "iterations" => &mut iterations,
            _ => return None,
        };
        if place.replace(value).is_some() {
            return None;
        }
    }
    let (first, rest) = iterations?.split_once('+')?;
    let (cycles, each) = rest.split_once('x')?;
    Some(Scale {
        downscale: downscale?.parse().ok()?,
        food_sources: food_sources?.parse().ok()?,
        first_iterations: first.parse().ok()?,
        cycles: cycles.parse().ok()?,
        cycle_iterations: each.parse().ok()?,
    })
}

impl Options {
    /// Checks the scales and their order.
    pub(super) fn check_scales(&self) -> Result<()> {
        let scales = &self.schedule.scales;
        let descending =
            scales.windows(2).all(|pair| Some(pair[0].downscale) == pair[1].downscale.checked_mul(2));
        if !descending || scales.last().is_none_or(|last| last.downscale != 1) {
            let found: Vec<u32> = scales.iter().map(|scale| scale.downscale).collect();
            let expected = "each half of the one before, the last 1";
            return Err(Error::argument(
                "options.schedule.scales: downscale",
                format!("{found:?}"),
                expected,
            ));
        }
        for scale in scales {
            for (name, value, min, max) in [
                ("downscale", scale.downscale, 1, 256),
                ("food_sources", scale.food_sources, 2, 64),
                ("first_iterations", scale.first_iterations, 0, 10_000),
                ("cycles", scale.cycles, 0, 1_000),
                ("cycle_iterations", scale.cycle_iterations, 0, 10_000),
            ] {
                Kind::Count { min, max }.check(&format!("schedule.scales: {name}"), f64::from(value))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scales_of_every_preset_are_read_back_from_their_text() {
        for name in Options::PRESETS {
            let scales = Options::preset(name).unwrap().schedule.scales;
            assert_eq!(scales_from_text(&scales_to_text(&scales)), Ok(scales));
        }
        let spaced =
            "  iterations=5+4x1 downscale=2   food_sources=3;downscale=1 food_sources=2 iterations=1+2x1 ";
        assert_eq!(scales_from_text(spaced), Ok(Options::default().schedule.scales));
    }

    #[test]
    fn an_invalid_schedule_is_refused_and_the_error_names_the_invalid_part() {
        let full = "downscale=1 food_sources=2 iterations=1+2x1";
        for part in [
            "",
            "2:3:5+4x1",
            "downscale=2",
            "downscale=2 food_sources=3 iterations=5",
            "downscale=2 food_sources=3 iterations=5+4",
            "downscale=2 food_sources=-3 iterations=5+4x1",
            "downscale=2 downscale=2 food_sources=3 iterations=5+4x1",
            "downscale=2 food_sources=3 iterations=5+4x1 color=3",
        ] {
            let error = scales_from_text(&format!("{part}; {full}")).unwrap_err().to_string();
            assert!(error.contains(&format!("`{part}`")) && error.contains("food_sources=3"), "{error}");
        }
    }
}
