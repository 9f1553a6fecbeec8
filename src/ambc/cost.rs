//! Matching cost of a hypothesis over the source views of its pixel (section 5.2 of the paper).

use super::colony::Colonies;
use super::food::{FoodSource, cost_to_beat};
use super::smoothness::{SmoothnessRules, Surroundings};
use crate::kernels::{MAX_COST, ReferencePatch, SlantedPlane, Window, patch_costs};
use crate::maps::Counts;
use crate::options::{Aggregation, Options};
use crate::simd::{LANES, Simd};
use crate::views::{Placements, Reference, Source, ViewSets};
use glam::Vec3;
use std::cmp::Ordering;

/// How source views' costs become a hypothesis' cost.
#[derive(Debug, Clone, Copy)]
pub struct CostRules {
    aggregation: Aggregation,
    /// Hypotheses in fewer views cost infinitely much.
    min_views: usize,
    /// Cost per unit of relative disagreement with a validated depth; 0 without the geometric term.
    geometric_weight: f32,
    /// Relative disagreement at which it stops growing.
    geometric_limit: f32,
    /// Relative disagreement where the source has no validated depth.
    geometric_unknown: f32,
    smoothness: SmoothnessRules,
}

impl CostRules {
    /// The rules of these options; the geometric term needs validated solutions.
    pub fn new(options: &Options, with_geometric_term: bool) -> CostRules {
        let weight = if with_geometric_term { options.geometric_weight } else { 0.0 };
        CostRules {
            aggregation: options.aggregation,
            min_views: options.min_matched(),
            geometric_weight: (weight * 100.0) as f32,
            geometric_limit: (options.geometric_limit / 100.0) as f32,
            geometric_unknown: (options.geometric_unknown / 100.0) as f32,
            smoothness: SmoothnessRules {
                weight: options.smoothness as f32,
                depth_scale: options.smoothness_depth as f32,
                normal_scale: (1.0 - options.smoothness_normal.to_radians().cos()) as f32,
            },
        }
    }

    /// What disagreeing with a source's validated depth costs: bounded, so that a wrong neighbour cannot rule out a
    /// good match.
    #[inline(always)]
    fn geometric_cost(&self, source: &Source, x: f32, y: f32, depth: f32) -> f32 {
        if self.geometric_weight == 0.0 {
            return 0.0;
        }
        let disagreement = match source.validated_at(x, y) {
            Some(validated) => (depth * validated.exact - 1.0).abs().min(self.geometric_limit),
            None => self.geometric_unknown,
        };
        self.geometric_weight * disagreement
    }
}

/// The largest k of [`Aggregation::BestViews`].
pub const MAX_BEST_VIEWS: usize = 8;

/// A source view that has the hypothesis at work in its image.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    source: usize,
    /// Where the hypothesis falls, homogeneous.
    centre: Vec3,
    /// The least it can cost in this view: the geometric term, and the photometric one as soon as it is known.
    least: f32,
}

/// Views matched at once, between two looks whether a hypothesis can still win.
const BATCH: usize = LANES;

/// Evaluates hypotheses of one pixel after the other.
pub struct Evaluator<'a, S: Simd> {
    simd: S,
    reference: &'a Reference<'a>,
    window: &'a Window,
    rules: CostRules,
    patch: ReferencePatch,
    has_texture: bool,
    ray: Vec3,
    placements: Placements<S>,
    candidates: Vec<Candidate>,
    surroundings: Surroundings,
    /// Work done so far.
    pub counts: Counts,
}

impl<'a, S: Simd> Evaluator<'a, S> {
    /// An evaluator that stands at no pixel yet.
    pub fn new(
        simd: S,
        reference: &'a Reference<'a>,
        window: &'a Window,
        rules: CostRules,
    ) -> Evaluator<'a, S> {
        Evaluator {
            simd,
            reference,
            window,
            rules,
            patch: ReferencePatch::new(window),
            has_texture: false,
            ray: Vec3::Z,
            placements: Placements::new(simd, reference),
            candidates: Vec::with_capacity(reference.sources.len()),
            surroundings: Surroundings::new(rules.smoothness),
            counts: Counts::default(),
        }
    }

    /// The reference view.
    #[inline(always)]
    pub fn reference(&self) -> &'a Reference<'a> {
        self.reference
    }

    /// The ray of the pixel.
    #[inline(always)]
    pub fn ray(&self) -> Vec3 {
        self.ray
    }

    /// Goes to a pixel and takes the source views of `set` for it.
    #[inline(always)]
    pub fn go_to(&mut self, x: usize, y: usize, set: &[u32]) {
        self.patch.sample(self.simd, self.window, self.reference.image, x, y);
        self.has_texture = self.patch.has_texture(self.window);
        let (x, y) = (x as f32, y as f32);
        self.ray = self.reference.ray(x, y);
        self.placements.go_to(x, y, set);
    }

    /// Lets the planes of the pixel's neighbours have a say.
    #[inline(always)]
    pub fn look_around(&mut self, neighbours: &Colonies, (x, y): (usize, usize)) {
        self.surroundings.look(self.reference, self.window, neighbours, (x, y));
    }

    /// Whether the pixel's patch can be matched.
    #[inline(always)]
    pub fn has_texture(&self) -> bool {
        self.has_texture
    }

    /// The cost of a hypothesis if it is below `bound`, else infinity: costs are not negative, so the sum over views
    /// stops as soon as it cannot stay below.
    #[inline(always)]
    pub fn cost(&mut self, food: &FoodSource, bound: f32) -> f32 {
        self.find_candidates(food);
        let cost = match self.rules.aggregation {
            Aggregation::AllViews => self.all_views(food, bound),
            Aggregation::BestViews(count) => self.best_views(food, bound, count as usize),
        };
        if cost < bound { cost } else { f32::INFINITY }
    }

    /// Puts `trial` in the place of a food source if it is better; `reward` is a bonus on its fitness.
    #[inline(always)]
    pub fn challenge(&mut self, food: &mut FoodSource, trial: &FoodSource, reward: f32) -> bool {
        let bound =
            cost_to_beat(food.cost + self.surroundings.cost(food), reward) - self.surroundings.cost(trial);
        let cost = self.cost(trial, bound);
        let wins = cost < bound;
        if wins {
            *food = FoodSource { cost, ..*trial };
        }
        wins
    }

    /// Puts the best food source first; its trial count moves with it. Of equals the earlier stays ahead.
    #[inline(always)]
    pub fn best_first(&self, foods: &mut [FoodSource]) {
        let mut best = (0, f32::INFINITY);
        for (index, food) in foods.iter().enumerate() {
            let cost = food.cost + self.surroundings.cost(food);
            if cost < best.1 {
                best = (index, cost);
            }
        }
        foods.swap(0, best.0);
    }

    /// The mean of `1 - NCC` over the views that have the hypothesis in their image: the confidence.
    #[inline(always)]
    pub fn mean_photometric_cost(&mut self, food: &FoodSource) -> f32 {
        self.find_candidates(food);
        self.candidates.iter_mut().for_each(|candidate| candidate.least = 0.0);
        self.add_photometric_costs(&food.plane(self.reference, self.ray), 0, self.candidates.len());
        let sum: f32 = self.candidates.iter().map(|candidate| candidate.least).sum();
        if self.candidates.is_empty() { MAX_COST } else { sum / self.candidates.len() as f32 }
    }

    /// Keeps, for the hypotheses to come, only `count` views, writes them to `set` and gives the cost of this one: the
    /// views whose validated surfaces agree best with it, or, where too few do, those in which it costs least.
    #[inline(always)]
    pub fn focus(&mut self, food: &FoodSource, count: usize, set: &mut [u32]) -> f32 {
        self.find_candidates(food);
        let unknown = self.rules.geometric_weight * self.rules.geometric_unknown;
        let agreeing = self.candidates.iter().filter(|candidate| candidate.least < unknown).count();
        let all = self.candidates.len();
        if all > count {
            if agreeing < count {
                self.add_photometric_costs(&food.plane(self.reference, self.ray), 0, all);
            }
            let rank = |candidate: &Candidate| (candidate.least, candidate.source);
            self.candidates.sort_unstable_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(Ordering::Equal));
            self.candidates.truncate(count);
        }
        if self.candidates.len() >= self.rules.min_views {
            set.fill(0);
            for candidate in &self.candidates {
                ViewSets::insert_into(set, candidate.source);
            }
            self.placements.keep(set);
        }
        match self.rules.aggregation {
            Aggregation::BestViews(best) if all > count && agreeing < count => {
                let best = (best as usize).min(count);
                sum_of_least(&self.candidates, best) / best as f32
            }
            _ => self.cost(food, f32::INFINITY),
        }
    }

    /// A view whose image the hypothesis' centre leaves does not count for it.
    #[inline(always)]
    fn find_candidates(&mut self, food: &FoodSource) {
        let Evaluator { placements, candidates, reference, rules, .. } = self;
        candidates.clear();
        placements.find(
            food.depth,
            #[inline(always)]
            |at| {
                let depth = at.centre.z * food.depth;
                let least = rules.geometric_cost(&reference.sources[at.source], at.x, at.y, depth);
                candidates.push(Candidate { source: at.source, centre: at.centre, least });
            },
        );
    }

    /// Adds what the hypothesis costs in these candidates by their images.
    #[inline(always)]
    fn add_photometric_costs(&mut self, plane: &SlantedPlane, start: usize, end: usize) {
        if !self.has_texture {
            self.candidates[start..end].iter_mut().for_each(|candidate| candidate.least += MAX_COST);
            return;
        }
        let Evaluator { simd, window, patch, reference, .. } = self;
        for batch in self.candidates[start..end].chunks_mut(LANES) {
            let candidates: &[Candidate] = batch;
            let costs = patch_costs(
                *simd,
                window,
                patch,
                #[inline(always)]
                |index| {
                    let Candidate { source, centre, .. } = candidates[index];
                    let source = &reference.sources[source];
                    (source.image, source.pose.homography_about(centre, plane))
                },
                batch.len(),
            );
            for (candidate, cost) in batch.iter_mut().zip(costs) {
                candidate.least += cost;
            }
        }
        self.counts.ncc_evaluations += (end - start) as u64;
    }

    /// Equation 3 of the paper: a small set is penalised.
    #[inline(always)]
    fn all_views(&mut self, food: &FoodSource, bound: f32) -> f32 {
        let count = self.candidates.len();
        if count <= 1 {
            return f32::INFINITY;
        }
        let plane = food.plane(self.reference, self.ray);
        let divisor = (count - 1) as f32;
        let sum =
            |candidates: &[Candidate]| -> f32 { candidates.iter().map(|candidate| candidate.least).sum() };
        for start in (0..count).step_by(BATCH) {
            if sum(&self.candidates) >= bound * divisor {
                self.counts.early_outs += 1;
                return f32::INFINITY;
            }
            self.add_photometric_costs(&plane, start, count.min(start + BATCH));
        }
        sum(&self.candidates) / divisor
    }

    /// The mean over the best views of the set; views that cannot see the point do not raise it.
    #[inline(always)]
    fn best_views(&mut self, food: &FoodSource, bound: f32, best: usize) -> f32 {
        let count = self.candidates.len();
        if count < self.rules.min_views {
            return f32::INFINITY;
        }
        let plane = food.plane(self.reference, self.ray);
        let best = best.min(count);
        let limit = bound * best as f32;
        for start in (0..count).step_by(BATCH) {
            // In between, the views not yet looked at are enough to be the best ones.
            if (start == 0 || start + best > count) && sum_of_least(&self.candidates, best) >= limit {
                self.counts.early_outs += 1;
                return f32::INFINITY;
            }
            self.add_photometric_costs(&plane, start, count.min(start + BATCH));
        }
        sum_of_least(&self.candidates, best) / best as f32
    }
}

/// The sum of the `best` smallest costs.
#[inline(always)]
fn sum_of_least(candidates: &[Candidate], best: usize) -> f32 {
    let costs = candidates.iter().map(|candidate| candidate.least);
    if candidates.len() == best {
        return costs.sum();
    }
    if candidates.len() == best + 1 {
        let largest = costs.clone().fold(0.0, larger);
        return costs.sum::<f32>() - largest;
    }
    let mut least = [f32::INFINITY; MAX_BEST_VIEWS];
    for mut cost in costs {
        // Without branches: which costs are small cannot be predicted.
        for place in &mut least {
            (*place, cost) = (smaller(*place, cost), larger(*place, cost));
        }
    }
    least[..best].iter().sum()
}

/// Costs are numbers: `f32::min` would look for others.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
