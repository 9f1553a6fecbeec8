//! What all stepper of a run share, and the order they are taken in.

use super::cycle::Cycle;
use super::estimate::ViewEstimate;
use crate::error::{Error, Result};
use crate::matching::Window;
use crate::options::Options;
use crate::pipeline::Cancelled;
use crate::scene::ScaledView;
use crate::scene::Scene;
use crate::simd::SimdLevel;
use crate::view_selection::{SourceLists, source_lists};
use rayon::prelude::*;

/// A run taken apart, for hosts that schedule views themselves, on this machine or on many, or bring maps of their own.
///
/// A run is, for each cycle from [`Stepper::all`]: [`propagate`](Stepper::propagate) and [`search`](Stepper::search) every
/// view from the estimates the cycle before left; [`check`](Stepper::check) every view against what all have just found and
/// [`mark`](Stepper::mark) it; ask [`next`](Stepper::next) for the next cycle, and [`upsample`](Stepper::upsample) the estimates
/// when it is on a finer scale. After the last, [`finish`](Stepper::finish) every view and fuse. Done so for all views,
/// that gives the same bits as [`reconstruct`](crate::reconstruct).
///
/// The estimates of other views are passed as one entry for each view of the scene. Only the view itself, its sources and
/// the views it is a source of are looked at; `None` says that nothing is known of a view.
///
/// Nothing here changes after it is made: stepper of different views may be taken at the same time from several threads.
/// They run on the rayon pool they are called on.
pub struct Stepper {
    pub(super) options: Options,
    pub(super) level: SimdLevel,
    /// By scale.
    windows: Vec<Window>,
    pub(super) sources: SourceLists,
    stepper: Vec<Cycle>,
    /// By scale and view.
    scaled: Vec<Vec<ScaledView>>,
}

impl Stepper {
    /// Prepares the images of all scales, and chooses the source views.
    ///
    /// # Errors
    /// An option out of its range, named.
    pub fn new(scene: &Scene, options: &Options) -> Result<Stepper> {
        Stepper::new_with(scene, options, &|| false)
    }

    /// [`Stepper::new`] that can be cancelled.
    pub(super) fn new_with(scene: &Scene, options: &Options, cancelled: Cancelled) -> Result<Stepper> {
        options.check()?;
        Ok(Stepper {
            options: options.clone(),
            level: options.simd.unwrap_or_else(SimdLevel::detect),
            windows: (0..options.schedule.scales.len()).map(|scale| window(options, scale)).collect(),
            sources: source_lists(scene, options),
            stepper: Cycle::all(options),
            scaled: (options.schedule.scales.iter())
                .map(|scale| {
                    let views = (0..scene.views().len()).into_par_iter();
                    let of = |view| match cancelled() {
                        true => Err(Error::Cancelled),
                        false => Ok(ScaledView::of(scene, view, scale.downscale)),
                    };
                    views.map(of).collect()
                })
                .collect::<Result<_>>()?,
        })
    }

    /// The stepper in order.
    pub fn all(&self) -> &[Cycle] {
        &self.stepper
    }

    /// Number of views.
    pub fn views(&self) -> usize {
        self.sources.lists.len()
    }

    /// The source views of a view, which its view sets count along.
    pub fn sources(&self, view: usize) -> &[u32] {
        &self.sources.lists[view]
    }

    /// What the host's user should know about the choice of source views, in sentences.
    pub fn warnings(&self) -> &[String] {
        &self.sources.warnings
    }

    /// The window of the patches on the scale of a cycle.
    pub(super) fn window(&self, cycle: usize) -> &Window {
        &self.windows[self.stepper[cycle].scale_index]
    }

    /// A view on the scale of a cycle.
    pub(super) fn scaled(&self, cycle: usize, view: usize) -> &ScaledView {
        &self.scaled[self.stepper[cycle].scale_index][view]
    }

    /// Width and height of a view's maps at a cycle.
    ///
    /// # Errors
    /// A cycle or view there is not.
    pub fn size(&self, cycle: usize, view: usize) -> Result<(u32, u32)> {
        self.check_place(cycle, view)?;
        let camera = &self.scaled(cycle, view).camera;
        Ok((camera.width, camera.height))
    }

    /// The cycle to take after this one was taken for all views and they were marked; `None` after the last. A scale
    /// ends early once few enough of the pixels of the given estimates changed ([`Options::stop_share`]).
    ///
    /// # Errors
    /// A cycle there is not; estimates that were not marked in it.
    pub fn next(&self, cycle: usize, estimates: &[Option<&ViewEstimate>]) -> Result<Option<usize>> {
        self.check_states(cycle, 0, estimates)?;
        let (mut changed, mut pixels) = (0, 0);
        for (view, estimate) in estimates.iter().enumerate() {
            let Some(estimate) = estimate else { continue };
            estimate.require_marked(&format!("estimates[{view}]"), true)?;
            let record = estimate.cycles().last();
            changed += record.map_or(0, |record| record.changed);
            pixels += record.map_or(0, |record| record.pixels);
        }
        let settled = (changed as f64 / pixels.max(1) as f64) < self.options.schedule.min_changed_fraction;
        let is_next = |&other: &usize| {
            let ends = self.stepper[cycle].cycle > 0 && settled;
            !(ends && self.stepper[other].scale_index == self.stepper[cycle].scale_index)
        };
        Ok((cycle + 1..self.stepper.len()).find(is_next))
    }

    pub(super) fn check_place(&self, cycle: usize, view: usize) -> Result<()> {
        if cycle >= self.stepper.len() {
            let expected = format!("a cycle below their number, {}", self.stepper.len());
            return Err(Error::argument("cycle", cycle, expected));
        }
        if view >= self.views() {
            let expected = format!("a view below their number, {}", self.views());
            return Err(Error::argument("view", view, expected));
        }
        Ok(())
    }

    /// Refuses estimates of other views or scales than they stand for.
    pub(super) fn check_states(
        &self,
        cycle: usize,
        view: usize,
        estimates: &[Option<&ViewEstimate>],
    ) -> Result<()> {
        self.check_place(cycle, view)?;
        if !estimates.is_empty() && estimates.len() != self.views() {
            let expected = format!("one entry for each of the {} views, or none at all", self.views());
            return Err(Error::argument("estimates", format!("{} entries", estimates.len()), expected));
        }
        for (place, estimate) in estimates.iter().enumerate() {
            let Some(estimate) = estimate else { continue };
            if estimate.view() != place {
                let value = format!("the estimate of view {}", estimate.view());
                return Err(Error::argument(
                    format!("estimates[{place}]"),
                    value,
                    format!("that of view {place}"),
                ));
            }
            self.check_scale(cycle, estimate, &format!("estimates[{place}]"))?;
        }
        Ok(())
    }

    fn check_scale(&self, cycle: usize, estimate: &ViewEstimate, name: &str) -> Result<()> {
        let (width, height) = self.size(cycle, estimate.view())?;
        let same_scale = self.stepper.get(estimate.cycle()).map(|cycle| cycle.scale_index)
            == Some(self.stepper[cycle].scale_index);
        if same_scale && estimate.fits(width, height, self.sources(estimate.view()).len()) {
            return Ok(());
        }
        let value = format!("a estimate after cycle {} of {} pixels", estimate.cycle(), estimate.pixels());
        let expected = format!(
            "one on the scale of cycle {cycle}, {width}x{height} pixels, of the same scene and options; estimates of the \
             next coarser scale are handed up first"
        );
        Err(Error::argument(name, value, expected))
    }

    /// Whether a estimate has to be handed up before it can take part in a cycle.
    pub(super) fn is_coarser(&self, estimate: &ViewEstimate, cycle: usize) -> bool {
        self.stepper[estimate.cycle()].scale_index < self.stepper[cycle].scale_index
    }

    /// A estimate on the next finer scale: each pixel gets the plane of its coarse pixel.
    ///
    /// # Errors
    /// A cycle or view there is not; a estimate of another view, or not of the scale before that of `cycle`.
    pub fn upsample(&self, cycle: usize, view: usize, estimate: &ViewEstimate) -> Result<ViewEstimate> {
        self.check_place(cycle, view)?;
        let scale = self.stepper[cycle].scale_index;
        let own = self.stepper.get(estimate.cycle()).map(|cycle| cycle.scale_index);
        let coarser = scale.checked_sub(1).filter(|coarser| own == Some(*coarser));
        let Some(coarser) = coarser else {
            let value = format!("a estimate after cycle {}", estimate.cycle());
            return Err(Error::argument(
                "estimate",
                value,
                format!("one on the scale before that of cycle {cycle}"),
            ));
        };
        let coarse_step = self.stepper.iter().position(|cycle| cycle.scale_index == coarser).unwrap_or(0);
        self.check_scale(coarse_step, estimate, "estimate")?;
        if estimate.view() != view {
            let value = format!("the estimate of view {}", estimate.view());
            return Err(Error::argument("estimate", value, format!("that of view {view}")));
        }
        estimate.require_marked("estimate", true)?;
        let fine = self.scaled(cycle, view);
        let upsampled = estimate.solved.refined(&self.scaled[coarser][view].camera, &fine.camera, fine.range);
        Ok(estimate.on_finer_scale(cycle, upsampled))
    }
}

/// The window of a scale. At full size a coarser scale has found the surfaces: a smaller window keeps to one of them at
/// edges.
fn window(options: &Options, scale: usize) -> Window {
    let is_finest = scale > 0
        && options.schedule.scales[scale].downscale == 1
        && options.window.full_size_window_radius > 0;
    let (radius, is_round) = match is_finest {
        true => (options.window.full_size_window_radius, false),
        false => (options.window.window_radius, options.window.circular_window),
    };
    let make = if is_round { Window::disc } else { Window::new };
    make(
        radius,
        options.window.window_step,
        options.window.sigma_spatial,
        options.window.sigma_color,
        options.window.min_variance,
    )
}
