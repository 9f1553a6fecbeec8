//! The presets.

use super::{
    CheckOptions, CostOptions, FusionOptions, InputOptions, Options, OutputOptions, RefineOptions, Scale,
    ScheduleOptions, SearchOptions, ViewSelectionOptions, WindowOptions,
};
use crate::error::{Error, Result};

impl Options {
    /// Names of the presets.
    pub const PRESETS: [&'static str; 3] = ["default", "fast", "paper"];

    /// The preset of this name.
    ///
    /// # Errors
    /// No such preset.
    pub fn preset(name: &str) -> Result<Options> {
        match name {
            "default" => Ok(Options::default()),
            "fast" => Ok(Options::fast()),
            "paper" => Ok(Options::paper()),
            _ => Err(Error::argument("preset", name, format!("one of {}", Self::PRESETS.join(", ")))),
        }
    }

    /// The paper as literally as its text allows; the table at the end of how_it_works
    /// says where the paper leaves something open.
    pub fn paper() -> Options {
        Options {
            seed: 0,
            threads: 0,
            memory: 0,
            simd: None,
            input: InputOptions::default(),
            schedule: ScheduleOptions {
                // FoodNumber is the paper's; it never gives its numbers of iterations and cycles.
                scales: vec![scale(1, 10, 20, (3, 2))],
                min_changed_fraction: 0.01,
            },
            window: WindowOptions {
                window_radius: 5,
                full_size_window_radius: 0,
                window_step: 2,
                circular_window: false,
                sigma_spatial: 5.0,
                sigma_color: 0.2,
                min_variance: 1e-5,
                min_texture_to_noise: 0.0,
            },
            cost: CostOptions {
                best_views: 0,
                max_views_per_pixel: 0,
                geom_consistency_weight: 0.0,
                geom_consistency_max_error: 0.03,
                geom_consistency_missing_error: 0.015,
                smoothness_weight: 0.0,
                smoothness_max_depth_error: 0.01,
                smoothness_max_normal_error: 40.0,
            },
            search: SearchOptions {
                trial_limit: 10,
                employed_bees: 64,
                later_employed_bees: 64,
                onlooker_tournament_size: 1,
                local_plane_tolerance: 0.0,
                depth_perturbation: 0.0,
                normal_perturbation: 0.0,
                smoothness_reward: 0.05,
                view_propagation: true,
            },
            view_selection: ViewSelectionOptions {
                pixelwise_view_selection: true,
                min_triangulation_angle: 10.0,
                max_triangulation_angle: 30.0,
                min_sources: 0,
                max_sources: 0,
                max_incident_angle: 80.0,
                occlusion_tolerance: 0.01,
            },
            check: CheckOptions {
                // The paper's 0.01 mm is impossible on a scene of 600 mm; its fusion calls the difference
                // relative.
                depth_tolerance: 0.01,
                normal_tolerance: 30.0,
                reprojection_tolerance: 0.0,
                slant_tolerance: 0.0,
                min_consistent_views: 2,
                min_consistent_fraction: 0.7,
                few_views: 0,
                ignore_occluders: false,
            },
            refine: RefineOptions {
                fattening_passes: 0,
                smoothing_passes: 0,
                cross_view_averaging: false,
                fill_gaps: false,
                max_speckle_size: 0,
            },
            fusion: FusionOptions {
                depth_tolerance: 0.01,
                normal_tolerance: 30.0,
                reprojection_tolerance: 0.0,
                min_agreeing_views: 4,
                min_agreeing_fraction: 0.0,
                min_confidence: 0.0,
                compensate_exposure: false,
                voxel_size: 0.0,
                max_points: 0,
            },
            output: OutputOptions::default(),
        }
    }

    /// Most of the search on half size, one iteration at full size, fewer source views; planes are taken from
    /// the neighborhood more often. For previews, or where time is limited.
    pub fn fast() -> Options {
        let default = Options::default();
        Options {
            schedule: ScheduleOptions {
                scales: vec![scale(2, 2, 4, (3, 1)), scale(1, 2, 0, (0, 1))],
                ..default.schedule
            },
            cost: CostOptions {
                best_views: 3,
                max_views_per_pixel: 4,
                smoothness_weight: 0.2,
                ..default.cost
            },
            search: SearchOptions {
                depth_perturbation: 0.005,
                onlooker_tournament_size: 6,
                local_plane_tolerance: 0.03,
                ..default.search
            },
            view_selection: ViewSelectionOptions { max_sources: 8, ..default.view_selection },
            refine: RefineOptions { smoothing_passes: 2, ..default.refine },
            ..default
        }
    }
}

impl Default for Options {
    /// The values of the best measured accuracy.
    fn default() -> Options {
        let paper = Options::paper();
        Options {
            schedule: ScheduleOptions {
                scales: vec![scale(2, 3, 5, (4, 1)), scale(1, 2, 1, (2, 1))],
                ..paper.schedule
            },
            window: WindowOptions {
                full_size_window_radius: 3,
                circular_window: true,
                sigma_spatial: 3.0,
                sigma_color: 0.03,
                min_texture_to_noise: 2.5,
                ..paper.window
            },
            cost: CostOptions {
                best_views: 4,
                max_views_per_pixel: 5,
                geom_consistency_weight: 0.3,
                geom_consistency_max_error: 0.02,
                geom_consistency_missing_error: 0.0175,
                smoothness_weight: 0.1,
                ..paper.cost
            },
            search: SearchOptions {
                employed_bees: 1,
                later_employed_bees: 0,
                onlooker_tournament_size: 3,
                local_plane_tolerance: 0.02,
                depth_perturbation: 0.01,
                normal_perturbation: 0.3,
                ..paper.search
            },
            view_selection: ViewSelectionOptions {
                min_triangulation_angle: 3.0,
                max_triangulation_angle: 60.0,
                min_sources: 6,
                max_sources: 12,
                ..paper.view_selection
            },
            check: CheckOptions {
                reprojection_tolerance: 1.25,
                slant_tolerance: 1.0,
                min_consistent_fraction: 0.5,
                few_views: 2,
                ignore_occluders: true,
                ..paper.check
            },
            refine: RefineOptions {
                fattening_passes: 2,
                smoothing_passes: 1,
                cross_view_averaging: true,
                fill_gaps: true,
                max_speckle_size: 30,
            },
            fusion: FusionOptions {
                reprojection_tolerance: 1.25,
                min_agreeing_views: 3,
                min_agreeing_fraction: 0.5,
                compensate_exposure: true,
                ..paper.fusion
            },
            ..paper
        }
    }
}

fn scale(
    downscale: u32,
    food_sources: u32,
    first_iterations: u32,
    (cycles, cycle_iterations): (u32, u32),
) -> Scale {
    Scale { downscale, food_sources, first_iterations, cycles, cycle_iterations }
}
