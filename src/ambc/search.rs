//! The search of one reference view in one cycle: bands of rows on the threads, tiles within a band, and the
//! two colors of the checkerboard in turn.

use super::colony::{Colonies, color};
use super::cost::Evaluator;
use super::counts::Counts;
use super::food_source::FoodSource;
use super::initial_colony::{InitialColony, PixelSets};
use super::input::Search;
use super::random::{Random, stream};
use super::{employed, local_plane, onlooker, scout};
use crate::error::Result;
use crate::geometry::{Grid, Position, ViewSets};
use crate::parallel::{Bands, run_bands};
use crate::scene::PixelEstimate;
use crate::simd::{Simd, Task, dispatch};
use rayon::prelude::*;

/// Columns of a tile: its colonies and the parts of the sources that they reach stay in cache.
const TILE_COLUMNS: usize = 64;

/// The result of a search.
pub(crate) struct SearchResult {
    /// The best plane of every pixel, `validated` where it comes from a validated one; depth 0 where the mask
    /// leaves the pixel out.
    pub planes: Vec<PixelEstimate>,
    /// The source views that see the previous estimate of each pixel: those the pixel is checked against.
    pub view_sets: ViewSets,
    /// The pixels that were not searched because their patches are textureless.
    pub is_textureless: Vec<bool>,
    /// Work done.
    pub counts: Counts,
}

impl SearchResult {
    /// Of a view without sources: no pixel has a plane.
    pub(crate) fn without_sources(pixels: usize) -> SearchResult {
        SearchResult {
            planes: vec![PixelEstimate::default(); pixels],
            view_sets: ViewSets::empty(pixels, 0),
            is_textureless: vec![false; pixels],
            counts: Counts::default(),
        }
    }
}

impl Search<'_> {
    /// Runs the search on the current rayon pool.
    ///
    /// # Errors
    /// What `advance` returns.
    pub(crate) fn run(&self) -> Result<SearchResult> {
        dispatch(self.level, SearchTask(self))
    }

    fn grid(&self) -> Grid {
        Grid { width: self.problem.image.width, height: self.problem.image.height }
    }

    fn is_wanted(&self, index: usize) -> bool {
        self.mask.is_none_or(|mask| mask[index])
    }

    /// Units of work of a band of so many rows: it has half of its pixels in either color.
    fn units(&self, rows: usize) -> u64 {
        (rows * self.grid().width * self.rules.food_sources) as u64 / 2
    }
}

/// What a search keeps of all pixels while it runs.
struct State {
    /// By color of the checkerboard.
    colonies: [Colonies; 2],
    visible: ViewSets,
    matched: ViewSets,
    is_textureless: Vec<bool>,
}

/// A band whose colonies are filled.
struct InitialBand<'b> {
    top: usize,
    /// By color of the checkerboard.
    foods: [&'b mut [FoodSource]; 2],
    visible: &'b mut [u32],
    matched: &'b mut [u32],
    is_textureless: &'b mut [bool],
}

/// A band whose colonies of one color are searched.
struct SearchedBand<'b> {
    top: usize,
    foods: &'b mut [FoodSource],
}

struct SearchTask<'a>(&'a Search<'a>);

impl Task for SearchTask<'_> {
    type Output = Result<SearchResult>;

    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let SearchTask(search) = self;
        let grid = search.grid();
        let colonies = || Colonies::new(grid, search.rules.food_sources);
        let all_views = ViewSets::full(grid.pixels(), search.problem.sources.len());
        let mut state = State {
            colonies: [colonies(), colonies()],
            visible: all_views.clone(),
            matched: all_views,
            is_textureless: vec![false; grid.pixels()],
        };
        let mut counts = fill_colonies(simd, search, &mut state)?;
        for iteration in 0..search.rules.iterations {
            for color in [0, 1] {
                counts += improve_colonies(simd, search, &mut state, iteration, color)?;
            }
        }
        counts.bilinear_samples = counts.ncc_evaluations * search.window.samples();
        let State { colonies, visible: view_sets, is_textureless, .. } = state;
        let best = |index: usize| {
            let at = grid.position(index);
            let food = colonies[color(at)].best(at);
            PixelEstimate {
                depth: food.depth,
                normal: food.normal,
                cost: food.cost.into(),
                consistent_views: 0,
                validated: food.validated,
            }
        };
        let planes = (0..grid.pixels()).into_par_iter().map(best).collect();
        Ok(SearchResult { planes, view_sets, is_textureless, counts })
    }
}

/// The pixels of a band, tile by tile: row within the band and column.
fn tiled(width: usize, rows: usize) -> impl Iterator<Item = (usize, usize)> {
    let tile = TILE_COLUMNS * rows;
    (0..width * rows).map(move |place| {
        let left = place / tile * TILE_COLUMNS;
        let (within, columns) = (place % tile, TILE_COLUMNS.min(width - left));
        (within / columns, left + within % columns)
    })
}

/// Section 5.1 of the paper: determines the view sets of every pixel and fills its colony.
fn fill_colonies<S: Simd>(simd: S, search: &Search, state: &mut State) -> Result<Counts> {
    let grid = search.grid();
    let bands = Bands::new(grid.width, grid.height);
    let words = state.visible.words_per_pixel();
    let row_foods = state.colonies[0].row_len();
    let food_sources = search.rules.food_sources;
    let bands_of_state = initial_bands(state, bands, row_foods);
    let counts = run_bands(
        simd,
        bands_of_state,
        search.advance,
        |band| search.units(band.is_textureless.len() / grid.width),
        #[inline(always)]
        |band: InitialBand| {
            let InitialBand { top, foods: [first, second], visible, matched, is_textureless } = band;
            let mut initial = InitialColony::new(simd, search);
            for (row, x) in tiled(grid.width, is_textureless.len() / grid.width) {
                let at: Position = (x, top + row);
                let index = grid.index(at);
                if !search.is_wanted(index) {
                    continue;
                }
                let place = row * grid.width + x;
                let sets = PixelSets {
                    visible: &mut visible[place * words..][..words],
                    matched: &mut matched[place * words..][..words],
                };
                let foods = if color(at) == 0 { &mut *first } else { &mut *second };
                let colony = &mut foods[row * row_foods + x / 2 * food_sources..][..food_sources];
                is_textureless[place] = initial.fill(at, index, colony, sets);
            }
            initial.evaluator.counts
        },
    )?;
    Ok(counts.into_iter().sum())
}

fn initial_bands(state: &mut State, bands: Bands, row_foods: usize) -> Vec<InitialBand<'_>> {
    let words = state.visible.words_per_pixel();
    let [first, second] = &mut state.colonies;
    let mut first = first.foods.chunks_mut(bands.rows * row_foods);
    let mut second = second.foods.chunks_mut(bands.rows * row_foods);
    let mut visible = state.visible.words_mut().chunks_mut(bands.pixels() * words);
    let mut matched = state.matched.words_mut().chunks_mut(bands.pixels() * words);
    let textureless = state.is_textureless.chunks_mut(bands.pixels()).enumerate();
    let band = |(index, is_textureless)| {
        Some(InitialBand {
            top: index * bands.rows,
            foods: [first.next()?, second.next()?],
            visible: visible.next()?,
            matched: matched.next()?,
            is_textureless,
        })
    };
    textureless.filter_map(band).collect()
}

/// One iteration over the colonies of one color: local plane fit, employed, onlooker and scout bees.
fn improve_colonies<S: Simd>(
    simd: S,
    search: &Search,
    state: &mut State,
    iteration: u32,
    current: usize,
) -> Result<Counts> {
    let grid = search.grid();
    let bands = Bands::new(grid.width, grid.height);
    let rules = &search.rules;
    let stream = stream(&[search.random_stream, 1 + u64::from(iteration)]);
    let State { colonies: [first, second], matched, is_textureless, .. } = state;
    let (colonies, neighbors) = if current == 0 { (first, &*second) } else { (second, &*first) };
    let row_foods = colonies.row_len();
    let chunks = colonies.foods.chunks_mut(bands.rows * row_foods).enumerate();
    let searched = chunks.map(|(index, foods)| SearchedBand { top: index * bands.rows, foods }).collect();
    let counts = run_bands(
        simd,
        searched,
        search.advance,
        |band| search.units(band.foods.len() / row_foods),
        #[inline(always)]
        |band: SearchedBand| {
            let mut evaluator = Evaluator::new(simd, search.problem, search.window, rules.cost);
            for (row, x) in tiled(grid.width, band.foods.len() / row_foods) {
                let at: Position = (x, band.top + row);
                let index = grid.index(at);
                if color(at) != current || !search.is_wanted(index) || is_textureless[index] {
                    continue;
                }
                let colony =
                    &mut band.foods[row * row_foods + x / 2 * rules.food_sources..][..rules.food_sources];
                let mut random = Random::new(stream, index as u64);
                evaluator.set_pixel(at, matched.words_of(index));
                evaluator.load_neighbors(neighbors, at);
                evaluator.best_first(colony);
                try_local_plane(&mut evaluator, &mut colony[0], neighbors, at, rules.local_plane_tolerance);
                employed::send(&mut evaluator, colony, rules.employed_bees, &mut random);
                onlooker::send(&mut evaluator, colony, neighbors, at, rules.onlookers, &mut random);
                evaluator.best_first(colony);
                if scout::send(&mut evaluator, colony, rules.trial_limit, &mut random) {
                    evaluator.best_first(colony);
                }
            }
            evaluator.counts
        },
    )?;
    Ok(counts.into_iter().sum())
}

/// Tries, for the best food source, the plane fitted to the depths around the pixel.
#[inline(always)]
fn try_local_plane<S: Simd>(
    evaluator: &mut Evaluator<S>,
    best: &mut FoodSource,
    neighbors: &Colonies,
    at: Position,
    tolerance: f32,
) {
    if tolerance > 0.0
        && let Some(trial) = local_plane::fit(evaluator.problem(), neighbors, at, best, tolerance)
    {
        evaluator.replace_if_better(best, &trial, 0.0);
    }
}
