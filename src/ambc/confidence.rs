//! The view set and the confidence of final planes.

use super::cost::Evaluator;
use super::counts::Counts;
use super::food_source::FoodSource;
use super::rules::CostRules;
use crate::error::Result;
use crate::geometry::{Grid, ViewSets};
use crate::matching::{MAX_COST, Problem, Window};
use crate::parallel::{Advance, Bands, run_bands};
use crate::scene::PixelEstimate;
use crate::simd::{Simd, SimdLevel, Task, dispatch};
use crate::view_selection::{ViewRules, ViewSelector};

/// The input: planes of a view and what they are matched with.
pub(crate) struct ConfidenceTask<'a> {
    /// The view and its sources, with their published surfaces.
    pub problem: &'a Problem<'a>,
    /// Shape and weights of the patches.
    pub window: &'a Window,
    /// The cost of a plane.
    pub cost: CostRules,
    /// The view set of a pixel.
    pub view_set: ViewRules,
    /// Instruction set.
    pub level: SimdLevel,
    /// Told of the start of each band, as 0 units of work.
    pub advance: Advance<'a>,
}

/// Confidence and view set of each pixel.
pub(crate) struct Confidence {
    /// Number of source views of the view.
    pub sources: usize,
    /// Mean `1 - NCC` over the view set, 0 to 2; 0 where there is no plane.
    pub cost: Vec<f32>,
    /// Whether the patch has texture: it can be matched, and its variance is more than noise.
    pub has_texture: Vec<bool>,
    /// The source views that see the plane.
    pub view_sets: ViewSets,
    /// Work done.
    pub counts: Counts,
}

/// Bands of the pixels of the output.
struct Band<'b> {
    first: usize,
    cost: &'b mut [f32],
    has_texture: &'b mut [bool],
    view_sets: &'b mut [u32],
}

impl ConfidenceTask<'_> {
    /// Determines them on the current rayon pool.
    ///
    /// # Errors
    /// What `advance` returns.
    pub(crate) fn run(&self, planes: &[PixelEstimate]) -> Result<Confidence> {
        dispatch(self.level, Run { task: self, planes })
    }
}

struct Run<'a> {
    task: &'a ConfidenceTask<'a>,
    planes: &'a [PixelEstimate],
}

impl Task for Run<'_> {
    type Output = Result<Confidence>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let Run { task, planes } = self;
        let ConfidenceTask { problem, window, .. } = *task;
        let grid = Grid { width: problem.image.width, height: problem.image.height };
        let mut view_sets = ViewSets::empty(planes.len(), problem.sources.len());
        let words = view_sets.words_per_pixel();
        let (mut cost, mut has_texture) = (vec![0.0; planes.len()], vec![false; planes.len()]);
        let bands = Bands::new(grid.width, grid.height);
        let mut texture = has_texture.chunks_mut(bands.pixels());
        let mut sets = view_sets.words_mut().chunks_mut(bands.pixels() * words);
        let costs = cost.chunks_mut(bands.pixels()).enumerate();
        let band = |(index, cost)| {
            let first = index * bands.pixels();
            Some(Band { first, cost, has_texture: texture.next()?, view_sets: sets.next()? })
        };
        let all = costs.filter_map(band).collect();
        let counts = run_bands(
            simd,
            all,
            task.advance,
            |_| 0,
            #[inline(always)]
            |band: Band| {
                let mut evaluator = Evaluator::new(simd, problem, window, task.cost);
                let mut selector = ViewSelector::new(simd, problem, task.view_set);
                for place in 0..band.cost.len() {
                    let index = band.first + place;
                    let PixelEstimate { depth, normal, .. } = planes[index];
                    if depth <= 0.0 {
                        continue;
                    }
                    let at = grid.position(index);
                    let set = &mut band.view_sets[place * words..][..words];
                    selector.select(set, (at.0 as f32, at.1 as f32), depth, normal);
                    evaluator.set_pixel(at, set);
                    band.cost[place] = evaluator.mean_photometric_cost(&FoodSource::new(depth, normal));
                    band.has_texture[place] = evaluator.has_texture() && !evaluator.is_textureless();
                }
                evaluator.counts
            },
        )?;
        let mut counts: Counts = counts.into_iter().sum();
        counts.bilinear_samples = counts.ncc_evaluations * window.samples();
        debug_assert!(cost.iter().all(|cost| (0.0..=MAX_COST).contains(cost)));
        let sources = problem.sources.len();
        Ok(Confidence { sources, cost, has_texture, view_sets, counts })
    }
}
