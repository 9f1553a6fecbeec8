//! The order of the cycles of a run.

use crate::options::{Options, Scale};
use crate::pipeline::{Phase, Progress};
use crate::scene::Scene;

/// One cycle on one scale: every view is searched, then all views are checked against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// Place of the scale among the options' scales.
    pub scale_index: usize,
    /// The scale.
    pub scale: Scale,
    /// The cycle on it, counted from 0.
    pub cycle: u32,
}

impl Cycle {
    /// All stepper of a run in order.
    pub(super) fn all(options: &Options) -> Vec<Cycle> {
        let mut stepper = Vec::new();
        for (scale_index, &scale) in options.schedule.scales.iter().enumerate() {
            stepper.extend((0..=scale.cycles).map(|cycle| Cycle { scale_index, scale, cycle }));
        }
        stepper
    }

    /// Rounds of bees.
    pub fn iterations(&self) -> u32 {
        if self.cycle == 0 { self.scale.first_iterations } else { self.scale.cycle_iterations }
    }

    /// How many times smaller than full size a side of its images is.
    pub fn downscale(&self) -> u32 {
        self.scale.downscale
    }

    /// Units of work of searching all views.
    pub(super) fn work(&self, scene: &Scene) -> u64 {
        let pixels: u64 = scene.views().iter().map(|view| view.camera.pixels() as u64).sum();
        self.work_on(pixels / u64::from(self.scale.downscale).pow(2))
    }

    /// Units of work of searching this many pixels: a pass over a pixel counts its food sources.
    pub(super) fn work_on(&self, pixels: u64) -> u64 {
        let passes = 1 + 2 * u64::from(self.iterations());
        pixels * passes * u64::from(self.scale.food_sources)
    }

    /// Where the run stands when it does this to a view.
    pub(super) fn progress(&self, phase: Phase, view: usize, views: usize) -> Progress {
        Progress { phase, downscale: self.downscale(), cycle: self.cycle, view, views, done: 0.0 }
    }
}
