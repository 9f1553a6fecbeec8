//! Matching cost of a hypothesis over the source views of its pixel (section 5.2 of the paper).

use super::aggregation::{InViews, cheaper, seen, sum, sum_of_least};
use super::colony::Colonies;
use super::food_source::{FoodSource, cost_to_beat};
use super::smoothness_term::{SmoothnessRules, Surroundings};
use crate::ambc::Counts;
use crate::geometry::SlantedPlane;
use crate::geometry::ViewSets;
use crate::matching::{Group, Problem, Projections, SourceProjector};
use crate::matching::{MAX_COST, ReferencePatch, Window, patch_costs};
use crate::options::Options;
use crate::simd::{LANES, Simd};
use glam::Vec3;

type Lanes = [f32; LANES];

/// How source views' costs become a hypothesis' cost.
#[derive(Debug, Clone, Copy)]
pub struct CostRules {
    /// Views whose mean is the cost; 0 takes the sum over all (equation 3 of the paper).
    best_views: usize,
    /// Hypotheses in fewer views cost infinitely much.
    min_views: usize,
    noise_ratio: f32,
    geometric: GeometricRules,
    smoothness: SmoothnessRules,
}

/// How disagreement with the source views' validated depths is priced: by its square, which leaves hypotheses that nearly
/// agree to the images, up to a limit, so that a wrong neighbor cannot rule out a good match.
#[derive(Debug, Clone, Copy)]
struct GeometricRules {
    /// Cost of a square of relative disagreement; 0 without the geometric term.
    weight: f32,
    /// Relative disagreement at which it stops growing.
    limit: f32,
    /// Cost where the source has no validated depth.
    unknown: f32,
}

impl CostRules {
    /// The rules of these options; the geometric term needs validated solutions.
    pub fn new(options: &Options, with_geometric_term: bool) -> CostRules {
        let weight = if with_geometric_term { options.cost.geom_consistency_weight } else { 0.0 };
        let max_error = options.cost.geom_consistency_max_error;
        let missing = options.cost.geom_consistency_missing_error.min(max_error) / max_error;
        CostRules {
            best_views: options.cost.best_views as usize,
            min_views: options.min_matched_views(),
            noise_ratio: options.window.min_texture_to_noise as f32,
            geometric: GeometricRules {
                weight: (weight / max_error.powi(2)) as f32,
                limit: max_error as f32,
                unknown: (weight * missing.powi(2)) as f32,
            },
            smoothness: SmoothnessRules {
                weight: options.cost.smoothness_weight as f32,
                depth_scale: options.cost.smoothness_max_depth_error as f32,
                normal_scale: (1.0 - options.cost.smoothness_max_normal_error.to_radians().cos()) as f32,
            },
        }
    }

    /// What a hypothesis of this depth costs in the views of a group by disagreeing with their validated depths.
    #[inline(always)]
    fn geometric_costs<S: Simd>(
        &self,
        simd: S,
        group: &Group,
        projections: &Projections,
        depth: f32,
    ) -> Lanes {
        let GeometricRules { weight, limit, unknown } = self.geometric;
        if weight == 0.0 {
            return [0.0; LANES];
        }
        let surfaces = group.surfaces(simd, projections);
        let depth_there = simd.mul(simd.splat(depth), simd.load(&projections.center[2]));
        let one = simd.splat(1.0);
        let difference = simd.sub(simd.mul(depth_there, simd.load(&surfaces.exact)), one);
        let square = simd.min(simd.mul(difference, difference), simd.splat(limit * limit));
        let known = simd.mul(simd.splat(weight), square);
        simd.store(simd.select(surfaces.known, known, simd.splat(unknown)))
    }
}

/// Evaluates hypotheses of one pixel after the other.
pub struct Evaluator<'a, S: Simd> {
    simd: S,
    problem: &'a Problem<'a>,
    window: &'a Window,
    rules: CostRules,
    patch: ReferencePatch,
    has_texture: bool,
    is_weak: bool,
    ray: Vec3,
    gray: u8,
    projector: SourceProjector<'a, S>,
    /// One for each group of the pixel's views.
    views: Vec<InViews>,
    surroundings: Surroundings,
    /// Work done so far.
    pub counts: Counts,
}

impl<'a, S: Simd> Evaluator<'a, S> {
    /// An evaluator that stands at no pixel yet.
    pub fn new(simd: S, problem: &'a Problem<'a>, window: &'a Window, rules: CostRules) -> Evaluator<'a, S> {
        Evaluator {
            simd,
            problem,
            window,
            rules,
            patch: ReferencePatch::new(window),
            has_texture: false,
            is_weak: false,
            ray: Vec3::Z,
            gray: 0,
            projector: SourceProjector::new(simd, problem),
            views: Vec::with_capacity(problem.sources.len().div_ceil(LANES)),
            surroundings: Surroundings::new(rules.smoothness),
            counts: Counts::default(),
        }
    }

    /// The reference view.
    #[inline(always)]
    pub fn problem(&self) -> &'a Problem<'a> {
        self.problem
    }

    /// The ray of the pixel.
    #[inline(always)]
    pub fn ray(&self) -> Vec3 {
        self.ray
    }

    /// Goes to a pixel and takes the source views of `set` for it.
    #[inline(always)]
    pub fn go_to(&mut self, x: usize, y: usize, set: &[u32]) {
        self.patch.sample(self.simd, self.window, self.problem.image, x, y);
        self.has_texture = self.patch.has_texture(self.window);
        self.gray = self.problem.image.gray(x, y);
        let noise = self.problem.image.noise.variance(self.gray);
        self.is_weak = self.patch.variance() < self.rules.noise_ratio * noise;
        let (x, y) = (x as f32, y as f32);
        self.ray = self.problem.ray(x, y);
        self.projector.set_pixel_and_views(x, y, set);
    }

    /// Lets the planes of the pixel's neighbors have a say.
    #[inline(always)]
    pub fn look_around(&mut self, neighbors: &Colonies, (x, y): (usize, usize)) {
        self.surroundings.look(self.problem, self.window, neighbors, (x, y));
    }

    /// How alike the pixel and another one look, from 0 to 1: the bilateral weight of their gray values.
    #[inline(always)]
    pub fn likeness(&self, x: usize, y: usize) -> f32 {
        self.window.likeness(self.gray, self.problem.image.gray(x, y))
    }

    /// Whether the pixel's patch can be matched.
    #[inline(always)]
    pub fn has_texture(&self) -> bool {
        self.has_texture
    }

    /// Whether the pixel's patch varies no more than noise does: nothing can be learned from matching it.
    #[inline(always)]
    pub fn is_weak(&self) -> bool {
        self.is_weak
    }

    /// The cost of a hypothesis if it is below `bound`, else infinity: costs are not negative, so the sum over views
    /// stops as soon as it cannot stay below.
    #[inline(always)]
    pub fn cost(&mut self, food: &FoodSource, bound: f32) -> f32 {
        // A function of its own, also within what is compiled for the instruction set already: it is long, and called from
        // many places.
        let cost = self.simd.vectorize(
            #[inline(always)]
            || {
                self.place(food);
                match self.rules.best_views {
                    0 => self.all_views(food, bound),
                    count => self.best_views(food, bound, count),
                }
            },
        );
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
        self.place(food);
        let plane = food.plane(self.problem, self.ray);
        let (mut sum, mut count) = (0.0, 0);
        for group in 0..self.views.len() {
            self.views[group].least = [0.0; LANES];
            self.add_photometric_costs(&plane, group);
            let InViews { projections, least } = &self.views[group];
            for (lane, cost) in least.iter().enumerate() {
                if projections.inside >> lane & 1 != 0 {
                    (sum, count) = (sum + cost, count + 1);
                }
            }
        }
        if count == 0 { MAX_COST } else { sum / count as f32 }
    }

    /// Keeps, for the hypotheses to come, only `count` views, writes them to `set` and gives the cost of this one: the
    /// views whose validated surfaces agree best with it, or, where too few do, those in which it costs least.
    #[inline(always)]
    pub fn focus(&mut self, food: &FoodSource, count: usize, set: &mut [u32]) -> f32 {
        self.place(food);
        let unknown = self.rules.geometric.unknown;
        let agreeing: usize = (self.views.iter())
            .map(|InViews { projections, least }| {
                (0..LANES)
                    .filter(|&lane| projections.inside >> lane & 1 != 0 && least[lane] < unknown)
                    .count()
            })
            .sum();
        let all = seen(&self.views);
        let is_matched = all > count && agreeing < count;
        if is_matched {
            let plane = food.plane(self.problem, self.ray);
            for group in 0..self.views.len() {
                self.add_photometric_costs(&plane, group);
            }
        }
        let kept = all.min(count);
        if kept >= self.rules.min_views {
            set.fill(0);
            for group in 0..self.views.len() {
                for (lane, &source) in self.projector.groups()[group].sources().iter().enumerate() {
                    if cheaper(self.simd, &self.views, group, lane) < kept
                        && self.views[group].projections.inside >> lane & 1 != 0
                    {
                        ViewSets::insert_into(set, source);
                    }
                }
            }
            // What was matched to choose the views is not matched again.
            for (group, view) in self.projector.groups().iter().zip(&mut self.views) {
                for (lane, &source) in group.sources().iter().enumerate() {
                    view.projections.inside &= !(u8::from(!ViewSets::holds(set, source)) << lane);
                }
            }
            self.projector.set_views(set);
            if self.rules.best_views > 0 && is_matched {
                let best = self.rules.best_views.min(kept);
                return sum_of_least(self.simd, &self.views, kept, best) / best as f32;
            }
        }
        self.cost(food, f32::INFINITY)
    }

    /// Finds where a hypothesis falls in the views of the set. A view whose image its center leaves does not count.
    #[inline(always)]
    fn place(&mut self, food: &FoodSource) {
        let Evaluator { simd, projector, views, rules, .. } = self;
        views.clear();
        for group in projector.groups() {
            let projections = group.project(*simd, food.depth);
            let least = rules.geometric_costs(*simd, group, &projections, food.depth);
            views.push(InViews { projections, least });
        }
    }

    /// Adds what the hypothesis costs in the views of a group by their images.
    #[inline(always)]
    fn add_photometric_costs(&mut self, plane: &SlantedPlane, group: usize) {
        if !self.has_texture {
            self.views[group].least.iter_mut().for_each(|least| *least += MAX_COST);
            return;
        }
        // As `cost`, a function of its own.
        self.simd.vectorize(
            #[inline(always)]
            || {
                let Evaluator { simd, window, patch, problem, projector, views, .. } = self;
                let (group, InViews { projections, least }) = (&projector.groups()[group], &mut views[group]);
                let slopes = group.slopes(*simd, plane);
                let costs = patch_costs(
                    *simd,
                    window,
                    patch,
                    #[inline(always)]
                    |lane| {
                        (problem.sources[group.sources()[lane]].image, projections.homography(&slopes, lane))
                    },
                    projections.inside,
                );
                for (least, cost) in least.iter_mut().zip(costs) {
                    *least += cost;
                }
                self.counts.ncc_evaluations += u64::from(projections.inside.count_ones());
            },
        );
    }

    /// Equation 3 of the paper: a small set is penalized.
    #[inline(always)]
    fn all_views(&mut self, food: &FoodSource, bound: f32) -> f32 {
        let count = seen(&self.views);
        if count <= 1 {
            return f32::INFINITY;
        }
        let plane = food.plane(self.problem, self.ray);
        let divisor = (count - 1) as f32;
        for group in 0..self.views.len() {
            if sum(self.simd, &self.views) >= bound * divisor {
                self.counts.early_terminations += 1;
                return f32::INFINITY;
            }
            self.add_photometric_costs(&plane, group);
        }
        sum(self.simd, &self.views) / divisor
    }

    /// The mean over the best views of the set; views that cannot see the point do not raise it.
    #[inline(always)]
    fn best_views(&mut self, food: &FoodSource, bound: f32, best: usize) -> f32 {
        let count = seen(&self.views);
        if count < self.rules.min_views {
            return f32::INFINITY;
        }
        let plane = food.plane(self.problem, self.ray);
        let best = best.min(count);
        let limit = bound * best as f32;
        let (mut unmatched, is_guided) = (count, self.rules.geometric.weight > 0.0);
        for group in 0..self.views.len() {
            // Views that are not matched yet and cost nothing else leave nothing to sum.
            if (is_guided || unmatched < best || limit <= 0.0)
                && sum_of_least(self.simd, &self.views, count, best) >= limit
            {
                self.counts.early_terminations += 1;
                return f32::INFINITY;
            }
            self.add_photometric_costs(&plane, group);
            unmatched -= self.views[group].projections.inside.count_ones() as usize;
        }
        sum_of_least(self.simd, &self.views, count, best) / best as f32
    }
}
