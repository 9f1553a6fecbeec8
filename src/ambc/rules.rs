//! The numbers a search depends on, in the form in which it uses them.

use crate::options::{Options, Scale};
use crate::view_selection::ViewRules;

/// The rules of the search of one view in one cycle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchRules {
    /// The cost of a plane.
    pub cost: CostRules,
    /// The view set of a pixel.
    pub view_set: ViewRules,
    /// Food sources of each colony.
    pub food_sources: usize,
    /// Iterations of employed, onlooker and scout bees.
    pub iterations: u32,
    /// Failed attempts after which a scout bee may replace a food source.
    pub trial_limit: u16,
    /// Food sources of each colony, best first, that employed bees perturb.
    pub employed_bees: usize,
    /// How onlooker bees choose.
    pub onlookers: OnlookerRules,
    /// Relative inverse-depth error up to which a neighbor takes part in the local plane fit; 0 fits no
    /// planes.
    pub local_plane_tolerance: f32,
    /// Views that a pixel with a previous estimate is matched with; 0 takes its whole view set.
    pub max_views_per_pixel: usize,
    /// How far from the previous estimate food sources start; depth 0 starts them at random.
    pub perturbation: Perturbation,
}

/// Half the ranges in which planes are perturbed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Perturbation {
    /// Of the inverse depth, relative.
    pub depth: f32,
    /// Of each component of the normal.
    pub normal: f32,
}

/// The rules of the cost.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CostRules {
    /// Views whose mean is the cost; 0 takes the sum over all (equation 3 of the paper).
    pub best_views: usize,
    /// Hypotheses visible in fewer views cost infinitely much.
    pub min_views: usize,
    /// Ratio of the patch's variance to the image noise under which the patch is textureless.
    pub min_texture_to_noise: f32,
    /// The penalty of disagreement with other views.
    pub geometric: GeometricRules,
    /// The penalty of disagreement with neighbors.
    pub smoothness: SmoothnessRules,
}

/// The penalty of disagreement with the source views' validated surfaces, quadratic up to a limit: hypotheses
/// that nearly agree are left to the images, and a wrong neighbor cannot rule out a good match.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GeometricRules {
    /// Cost of a squared relative depth error; 0 turns the term off.
    pub weight: f32,
    /// Relative depth error at the limit.
    pub max_error: f32,
    /// Cost where the source view has no validated depth.
    pub missing_cost: f32,
}

/// The penalty of disagreement with neighbors, quadratic up to a limit: planes that nearly agree are left to
/// the images.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SmoothnessRules {
    /// Cost at the limit against all four neighbors; 0 turns the term off.
    pub weight: f32,
    /// Relative depth error at the limit.
    pub max_depth_error: f32,
    /// `1 - cos` of the angle between normals at the limit.
    pub max_normal_error: f32,
}

/// How onlookers choose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OnlookerRules {
    /// Fitness bonus of validated planes (section 5.6 of the paper).
    pub reward: f32,
    /// Random neighbors of which the one of lowest cost is visited; the paper's onlookers visit the first.
    pub tournament_size: u32,
}

impl SearchRules {
    /// The rules of a cycle on a scale; a guided search is one for which some view has a checked estimate.
    pub(crate) fn new(options: &Options, scale: &Scale, cycle_on_scale: u32, is_guided: bool) -> SearchRules {
        let search = &options.search;
        // The paper starts no set again: its cost is infinite then.
        let min_views = if options.cost.best_views == 0 { 0 } else { options.min_matched_views() };
        let (employed_bees, local_plane_tolerance) = match is_guided {
            true => (search.later_employed_bees, 0.0),
            false => (search.employed_bees, search.local_plane_tolerance as f32),
        };
        let shrink = 0.5f64.powi(cycle_on_scale.min(64) as i32);
        SearchRules {
            cost: CostRules::new(options, is_guided),
            view_set: ViewRules::new(options, min_views),
            food_sources: scale.food_sources as usize,
            iterations: if cycle_on_scale == 0 { scale.first_iterations } else { scale.cycle_iterations },
            trial_limit: search.trial_limit.min(u32::from(u16::MAX)) as u16,
            employed_bees: employed_bees as usize,
            onlookers: OnlookerRules {
                reward: search.smoothness_reward as f32,
                tournament_size: search.onlooker_tournament_size,
            },
            local_plane_tolerance,
            max_views_per_pixel: options.cost.max_views_per_pixel as usize,
            perturbation: Perturbation {
                depth: (search.depth_perturbation * shrink) as f32,
                normal: (search.normal_perturbation * shrink) as f32,
            },
        }
    }
}

impl CostRules {
    /// The rules of these options; the geometric term needs published surfaces.
    pub(crate) fn new(options: &Options, with_geometric_term: bool) -> CostRules {
        let cost = &options.cost;
        let weight = if with_geometric_term { cost.geom_consistency_weight } else { 0.0 };
        let max_error = cost.geom_consistency_max_error;
        let missing_error = cost.geom_consistency_missing_error.min(max_error) / max_error;
        CostRules {
            best_views: cost.best_views as usize,
            min_views: options.min_matched_views(),
            min_texture_to_noise: options.window.min_texture_to_noise as f32,
            geometric: GeometricRules {
                weight: (weight / max_error.powi(2)) as f32,
                max_error: max_error as f32,
                missing_cost: (weight * missing_error.powi(2)) as f32,
            },
            smoothness: SmoothnessRules {
                weight: cost.smoothness_weight as f32,
                max_depth_error: cost.smoothness_max_depth_error as f32,
                max_normal_error: (1.0 - cost.smoothness_max_normal_error.to_radians().cos()) as f32,
            },
        }
    }
}
