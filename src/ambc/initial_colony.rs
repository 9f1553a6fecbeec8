//! The food sources a colony starts with (section 5.1 of the paper), and the view set its pixel is matched
//! with.

use super::colony::Candidate;
use super::cost::Evaluator;
use super::food_source::FoodSource;
use super::input::Search;
use super::random::Random;
use crate::geometry::Position;
use crate::matching::MAX_COST;
use crate::scene::PixelEstimate;
use crate::simd::Simd;
use crate::view_selection::ViewSelector;

/// Mean 1 - NCC over the view set below which the previous estimate of a textureless pixel is kept. Noise
/// alone has about 1, with a deviation of 0.1 over the samples of the window and a few views.
const MAX_EVIDENCE_COST: f32 = 0.7;

/// The view sets of a pixel, as bits over the source list.
pub(super) struct PixelSets<'s> {
    /// The source views that see its previous estimate; all without one.
    pub visible: &'s mut [u32],
    /// The part of them it is matched with in this search.
    pub matched: &'s mut [u32],
}

/// Fills the colonies of one pixel after the other.
pub(super) struct InitialColony<'a, S: Simd> {
    search: &'a Search<'a>,
    selector: ViewSelector<'a, S>,
    /// Evaluates the food sources.
    pub evaluator: Evaluator<'a, S>,
    /// Evaluates previous estimates of textureless pixels.
    pub evidence: Evaluator<'a, S>,
}

impl<'a, S: Simd> InitialColony<'a, S> {
    /// For the pixels of a search.
    pub(super) fn new(simd: S, search: &'a Search<'a>) -> InitialColony<'a, S> {
        let Search { problem, window, rules, .. } = search;
        InitialColony {
            search,
            selector: ViewSelector::new(simd, problem, rules.view_set),
            evaluator: Evaluator::new(simd, problem, window, rules.cost),
            evidence: Evaluator::new(simd, problem, search.evidence_window, rules.cost),
        }
    }

    /// Fills a colony, best food source first: the previous estimate, the candidate of another view, and
    /// perturbed or random planes; returns whether the pixel is textureless. The colony of a textureless
    /// pixel holds its previous estimate or a random plane at the highest cost, and is not searched.
    ///
    /// Around a validated estimate all other food sources are perturbations of it. An estimate that is not
    /// validated may be far off: random planes, stratified in inverse depth, take their place but for the
    /// second food source, unless that is a candidate.
    #[inline(always)]
    pub(super) fn fill(
        &mut self,
        at: Position,
        index: usize,
        colony: &mut [FoodSource],
        sets: PixelSets,
    ) -> bool {
        let InitialColony { search, selector, evaluator, evidence } = self;
        let rules = &search.rules;
        let mut random = Random::new(search.random_stream, index as u64);
        let start = search.start.map(|start| start[index]).filter(|start| start.depth > 0.0);
        if let Some(start) = start {
            selector.select(sets.visible, (at.0 as f32, at.1 as f32), start.depth, start.normal);
        }
        evaluator.set_pixel(at, sets.visible);
        let (problem, ray) = (search.problem, evaluator.ray());
        if evaluator.is_textureless() {
            let food = match start {
                Some(start) => {
                    let food = food_of(&start);
                    // An estimate that is not validated is not improved here, and stays so.
                    let is_earned = food.validated && {
                        evidence.set_pixel(at, sets.visible);
                        evidence.mean_photometric_cost(&food) < MAX_EVIDENCE_COST
                    };
                    if !is_earned {
                        sets.visible.fill(0);
                    }
                    FoodSource { validated: is_earned, ..food }
                }
                None => FoodSource::random(problem, ray, &mut random, (0.0, 1.0)),
            };
            colony[0] = FoodSource { cost: MAX_COST, ..food };
            return true;
        }
        let mut next = 0;
        let first_unevaluated = usize::from(start.is_some());
        if let Some(start) = start {
            let food = food_of(&start);
            sets.matched.copy_from_slice(sets.visible);
            let cost = match rules.max_views_per_pixel {
                0 => evaluator.cost(&food, f32::INFINITY),
                count => evaluator.keep_best_views(&food, count, sets.matched),
            };
            colony[0] = FoodSource { cost, ..food };
            next = 1;
        }
        let candidate = search.candidates.map(|candidates| candidates[index]);
        if let Some(Candidate { depth, normal, .. }) = candidate.filter(|candidate| candidate.depth > 0.0) {
            colony[next] = FoodSource::new(depth, normal);
            next += 1;
        }
        let strata = (colony.len() - next) as f32;
        for place in next..colony.len() {
            let is_perturbed =
                rules.perturbation.depth > 0.0 && start.is_some_and(|start| start.validated || place == 1);
            colony[place] = if is_perturbed {
                colony[0].perturbed(problem, ray, &mut random, rules.perturbation)
            } else {
                let stratum = (place - next) as f32;
                let part = (stratum / strata, (stratum + 1.0) / strata);
                FoodSource::random(problem, ray, &mut random, part)
            };
        }
        for food in &mut colony[first_unevaluated..] {
            food.cost = evaluator.cost(food, f32::INFINITY);
        }
        evaluator.best_first(colony);
        false
    }
}

/// The food source of a previous estimate.
#[inline(always)]
fn food_of(estimate: &PixelEstimate) -> FoodSource {
    FoodSource { validated: estimate.validated, ..FoodSource::new(estimate.depth, estimate.normal) }
}
