//! What is known of one view between two stepper.

use super::stepper::Stepper;
use crate::ambc::Counts;
use crate::error::{Error, Result};
use crate::geometry::ViewSets;
use crate::pipeline::CycleRecord;
use crate::scene::Maps;
use crate::scene::{PixelEstimate, PlaneMap};
use glam::Vec3;

/// What is known of one view after it was searched in a cycle or, once it is marked, after the check of that cycle.
#[derive(Debug, Clone)]
pub struct ViewEstimate {
    pub(super) view: usize,
    pub(super) cycle: usize,
    pub(super) marked: bool,
    pub(super) solved: PlaneMap,
    pub(super) counts: Counts,
    pub(super) cycles: Vec<CycleRecord>,
}

/// A host's own maps of a view, to start from or to check others against.
#[derive(Debug, Clone, Copy)]
pub struct OwnMaps<'a> {
    /// Depth and normal of every pixel on the cycle's scale.
    pub maps: &'a Maps,
    /// Which solutions count as validated; `None` validates all that have a depth.
    pub validated: Option<&'a [bool]>,
    /// Cost of each solution, which ranks what is offered to other views and is kept to a 256th; `None` is 0.
    pub cost: Option<&'a [f32]>,
}

impl ViewEstimate {
    /// The estimate of a view whose maps the host brings, as if it had been checked in this cycle.
    ///
    /// # Errors
    /// A cycle or view there is not; maps of another size than the view has in the cycle; a depth that is negative or not
    /// finite; a normal that is not unit or turned away from the camera where there is a depth; a cost that is negative
    /// or not a number.
    pub fn from_maps(stepper: &Stepper, cycle: usize, view: usize, own: &OwnMaps) -> Result<ViewEstimate> {
        let (width, height) = stepper.size(cycle, view)?;
        let pixels = width as usize * height as usize;
        let lengths = [
            ("maps.depth", Some(own.maps.depth.len())),
            ("maps.normal", Some(own.maps.normal.len())),
            ("validated", own.validated.map(<[bool]>::len)),
            ("cost", own.cost.map(<[f32]>::len)),
        ];
        for (name, length) in lengths {
            if length.is_some_and(|length| length != pixels) {
                let value = format!("{} values", length.unwrap_or(0));
                return Err(Error::argument(
                    name,
                    value,
                    format!("one for each of {width} x {height} pixels"),
                ));
            }
        }
        let camera = &stepper.scaled(cycle, view).camera;
        let mut solutions = vec![PixelEstimate::default(); pixels];
        for (pixel, solution) in solutions.iter_mut().enumerate() {
            let (depth, normal) = (own.maps.depth[pixel], Vec3::from_array(own.maps.normal[pixel]));
            let place = (pixel % width as usize, pixel / width as usize);
            let name = |map: &str| format!("{map} at column {}, row {}", place.0, place.1);
            if !(depth.is_finite() && depth >= 0.0) {
                return Err(Error::argument(name("depth"), depth, "a finite depth above 0, or 0 for none"));
            }
            if let Some(cost) = own.cost.map(|cost| cost[pixel])
                && (cost.is_nan() || cost < 0.0)
            {
                return Err(Error::argument(name("cost"), cost, "a number of at least 0"));
            }
            solution.cost = own.cost.map_or(0.0, |cost| cost[pixel]).into();
            if depth == 0.0 {
                continue;
            }
            let ray = camera.ray(glam::DVec2::new(place.0 as f64, place.1 as f64)).as_vec3();
            if !is_unit(normal) || normal.dot(ray) >= 0.0 {
                let expected = "a unit vector that faces the camera (n . ray < 0)";
                return Err(Error::argument(name("normal"), normal, expected));
            }
            let validated = own.validated.is_none_or(|validated| validated[pixel]);
            let consistent =
                if validated { stepper.options.check.min_consistent_views.min(255) as u8 } else { 0 };
            *solution =
                PixelEstimate { depth, normal: normal.normalize(), consistent, validated, ..*solution };
        }
        let verdicts: Vec<(u8, bool)> =
            solutions.iter().map(|solution| (solution.consistent, solution.validated)).collect();
        let sets = ViewSets::full(pixels, stepper.sources(view).len());
        let mut solved = PlaneMap { solutions, sets, ..PlaneMap::default() };
        solved.mark(camera, &verdicts);
        Ok(ViewEstimate { view, cycle, marked: true, solved, counts: Counts::default(), cycles: Vec::new() })
    }

    /// The view it is of.
    pub fn view(&self) -> usize {
        self.view
    }

    /// The cycle it was searched in, or whose scale it was handed up to.
    pub fn cycle(&self) -> usize {
        self.cycle
    }

    /// Whether it carries the verdicts of a check.
    pub fn is_marked(&self) -> bool {
        self.marked
    }

    /// Number of pixels on its scale.
    pub fn pixels(&self) -> usize {
        self.solved.solutions.len()
    }

    /// Depth and normal of every pixel, validated or not.
    pub fn maps(&self) -> Maps {
        maps_of(&self.solved.solutions)
    }

    /// Aggregated cost of every pixel's solution, to a 256th.
    pub fn cost(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.solved.solutions.iter().map(|solution| solution.cost.into())
    }

    /// For every pixel the number of source views consistent with its solution, at most 255, and whether that validates
    /// it; nothing before it is marked.
    pub fn verdicts(&self) -> impl ExactSizeIterator<Item = (u8, bool)> + '_ {
        self.solved.solutions.iter().map(|solution| (solution.consistent, solution.validated))
    }

    /// The view set each pixel was matched with.
    pub fn view_sets(&self) -> &ViewSets {
        &self.solved.sets
    }

    /// Work done for the view so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The cycles of the view so far.
    pub fn cycles(&self) -> &[CycleRecord] {
        &self.cycles
    }

    /// Drops the view sets, which nothing but the check asks for.
    pub(super) fn forget_view_sets(&mut self) {
        self.solved.sets.clear();
    }

    pub(super) fn fits(&self, width: u32, height: u32, sources: usize) -> bool {
        let pixels = width as usize * height as usize;
        let words = ViewSets::empty(0, sources).words_per_pixel();
        self.pixels() == pixels && self.solved.sets.words_per_pixel() == words
    }

    /// Refuses a estimate that is (not) marked; `name` is how the error calls it.
    pub(super) fn require_marked(&self, name: &str, marked: bool) -> Result<()> {
        if self.marked == marked {
            return Ok(());
        }
        let estimate = |marked| if marked { "checked in its cycle" } else { "searched and not yet checked" };
        Err(Error::argument(name, estimate(self.marked), estimate(marked)))
    }

    pub(super) fn on_finer_scale(&self, cycle: usize, solved: PlaneMap) -> ViewEstimate {
        let (counts, cycles) = (self.counts, self.cycles.clone());
        ViewEstimate { view: self.view, cycle, marked: true, solved, counts, cycles }
    }
}

/// Whether a normal is a unit vector as far as files and f32 keep it one.
pub(super) fn is_unit(normal: Vec3) -> bool {
    (normal.length() - 1.0).abs() < 1e-2
}

/// Depth and normal of every solution; on one thread, as hosts ask for them outside any pool.
pub(super) fn maps_of(solutions: &[PixelEstimate]) -> Maps {
    Maps {
        depth: solutions.iter().map(|solution| solution.depth).collect(),
        normal: solutions.iter().map(|solution| solution.normal.to_array()).collect(),
    }
}
