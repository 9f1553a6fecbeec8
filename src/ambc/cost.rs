//! Matching cost of a hypothesis over the source views of its pixel (section 5.2 of the paper).

use super::food::FoodSource;
use crate::kernels::{MAX_COST, ReferencePatch, Window, patch_cost};
use crate::maps::Counts;
use crate::options::{Aggregation, Options};
use crate::simd::Simd;
use crate::views::{Reference, Source, ViewSets};
use glam::Vec3;

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

/// A source view of the pixel at work.
#[derive(Debug, Clone, Copy)]
struct PixelView {
    source: usize,
    at_infinity: Vec3,
}

/// A source view that has the hypothesis at work in its image, with the least its cost can be.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    view: usize,
    least: f32,
}

/// Evaluates hypotheses of one pixel after the other.
pub struct Evaluator<'a, S: Simd> {
    simd: S,
    reference: &'a Reference<'a>,
    window: &'a Window,
    rules: CostRules,
    patch: ReferencePatch,
    ray: Vec3,
    views: Vec<PixelView>,
    candidates: Vec<Candidate>,
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
            ray: Vec3::Z,
            views: Vec::new(),
            candidates: Vec::new(),
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
        let (x, y) = (x as f32, y as f32);
        self.ray = self.reference.ray(x, y);
        self.views.clear();
        let sources = &self.reference.sources;
        self.views.extend(
            ViewSets::iter_words(set)
                .map(|source| PixelView { source, at_infinity: sources[source].pose.at_infinity(x, y) }),
        );
    }

    /// Whether the pixel's patch can be matched.
    #[inline(always)]
    pub fn has_texture(&self) -> bool {
        self.patch.has_texture(self.window)
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

    /// The mean of `1 - NCC` over the views that have the hypothesis in their image: the confidence.
    #[inline(always)]
    pub fn mean_photometric_cost(&mut self, food: &FoodSource) -> f32 {
        self.find_candidates(food);
        let mut sum = 0.0;
        for index in 0..self.candidates.len() {
            sum += self.photometric_cost(food, self.candidates[index].view);
        }
        if self.candidates.is_empty() { MAX_COST } else { sum / self.candidates.len() as f32 }
    }

    /// Keeps, for the hypotheses to come, only the `count` views in which this one costs least; writes them to `set`.
    #[inline(always)]
    pub fn focus(&mut self, food: &FoodSource, count: usize, set: &mut [u32]) {
        self.find_candidates(food);
        if self.candidates.len() > count {
            for index in 0..self.candidates.len() {
                self.candidates[index].least += self.photometric_cost(food, self.candidates[index].view);
            }
            self.candidates.sort_by(|a, b| a.least.total_cmp(&b.least));
            self.candidates.truncate(count);
        }
        if self.candidates.len() >= self.rules.min_views {
            self.candidates.sort_by_key(|candidate| candidate.view);
            for (place, candidate) in self.candidates.iter().enumerate() {
                self.views[place] = self.views[candidate.view];
            }
            self.views.truncate(self.candidates.len());
        }
        set.fill(0);
        for view in &self.views {
            ViewSets::insert_into(set, view.source);
        }
    }

    /// A view whose image the hypothesis' centre leaves does not count for it.
    #[inline(always)]
    fn find_candidates(&mut self, food: &FoodSource) {
        let inverse_depth = 1.0 / food.depth;
        self.candidates.clear();
        for (view, pixel) in self.views.iter().enumerate() {
            let source = &self.reference.sources[pixel.source];
            let point = pixel.at_infinity + source.pose.epipole * inverse_depth;
            if let Some(at) = source.project(point) {
                let least = self.rules.geometric_cost(source, at.x, at.y, point.z * food.depth);
                self.candidates.push(Candidate { view, least });
            }
        }
    }

    #[inline(always)]
    fn photometric_cost(&mut self, food: &FoodSource, view: usize) -> f32 {
        if !self.has_texture() {
            return MAX_COST;
        }
        self.counts.ncc_evaluations += 1;
        let plane = food.plane(self.reference, self.ray);
        let PixelView { source, at_infinity } = self.views[view];
        let source = &self.reference.sources[source];
        let homography = source.pose.homography(at_infinity, &plane);
        patch_cost(self.simd, self.window, &self.patch, source.image, &homography)
    }

    /// Equation 3 of the paper: a small set is penalised.
    #[inline(always)]
    fn all_views(&mut self, food: &FoodSource, bound: f32) -> f32 {
        let count = self.candidates.len();
        if count <= 1 {
            return f32::INFINITY;
        }
        let divisor = (count - 1) as f32;
        let mut sum: f32 = self.candidates.iter().map(|candidate| candidate.least).sum();
        for index in 0..count {
            if sum >= bound * divisor {
                self.counts.early_outs += 1;
                return f32::INFINITY;
            }
            sum += self.photometric_cost(food, self.candidates[index].view);
        }
        sum / divisor
    }

    /// The mean over the best views of the set; views that cannot see the point do not raise it.
    #[inline(always)]
    fn best_views(&mut self, food: &FoodSource, bound: f32, best: usize) -> f32 {
        let count = self.candidates.len();
        if count < self.rules.min_views {
            return f32::INFINITY;
        }
        let best = best.min(count);
        let limit = bound * best as f32;
        for index in 0..count {
            if sum_of_least(&self.candidates, best) >= limit {
                self.counts.early_outs += 1;
                return f32::INFINITY;
            }
            self.candidates[index].least += self.photometric_cost(food, self.candidates[index].view);
        }
        sum_of_least(&self.candidates, best) / best as f32
    }
}

/// The sum of the `best` smallest costs.
#[inline(always)]
fn sum_of_least(candidates: &[Candidate], best: usize) -> f32 {
    let mut least = [f32::INFINITY; MAX_BEST_VIEWS];
    for candidate in candidates {
        let mut cost = candidate.least;
        // Without branches: which costs are small cannot be predicted.
        for place in &mut least[..best] {
            let (smaller, larger) = (place.min(cost), place.max(cost));
            (*place, cost) = (smaller, larger);
        }
    }
    least[..best].iter().sum()
}
