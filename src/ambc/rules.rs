//! The numbers a search depends on, in the form in which it uses them.

use super::cost::CostRules;
use super::onlooker::OnlookerRules;
use crate::options::{Options, Scale};
use crate::view_selection::ViewRules;

/// The rules of the search of one view in one cycle.
#[derive(Debug, Clone, Copy)]
pub struct SearchRules {
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
    /// Relative inverse-depth error up to which a neighbor takes part in the local plane fit; 0 fits no planes.
    pub local_plane_tolerance: f32,
    /// Views that a pixel with a previous estimate is matched with; 0 takes its whole view set.
    pub max_views_per_pixel: usize,
    /// How far from the previous estimate food sources start; depth 0 starts them at random.
    pub perturbation: Perturbation,
}

/// Half the ranges in which planes are perturbed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perturbation {
    /// Of the inverse depth, relative.
    pub depth: f32,
    /// Of each component of the normal.
    pub normal: f32,
}

impl SearchRules {
    /// The rules of a cycle on a scale; a guided search is one for which some view has a checked estimate.
    pub fn new(options: &Options, scale: &Scale, cycle_on_scale: u32, is_guided: bool) -> SearchRules {
        let search = &options.search;
        // The paper starts no set again: its cost is infinite then.
        let min_views = if options.cost.best_views == 0 { 0 } else { options.min_matched_views() };
        let employed_bees = if is_guided { search.employed_bees as usize } else { 0 };
        let shrink = 0.5f64.powi(cycle_on_scale.min(64) as i32);
        SearchRules {
            cost: CostRules::new(options, is_guided),
            view_set: ViewRules::new(options, min_views),
            food_sources: scale.food_sources as usize,
            iterations: if cycle_on_scale == 0 { scale.first_iterations } else { scale.cycle_iterations },
            trial_limit: search.trial_limit.min(u32::from(u16::MAX)) as u16,
            employed_bees: if employed_bees == 0 { usize::MAX } else { employed_bees },
            onlookers: OnlookerRules {
                reward: search.smoothness_reward as f32,
                tournament_size: search.onlooker_tournament_size,
            },
            local_plane_tolerance: search.local_plane_tolerance as f32,
            max_views_per_pixel: options.cost.max_views_per_pixel as usize,
            perturbation: Perturbation {
                depth: (search.depth_perturbation * shrink) as f32,
                normal: (search.normal_perturbation * shrink) as f32,
            },
        }
    }
}
