//! Matching cost of a hypothesis over the source views of its pixel (section 5.2 of the paper).
//!
//! ```text
//! cost in a view = (1 - NCC) + geom_consistency_weight * min(e, e_max)^2 / e_max^2
//! cost           = mean of the k smallest costs over the view set, or their sum / (|S| - 1) with k = 0
//! ```
//!
//! with `e` the relative depth error against the view's validated surface, or the assumed error where there
//! is none. A view whose image the hypothesis leaves does not count.

use super::aggregation::{GroupCosts, count_visible, rank_of, sum, sum_of_best};
use super::colony::Colonies;
use super::counts::Counts;
use super::food_source::{FoodSource, cost_to_beat};
use super::rules::{CostRules, GeometricRules};
use super::smoothness_term::SmoothnessTerm;
use crate::geometry::{Position, SlantedPlane, ViewSets};
use crate::matching::{
    Group, MAX_COST, Problem, Projections, ReferencePatch, SourceProjector, Window, patch_costs,
};
use crate::simd::{LANES, Simd};
use glam::Vec3;

type Lanes = [f32; LANES];

impl CostRules {
    /// The geometric costs of a hypothesis of this depth in the views of a group.
    #[inline(always)]
    fn geometric_costs<S: Simd>(
        &self,
        simd: S,
        group: &Group,
        projections: &Projections,
        depth: f32,
    ) -> Lanes {
        let GeometricRules { weight, max_error, missing_cost } = self.geometric;
        if weight == 0.0 {
            return [0.0; LANES];
        }
        let surfaces = group.surfaces(simd, projections);
        let source_depth = simd.mul(simd.splat(depth), simd.load(&projections.center[2]));
        let one = simd.splat(1.0);
        let error = simd.sub(simd.mul(source_depth, simd.load(&surfaces.exact)), one);
        let square = simd.min(simd.mul(error, error), simd.splat(max_error * max_error));
        let known = simd.mul(simd.splat(weight), square);
        simd.store(simd.select(surfaces.known, known, simd.splat(missing_cost)))
    }
}

/// Evaluates hypotheses of one pixel after the other.
pub(super) struct Evaluator<'a, S: Simd> {
    simd: S,
    problem: &'a Problem<'a>,
    window: &'a Window,
    rules: CostRules,
    patch: ReferencePatch,
    has_texture: bool,
    is_textureless: bool,
    ray: Vec3,
    gray: u8,
    projector: SourceProjector<'a, S>,
    /// One for each group of the pixel's views.
    groups: Vec<GroupCosts>,
    smoothness: SmoothnessTerm,
    /// Work done so far.
    pub counts: Counts,
}

impl<'a, S: Simd> Evaluator<'a, S> {
    /// An evaluator without a pixel yet.
    pub(super) fn new(
        simd: S,
        problem: &'a Problem<'a>,
        window: &'a Window,
        rules: CostRules,
    ) -> Evaluator<'a, S> {
        Evaluator {
            simd,
            problem,
            window,
            rules,
            patch: ReferencePatch::new(window),
            has_texture: false,
            is_textureless: false,
            ray: Vec3::Z,
            gray: 0,
            projector: SourceProjector::new(simd, problem),
            groups: Vec::with_capacity(problem.sources.len().div_ceil(LANES)),
            smoothness: SmoothnessTerm::new(rules.smoothness),
            counts: Counts::default(),
        }
    }

    /// The reference view and its sources.
    #[inline(always)]
    pub(super) fn problem(&self) -> &'a Problem<'a> {
        self.problem
    }

    /// The ray of the pixel.
    #[inline(always)]
    pub(super) fn ray(&self) -> Vec3 {
        self.ray
    }

    /// Makes this pixel the current one, matched in the source views of `set`.
    #[inline(always)]
    pub(super) fn set_pixel(&mut self, (x, y): Position, set: &[u32]) {
        self.patch.sample(self.simd, self.window, self.problem.image, x, y);
        self.has_texture = self.patch.has_texture(self.window);
        self.gray = self.problem.image.gray(x, y);
        let noise = self.problem.image.noise.variance(self.gray);
        self.is_textureless = self.rules.min_texture_to_noise > 0.0
            && (self.patch.variance() < self.rules.min_texture_to_noise * noise || !self.has_texture);
        let (x, y) = (x as f32, y as f32);
        self.ray = self.problem.ray(x, y);
        self.projector.set_pixel_and_views(x, y, set);
    }

    /// Loads the planes of the pixel's neighbors into the smoothness term.
    #[inline(always)]
    pub(super) fn load_neighbors(&mut self, neighbors: &Colonies, at: Position) {
        self.smoothness.load_neighbors(self.problem, self.window, neighbors, at);
    }

    /// Similarity of the gray values of the current and another pixel, 0 to 1: their bilateral weight.
    #[inline(always)]
    pub(super) fn gray_similarity(&self, (x, y): Position) -> f32 {
        self.window.similarity(self.gray, self.problem.image.gray(x, y))
    }

    /// Whether the patch has the variance that matching needs.
    #[inline(always)]
    pub(super) fn has_texture(&self) -> bool {
        self.has_texture
    }

    /// Whether the patch is textureless: its variance may be noise alone, and matching it determines nothing.
    #[inline(always)]
    pub(super) fn is_textureless(&self) -> bool {
        self.is_textureless
    }

    /// The cost of a hypothesis if it is below `bound`, else infinity: costs are not negative, so the sum
    /// over views ends as soon as it cannot stay below.
    #[inline(always)]
    pub(super) fn cost(&mut self, food: &FoodSource, bound: f32) -> f32 {
        // A function of its own, also within what is compiled for the instruction set already: it is long,
        // and called from many places.
        let cost = self.simd.vectorize(
            #[inline(always)]
            || {
                self.project(food);
                match self.rules.best_views {
                    0 => self.cost_over_all_views(food, bound),
                    best => self.cost_over_best_views(food, bound, best),
                }
            },
        );
        if cost < bound { cost } else { f32::INFINITY }
    }

    /// Replaces a food source by `trial` if that is better, smoothness included; `reward` is a bonus on the
    /// trial's fitness.
    #[inline(always)]
    pub(super) fn replace_if_better(
        &mut self,
        food: &mut FoodSource,
        trial: &FoodSource,
        reward: f32,
    ) -> bool {
        let bound =
            cost_to_beat(food.cost + self.smoothness.cost(food), reward) - self.smoothness.cost(trial);
        let cost = self.cost(trial, bound);
        let is_better = cost < bound;
        if is_better {
            *food = FoodSource { cost, ..*trial };
        }
        is_better
    }

    /// Swaps the best food source to the front, with its trial count. Of equals the earlier stays ahead.
    #[inline(always)]
    pub(super) fn best_first(&self, foods: &mut [FoodSource]) {
        let mut best = (0, f32::INFINITY);
        for (index, food) in foods.iter().enumerate() {
            let cost = food.cost + self.smoothness.cost(food);
            if cost < best.1 {
                best = (index, cost);
            }
        }
        foods.swap(0, best.0);
    }

    /// The mean of `1 - NCC` over the views that have the hypothesis in their image: the cost of final
    /// planes.
    #[inline(always)]
    pub(super) fn mean_photometric_cost(&mut self, food: &FoodSource) -> f32 {
        self.project(food);
        let plane = food.plane(self.problem, self.ray);
        let (mut sum, mut count) = (0.0, 0);
        for group in 0..self.groups.len() {
            self.groups[group].costs = [0.0; LANES];
            self.add_photometric_costs(&plane, group);
            let GroupCosts { projections, costs } = &self.groups[group];
            for (lane, cost) in costs.iter().enumerate() {
                if projections.inside >> lane & 1 != 0 {
                    (sum, count) = (sum + cost, count + 1);
                }
            }
        }
        if count == 0 { MAX_COST } else { sum / count as f32 }
    }

    /// Keeps only `count` views for the hypotheses to come, writes them to `set` and returns the cost of this
    /// one: the views whose validated surfaces agree best with it or, where too few do, those in which it
    /// costs least.
    #[inline(always)]
    pub(super) fn keep_best_views(&mut self, food: &FoodSource, count: usize, set: &mut [u32]) -> f32 {
        let is_matched = self.rank_views(food, count);
        let kept = count_visible(&self.groups).min(count);
        if kept >= self.rules.min_views {
            self.keep(kept, set);
            if self.rules.best_views > 0 && is_matched {
                let best = self.rules.best_views.min(kept);
                return sum_of_best(self.simd, &self.groups, kept, best) / best as f32;
            }
        }
        self.cost(food, f32::INFINITY)
    }

    /// Finds the costs by which the views are ranked: the geometric ones where surfaces of at least `count`
    /// views agree, else with the photometric ones. Returns whether the photometric costs were computed.
    #[inline(always)]
    fn rank_views(&mut self, food: &FoodSource, count: usize) -> bool {
        self.project(food);
        let missing_cost = self.rules.geometric.missing_cost;
        let agreeing: usize = (self.groups.iter())
            .map(|GroupCosts { projections, costs }| {
                let agrees =
                    |&lane: &usize| projections.inside >> lane & 1 != 0 && costs[lane] < missing_cost;
                (0..LANES).filter(agrees).count()
            })
            .sum();
        let is_matched = count_visible(&self.groups) > count && agreeing < count;
        if is_matched {
            let plane = food.plane(self.problem, self.ray);
            for group in 0..self.groups.len() {
                self.add_photometric_costs(&plane, group);
            }
        }
        is_matched
    }

    /// Keeps the `count` views of lowest rank and writes them to `set`; their costs stay known.
    #[inline(always)]
    fn keep(&mut self, count: usize, set: &mut [u32]) {
        set.fill(0);
        for group in 0..self.groups.len() {
            for (lane, &source) in self.projector.groups()[group].sources().iter().enumerate() {
                if rank_of(self.simd, &self.groups, group, lane) < count
                    && self.groups[group].projections.inside >> lane & 1 != 0
                {
                    ViewSets::insert_into(set, source);
                }
            }
        }
        // What was matched to rank the views is not matched again.
        for (group, costs) in self.projector.groups().iter().zip(&mut self.groups) {
            for (lane, &source) in group.sources().iter().enumerate() {
                costs.projections.inside &= !(u8::from(!ViewSets::holds(set, source)) << lane);
            }
        }
        self.projector.set_views(set);
    }

    /// Projects a hypothesis into the views of the set, and finds its geometric costs.
    #[inline(always)]
    fn project(&mut self, food: &FoodSource) {
        let Evaluator { simd, projector, groups, rules, .. } = self;
        groups.clear();
        for group in projector.groups() {
            let projections = group.project(*simd, food.depth);
            let costs = rules.geometric_costs(*simd, group, &projections, food.depth);
            groups.push(GroupCosts { projections, costs });
        }
    }

    /// Adds the photometric costs of the hypothesis in the views of a group.
    #[inline(always)]
    fn add_photometric_costs(&mut self, plane: &SlantedPlane, group: usize) {
        if !self.has_texture {
            self.groups[group].costs.iter_mut().for_each(|cost| *cost += MAX_COST);
            return;
        }
        // As `cost`, a function of its own.
        self.simd.vectorize(
            #[inline(always)]
            || {
                let Evaluator { simd, window, patch, problem, projector, groups, .. } = self;
                let (group, GroupCosts { projections, costs }) =
                    (&projector.groups()[group], &mut groups[group]);
                let slopes = group.slopes(*simd, plane);
                let photometric = patch_costs(
                    *simd,
                    window,
                    patch,
                    #[inline(always)]
                    |lane| {
                        (problem.sources[group.sources()[lane]].image, projections.homography(&slopes, lane))
                    },
                    projections.inside,
                );
                for (cost, photometric) in costs.iter_mut().zip(photometric) {
                    *cost += photometric;
                }
                self.counts.ncc_evaluations += u64::from(projections.inside.count_ones());
            },
        );
    }

    /// Equation 3 of the paper: the sum over all views, divided by one less than their number; a small set
    /// costs more.
    #[inline(always)]
    fn cost_over_all_views(&mut self, food: &FoodSource, bound: f32) -> f32 {
        let count = count_visible(&self.groups);
        if count <= 1 {
            return f32::INFINITY;
        }
        let plane = food.plane(self.problem, self.ray);
        let divisor = (count - 1) as f32;
        for group in 0..self.groups.len() {
            if sum(self.simd, &self.groups) >= bound * divisor {
                self.counts.early_terminations += 1;
                return f32::INFINITY;
            }
            self.add_photometric_costs(&plane, group);
        }
        sum(self.simd, &self.groups) / divisor
    }

    /// The mean over the best views of the set; views in which the point is hidden do not raise it.
    #[inline(always)]
    fn cost_over_best_views(&mut self, food: &FoodSource, bound: f32, best: usize) -> f32 {
        let count = count_visible(&self.groups);
        if count < self.rules.min_views {
            return f32::INFINITY;
        }
        let plane = food.plane(self.problem, self.ray);
        let best = best.min(count);
        let limit = bound * best as f32;
        let (mut unmatched, is_guided) = (count, self.rules.geometric.weight > 0.0);
        for group in 0..self.groups.len() {
            // Views that are not matched yet and have no geometric cost leave nothing to sum.
            if (is_guided || unmatched < best || limit <= 0.0)
                && sum_of_best(self.simd, &self.groups, count, best) >= limit
            {
                self.counts.early_terminations += 1;
                return f32::INFINITY;
            }
            self.add_photometric_costs(&plane, group);
            unmatched -= self.groups[group].projections.inside.count_ones() as usize;
        }
        sum_of_best(self.simd, &self.groups, count, best) / best as f32
    }
}
