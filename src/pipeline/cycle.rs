//! The order of the cycles of a run.

use crate::options::{Options, Scale};

/// One cycle on one scale: every view is searched, then all views are checked against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// Index of the scale among the options' scales.
    pub scale_index: usize,
    /// The scale.
    pub scale: Scale,
    /// The cycle on that scale, counted from 0.
    pub cycle: u32,
}

impl Cycle {
    /// All cycles of a run in order.
    pub(super) fn all(options: &Options) -> Vec<Cycle> {
        let mut cycles = Vec::new();
        for (scale_index, &scale) in options.schedule.scales.iter().enumerate() {
            cycles.extend((0..=scale.cycles).map(|cycle| Cycle { scale_index, scale, cycle }));
        }
        cycles
    }

    /// Iterations of employed, onlooker and scout bees.
    pub fn iterations(&self) -> u32 {
        if self.cycle == 0 { self.scale.first_iterations } else { self.scale.cycle_iterations }
    }

    /// Units of work of searching this many pixels: a unit is a food source that is filled or improved, those
    /// of both checkerboard colors together counted once. The time of a search is about proportional to it.
    pub fn work(&self, pixels: u64) -> u64 {
        let passes = 1 + 2 * u64::from(self.iterations());
        pixels.saturating_mul(passes * u64::from(self.scale.food_sources)) / 2
    }
}

/// A view in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    /// Index of the cycle in the run.
    pub cycle: usize,
    /// Index of the view in the scene.
    pub view: usize,
}

/// What one cycle did to one view.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub struct CycleRecord {
    /// Size of the images: 1 is full, 2 half, 4 a quarter.
    pub downscale: u32,
    /// The cycle on that scale, counted from 0.
    pub cycle: u32,
    /// Pixels with a plane after the search.
    pub pixels: u64,
    /// Pixels whose depth changed by more than a thousandth.
    pub changed: u64,
    /// Pixels validated by the check after it.
    pub validated: u64,
    /// Median distance between where planes project to and where the source views' own depths lie, in px of
    /// the cycle's scale: errors of the poses and of the matching. 0 before a check, or without planes.
    pub median_residual: f64,
}
