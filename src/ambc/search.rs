//! The search of one reference view for one cycle: bands of rows on the threads, tiles within a band, and the two
//! colors of the checkerboard in turn.

use super::colony::{Candidate, Colonies, color};
use super::cost::{CostRules, Evaluator};
use super::food_source::FoodSource;
use super::local_plane::fitted;
use super::onlooker::OnlookerRules;
use super::random::{Random, stream};
use super::{employed, onlooker, scout};
use crate::ambc::Counts;
use crate::error::{Error, Result};
use crate::geometry::ViewSets;
use crate::matching::Problem;
use crate::matching::{MAX_COST, Window};
use crate::scene::PixelEstimate;
use crate::simd::{Simd, SimdLevel, Task, dispatch};
use crate::view_selection::{ViewRules, ViewSelector};
use rayon::prelude::*;

/// Sides of a tile: its colonies and the parts of the sources they reach stay in cache.
const TILE_ROWS: usize = 8;
const TILE_COLUMNS: usize = 64;
/// Rows of the lowest bands, and bands for each thread that are worth them: threads that end early wait for the last.
const MIN_BAND_ROWS: usize = 2;
const BANDS_PER_THREAD: usize = 8;

/// Rows of a band, the unit of work of a thread of the current rayon pool, in an image of this height.
pub fn band_rows(height: usize) -> usize {
    (height / (BANDS_PER_THREAD * rayon::current_num_threads())).clamp(MIN_BAND_ROWS, TILE_ROWS)
}

/// What one search depends on.
pub struct Search<'a> {
    /// The view and its sources.
    pub problem: &'a Problem<'a>,
    /// Shape and weights of the patches.
    pub window: &'a Window,
    /// Aggregation of costs.
    pub cost_rules: CostRules,
    /// Pixelwise view selection.
    pub view_rules: ViewRules,
    /// Where a solution is wanted.
    pub mask: Option<&'a [bool]>,
    /// Solutions to start from, one a pixel; `None` in the very first cycle.
    pub start: Option<&'a [PixelEstimate]>,
    /// Planes other views candidate, one a pixel.
    pub candidates: Option<&'a [Candidate]>,
    /// Food sources of each colony.
    pub foods: usize,
    /// Rounds of employed, onlooker and scout bees.
    pub iterations: u32,
    /// Trials after which a scout bee may replace a food source.
    pub trial_limit: u16,
    /// Food sources of each colony, the best first, that employed bees work on.
    pub employed_foods: usize,
    /// How onlookers choose.
    pub onlookers: OnlookerRules,
    /// Relative difference of inverse depth up to which a neighbor's depth continues a plane; 0 fits no planes.
    pub plane_fit: f32,
    /// Views kept for the whole search; 0 keeps all.
    pub focused_views: usize,
    /// Relative spread and tilt of foods around the start; spread 0 draws them at random.
    pub around_start: (f32, f32),
    /// Names the random numbers of this view and cycle.
    pub stream: u64,
    /// Instruction set.
    pub level: SimdLevel,
    /// Asked by every band; `true` cancels. May be called from any thread.
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// What one search finds.
pub struct SearchOutcome {
    /// The best food source of every pixel; depth 0 where the mask leaves the pixel out.
    pub best: Vec<FoodSource>,
    /// The view set each pixel was matched with.
    pub sets: ViewSets,
    /// The pixels that were not searched because their images show nothing but noise.
    pub weak: Vec<bool>,
    /// Work done.
    pub counts: Counts,
}

impl Search<'_> {
    /// Runs the search on the current rayon pool.
    pub fn run(&self) -> Result<SearchOutcome> {
        dispatch(self.level, SearchTask(self))
    }

    fn width(&self) -> usize {
        self.problem.image.width
    }

    fn height(&self) -> usize {
        self.problem.image.height
    }

    fn is_wanted(&self, pixel: usize) -> bool {
        self.mask.is_none_or(|mask| mask[pixel])
    }
}

struct SearchTask<'a>(&'a Search<'a>);

impl Task for SearchTask<'_> {
    type Output = Result<SearchOutcome>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let search = self.0;
        let (width, height) = (search.width(), search.height());
        let mut colonies =
            [Colonies::new(width, height, search.foods), Colonies::new(width, height, search.foods)];
        let mut sets = ViewSets::full(width * height, search.problem.sources.len());
        let mut focus = sets.clone();
        let mut weak = vec![false; width * height];
        let mut counts = initialize(simd, search, &mut colonies, (&mut sets, &mut focus), &mut weak)?;
        for iteration in 0..search.iterations {
            let [first, second] = &mut colonies;
            counts += iterate(simd, search, (iteration, 0), first, second, (&focus, &weak))?;
            counts += iterate(simd, search, (iteration, 1), second, first, (&focus, &weak))?;
        }
        counts.bilinear_samples = counts.ncc_evaluations * search.window.samples();
        let best = (0..width * height)
            .into_par_iter()
            .map(|pixel| {
                let (x, y) = (pixel % width, pixel / width);
                *colonies[color(x, y)].best(x, y)
            })
            .collect();
        Ok(SearchOutcome { best, sets, weak, counts })
    }
}

/// The pixels of a band, tile by tile; `x` and the row within the band.
fn tiled(width: usize, rows: usize) -> impl Iterator<Item = (usize, usize)> {
    let tile = TILE_COLUMNS * rows;
    (0..width * rows).map(move |place| {
        let left = place / tile * TILE_COLUMNS;
        let (within, columns) = (place % tile, TILE_COLUMNS.min(width - left));
        (left + within % columns, within / columns)
    })
}

/// Adds up what the bands did, unless one was cancelled.
fn total(bands: impl IndexedParallelIterator<Item = Option<Counts>>) -> Result<Counts> {
    let sum = |mut a: Counts, b: Counts| {
        a += b;
        Some(a)
    };
    bands.with_max_len(1).try_reduce(Counts::default, sum).ok_or(Error::Cancelled)
}

/// Section 5.1: settles the view set of every pixel, and the part of it to focus on, and fills its colony.
fn initialize<S: Simd>(
    simd: S,
    search: &Search,
    colonies: &mut [Colonies; 2],
    (sets, focus): (&mut ViewSets, &mut ViewSets),
    weak: &mut [bool],
) -> Result<Counts> {
    let (width, height) = (search.width(), search.height());
    let words = sets.words_per_pixel();
    let band_rows = band_rows(height);
    let row_foods = colonies[0].row_len();
    let [first, second] = colonies;
    let bands = first
        .foods
        .par_chunks_mut(band_rows * row_foods)
        .zip(second.foods.par_chunks_mut(band_rows * row_foods))
        .zip(sets.words_mut().par_chunks_mut(band_rows * width * words))
        .zip(focus.words_mut().par_chunks_mut(band_rows * width * words))
        .zip(weak.par_chunks_mut(band_rows * width))
        .enumerate();
    total(bands.map(|(band, ((((first, second), sets), focus), weak))| {
        if (search.cancelled)() {
            return None;
        }
        Some(simd.vectorize(
            #[inline(always)]
            || {
                let mut evaluator = Evaluator::new(simd, search.problem, search.window, search.cost_rules);
                let mut selector = ViewSelector::new(simd, search.problem, search.view_rules);
                let rows = band_rows.min(height - band * band_rows);
                for (x, row) in tiled(width, rows) {
                    let y = band * band_rows + row;
                    if !search.is_wanted(y * width + x) {
                        continue;
                    }
                    let set = &mut sets[(row * width + x) * words..][..words];
                    let focus = &mut focus[(row * width + x) * words..][..words];
                    let foods = if color(x, y) == 0 { &mut *first } else { &mut *second };
                    let colony = &mut foods[row * row_foods + x / 2 * search.foods..][..search.foods];
                    let mut random = Random::new(search.stream, (y * width + x) as u64);
                    fill_colony(
                        search,
                        (&mut evaluator, &mut selector),
                        colony,
                        (set, focus),
                        (x, y),
                        &mut random,
                    );
                    weak[row * width + x] = evaluator.is_weak();
                }
                evaluator.counts
            },
        ))
    }))
}

/// Without a solution: random planes, stratified in inverse depth. With one: it, what other views candidate, and planes
/// around it; one that is not validated may be far off, so random planes take most of that place.
#[inline(always)]
fn fill_colony<S: Simd>(
    search: &Search,
    (evaluator, selector): (&mut Evaluator<S>, &mut ViewSelector<S>),
    colony: &mut [FoodSource],
    (set, focus): (&mut [u32], &mut [u32]),
    (x, y): (usize, usize),
    random: &mut Random,
) {
    let problem = search.problem;
    let pixel = y * search.width() + x;
    let start = search.start.map(|start| start[pixel]).filter(|start| start.depth > 0.0);
    if let Some(start) = start {
        selector.select(set, (x as f32, y as f32), start.depth, start.normal);
    }
    evaluator.go_to(x, y, set);
    let ray = evaluator.ray();
    if evaluator.is_weak() {
        let food = match start {
            Some(start) => {
                FoodSource { validated: start.validated, ..FoodSource::new(start.depth, start.normal) }
            }
            None => FoodSource::random(problem, ray, random, (0.0, 1.0)),
        };
        colony[0] = FoodSource { cost: MAX_COST, ..food };
        return;
    }
    let mut next = 0;
    let first = usize::from(start.is_some());
    if let Some(start) = start {
        let food = FoodSource { validated: start.validated, ..FoodSource::new(start.depth, start.normal) };
        focus.copy_from_slice(set);
        let cost = match search.focused_views {
            0 => evaluator.cost(&food, f32::INFINITY),
            count => evaluator.focus(&food, count, focus),
        };
        colony[0] = FoodSource { cost, ..food };
        next = 1;
    }

    let candidate =
        search.candidates.map(|candidates| candidates[pixel]).filter(|candidate| candidate.depth > 0.0);
    if let Some(candidate) = candidate {
        colony[next] = FoodSource::new(candidate.depth, candidate.normal);
        next += 1;
    }
    let strata = (colony.len() - next) as f32;
    for index in next..colony.len() {
        let (spread, tilt) = search.around_start;
        colony[index] = if spread > 0.0 && start.is_some_and(|start| start.validated || index == 1) {
            colony[0].nearby(problem, ray, random, spread, tilt)
        } else {
            let stratum = (index - next) as f32;
            let part = (stratum / strata, (stratum + 1.0) / strata);
            FoodSource::random(problem, ray, random, part)
        };
    }
    for food in &mut colony[first..] {
        food.cost = evaluator.cost(food, f32::INFINITY);
    }
    evaluator.best_first(colony);
}

/// One iteration over the pixels of one color; `focus` are the view sets they are matched with.
fn iterate<S: Simd>(
    simd: S,
    search: &Search,
    (iteration, turn): (u32, usize),
    colonies: &mut Colonies,
    neighbors: &Colonies,
    (focus, weak): (&ViewSets, &[bool]),
) -> Result<Counts> {
    let (width, height) = (search.width(), search.height());
    let row_foods = colonies.row_len();
    let stream = stream(&[search.stream, 1 + u64::from(iteration)]);
    let band_rows = band_rows(height);
    let bands = colonies.foods.par_chunks_mut(band_rows * row_foods).enumerate();
    total(bands.map(|(band, foods)| {
        if (search.cancelled)() {
            return None;
        }
        Some(simd.vectorize(
            #[inline(always)]
            || {
                let mut evaluator = Evaluator::new(simd, search.problem, search.window, search.cost_rules);
                let rows = band_rows.min(height - band * band_rows);
                for (x, row) in tiled(width, rows) {
                    let y = band * band_rows + row;
                    let pixel = y * width + x;
                    if color(x, y) != turn || !search.is_wanted(pixel) || weak[pixel] {
                        continue;
                    }
                    let colony = &mut foods[row * row_foods + x / 2 * search.foods..][..search.foods];
                    let mut random = Random::new(stream, pixel as u64);
                    evaluator.go_to(x, y, focus.words_of(pixel));
                    evaluator.look_around(neighbors, (x, y));
                    evaluator.best_first(colony);
                    try_fitted(search, &mut evaluator, &mut colony[0], neighbors, (x, y));
                    employed::send(&mut evaluator, colony, search.employed_foods, &mut random);
                    onlooker::send(&mut evaluator, colony, neighbors, (x, y), search.onlookers, &mut random);
                    evaluator.best_first(colony);
                    scout::send(&mut evaluator, colony, search.trial_limit, &mut random);
                    evaluator.best_first(colony);
                }
                evaluator.counts
            },
        ))
    }))
}

/// Tries, for the best food source, the plane fitted to the depths around the pixel.
#[inline(always)]
fn try_fitted<S: Simd>(
    search: &Search,
    evaluator: &mut Evaluator<S>,
    best: &mut FoodSource,
    neighbors: &Colonies,
    at: (usize, usize),
) {
    if search.plane_fit > 0.0
        && let Some(trial) = fitted(search.problem, neighbors, at, best, search.plane_fit)
    {
        evaluator.challenge(best, &trial, 0.0);
    }
}

/// What is known of the final solutions of a view.
pub struct Assessment {
    /// Mean `1 - NCC` over the view set of each pixel.
    pub cost: Vec<f32>,
    /// Whether each pixel's patch can be matched.
    pub textured: Vec<bool>,
    /// The view set of each solution.
    pub sets: ViewSets,
    /// Work done.
    pub counts: Counts,
}

/// Settles the view sets of the final solutions and their confidence.
pub fn assess(search: &Search, solutions: &[PixelEstimate]) -> Result<Assessment> {
    dispatch(search.level, AssessTask { search, solutions })
}

struct AssessTask<'a> {
    search: &'a Search<'a>,
    solutions: &'a [PixelEstimate],
}

impl Task for AssessTask<'_> {
    type Output = Result<Assessment>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let AssessTask { search, solutions } = self;
        let width = search.width();
        let mut sets = ViewSets::empty(solutions.len(), search.problem.sources.len());
        let words = sets.words_per_pixel();
        let mut cost = vec![0.0; solutions.len()];
        let mut textured = vec![false; solutions.len()];
        let band = band_rows(search.height()) * width;
        let bands = (sets.words_mut().par_chunks_mut(band * words))
            .zip(cost.par_chunks_mut(band))
            .zip(textured.par_chunks_mut(band))
            .enumerate();
        let mut counts = total(bands.map(|(index, ((sets, cost), textured))| {
            if (search.cancelled)() {
                return None;
            }
            Some(simd.vectorize(
                #[inline(always)]
                || {
                    let mut evaluator =
                        Evaluator::new(simd, search.problem, search.window, search.cost_rules);
                    let mut selector = ViewSelector::new(simd, search.problem, search.view_rules);
                    for place in 0..cost.len() {
                        let pixel = index * band + place;
                        let (x, y) = (pixel % width, pixel / width);
                        let PixelEstimate { depth, normal, .. } = solutions[pixel];
                        if depth <= 0.0 {
                            continue;
                        }
                        let set = &mut sets[place * words..][..words];
                        selector.select(set, (x as f32, y as f32), depth, normal);
                        evaluator.go_to(x, y, set);
                        cost[place] = evaluator.mean_photometric_cost(&FoodSource::new(depth, normal));
                        textured[place] = evaluator.has_texture() && !evaluator.is_weak();
                    }
                    evaluator.counts
                },
            ))
        }))?;
        counts.bilinear_samples = counts.ncc_evaluations * search.window.samples();
        Ok(Assessment { cost, textured, sets, counts })
    }
}
