//! What all steps of a run share, and the order they are taken in.

use super::schedule::Step;
use super::state::State;
use crate::error::{Error, Result};
use crate::image::ScaledView;
use crate::kernels::Window;
use crate::options::Options;
use crate::progress::Cancelled;
use crate::scene::Scene;
use crate::simd::Level;
use crate::views::{SourceLists, source_lists};
use rayon::prelude::*;

/// A run taken apart, for hosts that schedule views themselves, on this machine or on many, or bring maps of their own.
///
/// A run is, for each step from [`Steps::all`]: [`propagate`](Steps::propagate) and [`search`](Steps::search) every
/// view from the states the step before left; [`check`](Steps::check) every view against what all have just found and
/// [`mark`](Steps::mark) it; ask [`next`](Steps::next) for the next step, and [`hand_up`](Steps::hand_up) the states
/// when it is on a finer scale. After the last, [`finish`](Steps::finish) every view and fuse. Done so for all views,
/// that gives the same bits as [`reconstruct`](crate::reconstruct).
///
/// The states of other views are passed as one entry for each view of the scene. Only the view itself, its sources and
/// the views it is a source of are looked at; `None` says that nothing is known of a view.
///
/// Nothing here changes after it is made: steps of different views may be taken at the same time from several threads.
/// They run on the rayon pool they are called on.
pub struct Steps {
    pub(super) options: Options,
    pub(super) level: Level,
    /// By scale.
    windows: Vec<Window>,
    pub(super) sources: SourceLists,
    steps: Vec<Step>,
    /// By scale and view.
    scaled: Vec<Vec<ScaledView>>,
}

impl Steps {
    /// Prepares the images of all scales, and chooses the source views.
    ///
    /// # Errors
    /// An option out of its range, named.
    pub fn new(scene: &Scene, options: &Options) -> Result<Steps> {
        Steps::new_with(scene, options, &|| false)
    }

    /// [`Steps::new`] that can be cancelled.
    pub(super) fn new_with(scene: &Scene, options: &Options, cancelled: Cancelled) -> Result<Steps> {
        options.check()?;
        Ok(Steps {
            options: options.clone(),
            level: options.simd.unwrap_or_else(Level::detect),
            windows: (0..options.scales.len()).map(|scale| window(options, scale)).collect(),
            sources: source_lists(scene, options),
            steps: Step::all(options),
            scaled: (options.scales.iter())
                .map(|scale| {
                    let views = (0..scene.views().len()).into_par_iter();
                    let of = |view| match cancelled() {
                        true => Err(Error::Cancelled),
                        false => Ok(ScaledView::of(scene, view, scale.halvings)),
                    };
                    views.map(of).collect()
                })
                .collect::<Result<_>>()?,
        })
    }

    /// The steps in order.
    pub fn all(&self) -> &[Step] {
        &self.steps
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

    /// The window of the patches on the scale of a step.
    pub(super) fn window(&self, step: usize) -> &Window {
        &self.windows[self.steps[step].scale_index]
    }

    /// A view on the scale of a step.
    pub(super) fn scaled(&self, step: usize, view: usize) -> &ScaledView {
        &self.scaled[self.steps[step].scale_index][view]
    }

    /// Width and height of a view's maps at a step.
    ///
    /// # Errors
    /// A step or view there is not.
    pub fn size(&self, step: usize, view: usize) -> Result<(u32, u32)> {
        self.check_place(step, view)?;
        let camera = &self.scaled(step, view).camera;
        Ok((camera.width, camera.height))
    }

    /// The step to take after this one was taken for all views and they were marked; `None` after the last. A scale
    /// ends early once few enough of the pixels of the given states changed ([`Options::stop_share`]).
    ///
    /// # Errors
    /// A step there is not; states that were not marked in it.
    pub fn next(&self, step: usize, states: &[Option<&State>]) -> Result<Option<usize>> {
        self.check_states(step, 0, states)?;
        let (mut changed, mut pixels) = (0, 0);
        for (view, state) in states.iter().enumerate() {
            let Some(state) = state else { continue };
            state.require_marked(&format!("states[{view}]"), true)?;
            let record = state.cycles().last();
            changed += record.map_or(0, |record| record.changed);
            pixels += record.map_or(0, |record| record.pixels);
        }
        let settled = (changed as f64 / pixels.max(1) as f64) < self.options.stop_share;
        let is_next = |&other: &usize| {
            let ends = self.steps[step].cycle > 0 && settled;
            !(ends && self.steps[other].scale_index == self.steps[step].scale_index)
        };
        Ok((step + 1..self.steps.len()).find(is_next))
    }

    pub(super) fn check_place(&self, step: usize, view: usize) -> Result<()> {
        if step >= self.steps.len() {
            let expected = format!("a step below their number, {}", self.steps.len());
            return Err(Error::argument("step", step, expected));
        }
        if view >= self.views() {
            let expected = format!("a view below their number, {}", self.views());
            return Err(Error::argument("view", view, expected));
        }
        Ok(())
    }

    /// Refuses states of other views or scales than they stand for.
    pub(super) fn check_states(&self, step: usize, view: usize, states: &[Option<&State>]) -> Result<()> {
        self.check_place(step, view)?;
        if !states.is_empty() && states.len() != self.views() {
            let expected = format!("one entry for each of the {} views, or none at all", self.views());
            return Err(Error::argument("states", format!("{} entries", states.len()), expected));
        }
        for (place, state) in states.iter().enumerate() {
            let Some(state) = state else { continue };
            if state.view() != place {
                let value = format!("the state of view {}", state.view());
                return Err(Error::argument(
                    format!("states[{place}]"),
                    value,
                    format!("that of view {place}"),
                ));
            }
            self.check_scale(step, state, &format!("states[{place}]"))?;
        }
        Ok(())
    }

    fn check_scale(&self, step: usize, state: &State, name: &str) -> Result<()> {
        let (width, height) = self.size(step, state.view())?;
        let same_scale =
            self.steps.get(state.step()).map(|step| step.scale_index) == Some(self.steps[step].scale_index);
        if same_scale && state.fits(width, height, self.sources(state.view()).len()) {
            return Ok(());
        }
        let value = format!("a state after step {} of {} pixels", state.step(), state.pixels());
        let expected = format!(
            "one on the scale of step {step}, {width}x{height} pixels, of the same scene and options; states of the \
             next coarser scale are handed up first"
        );
        Err(Error::argument(name, value, expected))
    }

    /// Whether a state has to be handed up before it can take part in a step.
    pub(super) fn is_coarser(&self, state: &State, step: usize) -> bool {
        self.steps[state.step()].scale_index < self.steps[step].scale_index
    }

    /// A state on the next finer scale: each pixel gets the plane of its coarse pixel.
    ///
    /// # Errors
    /// A step or view there is not; a state of another view, or not of the scale before that of `step`.
    pub fn hand_up(&self, step: usize, view: usize, state: &State) -> Result<State> {
        self.check_place(step, view)?;
        let scale = self.steps[step].scale_index;
        let own = self.steps.get(state.step()).map(|step| step.scale_index);
        let coarser = scale.checked_sub(1).filter(|coarser| own == Some(*coarser));
        let Some(coarser) = coarser else {
            let value = format!("a state after step {}", state.step());
            return Err(Error::argument(
                "state",
                value,
                format!("one on the scale before that of step {step}"),
            ));
        };
        let coarse_step = self.steps.iter().position(|step| step.scale_index == coarser).unwrap_or(0);
        self.check_scale(coarse_step, state, "state")?;
        if state.view() != view {
            let value = format!("the state of view {}", state.view());
            return Err(Error::argument("state", value, format!("that of view {view}")));
        }
        state.require_marked("state", true)?;
        let fine = self.scaled(step, view);
        let handed_up = state.solved.refined(&self.scaled[coarser][view].camera, &fine.camera, fine.range);
        Ok(state.on_finer_scale(step, handed_up))
    }
}

/// The window of a scale. At full size a coarser scale has found the surfaces: a smaller window keeps to one of them at
/// edges.
fn window(options: &Options, scale: usize) -> Window {
    let is_finest = scale > 0 && options.scales[scale].halvings == 0 && options.finest_window_radius > 0;
    let (radius, is_round) = match is_finest {
        true => (options.finest_window_radius, false),
        false => (options.window_radius, options.round_window),
    };
    let make = if is_round { Window::disc } else { Window::new };
    make(radius, options.window_step, options.spatial_sigma, options.colour_sigma, options.min_variance)
}
