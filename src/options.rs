//! Every number the method depends on, and the two presets.

mod table;

use crate::error::{Error, Result};
use crate::simd::Level;
use table::{Kind, TABLE};

/// The search on one scale of the pyramid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scale {
    /// How often the images are halved: 0 is full size, 1 half, 2 a quarter.
    pub halvings: u32,
    /// Food sources of each colony (FoodNumber), at least 2.
    pub foods: u32,
    /// Iterations of the first cycle on this scale (employed, onlooker and scout bees once each).
    pub first_iterations: u32,
    /// Cycles after the first; a geometric consistency check follows every cycle.
    pub cycles: u32,
    /// Iterations of each of those cycles.
    pub cycle_iterations: u32,
}

/// Cost of a hypothesis over a pixel's view set S.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aggregation {
    /// The sum over S divided by |S| - 1, infinite for |S| <= 1 (equation 3 of the paper).
    AllViews,
    /// The mean over the best k views of S, 1 to 8: views that cannot see the point yet do not count.
    BestViews(u32),
}

/// How fused points are accepted (section 6 of the paper).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FusionOptions {
    /// Largest relative difference of depths that agree.
    pub depth_tolerance: f64,
    /// Largest angle between normals that agree, in degrees.
    pub normal_tolerance: f64,
    /// Other views that must agree.
    pub min_views: u32,
}

impl FusionOptions {
    /// Refuses values no fusion can be made with, naming the option.
    pub fn check(&self) -> Result<()> {
        Kind::Number(0.0, 1.0).check("fusion.depth_tolerance", self.depth_tolerance)?;
        Kind::Number(0.0, 180.0).check("fusion.normal_tolerance", self.normal_tolerance)
    }
}

/// All options. Start from a preset; every field may be changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the random generator; the same seed gives the same bits.
    pub seed: u64,
    /// Worker threads; 0 takes one for each core.
    pub threads: usize,
    /// Instruction set of the kernels; `None` takes the best there is. The result does not depend on it.
    pub simd: Option<Level>,

    /// The scales from coarse to fine; the last must be full size.
    pub scales: Vec<Scale>,
    /// A food source tried more often than this without improving may be replaced by a scout bee.
    pub trial_limit: u32,
    /// A scale ends early once fewer than this share of the pixels changed in a cycle.
    pub stop_share: f64,

    /// Half the side of the square window, in pixels.
    pub window_radius: u32,
    /// The same at full size after coarser scales, where the window is a square; 0 for [`Options::window_radius`] there
    /// too.
    pub finest_window_radius: u32,
    /// Distance between samples of the window, in pixels.
    pub window_step: u32,
    /// Whether its corners are left out: a disc of samples instead of a square.
    pub round_window: bool,
    /// Spatial sigma of the bilateral weight, in pixels.
    pub spatial_sigma: f64,
    /// Colour sigma of the bilateral weight, intensities in [0, 1].
    pub colour_sigma: f64,
    /// Weighted variance under which a window has no texture and costs 2, intensities in [0, 1].
    pub min_variance: f64,
    /// A window whose variance is less than this many times that of its image's noise is not matched: its pixel takes
    /// what the surfaces around it go on to. 0 matches all (`paper`).
    pub noise_ratio: f64,
    /// How the costs of the source views become one.
    pub aggregation: Aggregation,
    /// From the second cycle on a pixel is matched only with this many views of its set, those in which its solution
    /// costs least; 0 takes the whole set.
    pub focused_views: u32,
    /// Half the range of relative inverse depth in which the colonies of later cycles start around a validated solution,
    /// halved with every cycle of a scale; where nothing is validated one food source starts there and the rest at
    /// random. 0 starts all at random (`paper`).
    pub restart_spread: f64,
    /// How far the normals of those colonies are tilted, as the half side of a cube added to the unit normal.
    pub restart_tilt: f64,

    /// Cost of a plane that the validated planes of all four neighbours contradict, where they look alike; 0 for no
    /// smoothness (`paper`).
    pub smoothness: f64,
    /// Relative difference of depths that contradicts altogether; smaller ones by their square.
    pub smoothness_depth: f64,
    /// Angle between normals that contradicts altogether, in degrees.
    pub smoothness_normal: f64,

    /// Food sources of each colony, the best first, that employed bees work on from the second cycle on; 0 for all of
    /// them (`paper`).
    pub employed_foods: u32,
    /// Neighbours drawn at random of which an onlooker bee visits the one of the cheapest plane, those that look different
    /// reckoned dearer; 1 in `paper`.
    pub neighbours_drawn: u32,
    /// Relative difference of inverse depths up to which a neighbour's depth continues the plane of a pixel: in every
    /// iteration the plane fitted to such depths is tried. 0 tries none (`paper`).
    pub plane_fit: f64,

    /// How often validated pixels that look more like a surface behind theirs are given to that one, after the last check
    /// of each scale; 0 for never (`paper`).
    pub edge_passes: u32,
    /// How often the validated planes are averaged with those around them that continue the same surface, after every
    /// check; 0 for never (`paper`).
    pub smoothing_passes: u32,
    /// Whether the validated planes are averaged with those that the source views found of the same surface after the
    /// last check; not in `paper`.
    pub average_views: bool,
    /// Whether pixels without a validated solution are offered the plane of the surface around them after the last check;
    /// not in `paper`.
    pub close_gaps: bool,

    /// Whether the view set of each pixel is refined by incidence and visibility. Off keeps the start set.
    pub view_selection: bool,
    /// Triangulation angles of the start set, in degrees.
    pub triangulation_angle: (f64, f64),
    /// At most this many source views a reference view, those of the smallest triangulation angles; 0 takes all.
    pub max_sources: u32,
    /// Largest angle between normal and the ray to a source view, in degrees.
    pub max_incident_angle: f64,
    /// A point is occluded when a validated depth lies in front of it by more than this share.
    pub occlusion_margin: f64,

    /// Fitness added, in the comparison only, to a plane offered by a validated neighbour; 0 is none.
    pub reward: f64,
    /// Whether consistent solutions are offered to other views.
    pub propagation: bool,

    /// Cost of a plane that a source's validated depth contradicts altogether; 0 is none (`paper`).
    pub geometric_weight: f64,
    /// Relative difference of depths that contradicts altogether, in percent; smaller ones by their square.
    pub geometric_limit: f64,
    /// Difference assumed where the source has no validated depth, in percent.
    pub geometric_unknown: f64,

    /// Largest relative difference of depths that are consistent.
    pub depth_tolerance: f64,
    /// Largest angle between normals that are consistent, in degrees.
    pub normal_tolerance: f64,
    /// Sources that must be consistent for a solution to be validated. With 1 (and [`Aggregation::BestViews`]) a single
    /// source view is enough to match a pixel, as scenes of two views need; otherwise it takes two.
    pub min_consistent: u32,
    /// Share of the pixel's sources that must be consistent.
    pub consistent_share: f64,
    /// Whether a source whose own depth lies clearly in front abstains: it may be the occluder.
    pub occluders_abstain: bool,

    /// Fusion.
    pub fusion: FusionOptions,
}

impl Options {
    /// Names of the presets.
    pub const PRESETS: [&'static str; 3] = ["default", "fast", "paper"];

    /// The preset of this name.
    pub fn preset(name: &str) -> Result<Options> {
        match name {
            "default" => Ok(Options::default()),
            "fast" => Ok(Options::fast()),
            "paper" => Ok(Options::paper()),
            _ => Err(Error::argument("preset", name, format!("one of {}", Self::PRESETS.join(", ")))),
        }
    }

    /// The paper as literally as its text allows; what it leaves open is said at each option.
    pub fn paper() -> Options {
        Options {
            seed: 0,
            threads: 0,
            simd: None,
            // FoodNumber is the paper's; it never gives its numbers of iterations and cycles.
            scales: vec![Scale {
                halvings: 0,
                foods: 10,
                first_iterations: 20,
                cycles: 3,
                cycle_iterations: 2,
            }],
            trial_limit: 10,
            stop_share: 0.01,
            window_radius: 5,
            finest_window_radius: 0,
            window_step: 2,
            round_window: false,
            spatial_sigma: 5.0,
            colour_sigma: 0.2,
            min_variance: 1e-5,
            noise_ratio: 0.0,
            aggregation: Aggregation::AllViews,
            focused_views: 0,
            restart_spread: 0.0,
            restart_tilt: 0.0,
            smoothness: 0.0,
            smoothness_depth: 0.01,
            smoothness_normal: 40.0,
            employed_foods: 0,
            neighbours_drawn: 1,
            plane_fit: 0.0,
            edge_passes: 0,
            smoothing_passes: 0,
            average_views: false,
            close_gaps: false,
            view_selection: true,
            triangulation_angle: (10.0, 30.0),
            max_sources: 0,
            max_incident_angle: 80.0,
            occlusion_margin: 0.01,
            reward: 0.05,
            propagation: true,
            geometric_weight: 0.0,
            geometric_limit: 3.0,
            geometric_unknown: 1.5,
            // The paper's 0.01 mm is impossible on a scene of 600 mm; its fusion calls the difference relative.
            depth_tolerance: 0.01,
            normal_tolerance: 30.0,
            min_consistent: 2,
            consistent_share: 0.7,
            occluders_abstain: false,
            fusion: FusionOptions { depth_tolerance: 0.01, normal_tolerance: 30.0, min_views: 4 },
        }
    }

    /// Most of the search on half size, one look at full size, and fewer source views: to look at a scene, or where time is
    /// short. What is searched less takes more from its neighbours.
    pub fn fast() -> Options {
        Options {
            scales: vec![
                Scale { halvings: 1, foods: 2, first_iterations: 4, cycles: 3, cycle_iterations: 1 },
                Scale { halvings: 0, foods: 2, first_iterations: 0, cycles: 0, cycle_iterations: 1 },
            ],
            max_sources: 8,
            focused_views: 4,
            aggregation: Aggregation::BestViews(3),
            restart_spread: 0.005,
            smoothness: 0.2,
            neighbours_drawn: 6,
            plane_fit: 0.03,
            smoothing_passes: 2,
            ..Options::default()
        }
    }

    /// Refuses values no run can be made with, naming the option.
    pub fn check(&self) -> Result<()> {
        self.check_scales()?;
        for entry in TABLE {
            entry.kind.check(entry.name(), (entry.get)(self))?;
        }
        let (min, max) = self.triangulation_angle;
        Kind::Number(min, 180.0).check("triangulation_angle.max", max)?;
        if self.aggregation == Aggregation::BestViews(0) {
            Kind::Whole(1, 8).check("best_views", 0.0)?;
        }
        if self.focused_views == 1 {
            return Err(Error::argument(
                "options.focused_views",
                1,
                "0 for all views of the set, or at least 2",
            ));
        }
        Ok(())
    }

    pub(crate) fn check_scales(&self) -> Result<()> {
        let descending = self.scales.windows(2).all(|pair| pair[0].halvings == pair[1].halvings + 1);
        if !descending || self.scales.last().is_none_or(|last| last.halvings != 0) {
            let halvings: Vec<u32> = self.scales.iter().map(|scale| scale.halvings).collect();
            return Err(Error::argument(
                "options.scales",
                format!("{halvings:?}"),
                "halvings that descend one by one to 0",
            ));
        }
        for scale in &self.scales {
            for (name, value, min, max) in [
                ("scales.halvings", scale.halvings, 0, 8),
                ("scales.foods", scale.foods, 2, 64),
                ("scales.first_iterations", scale.first_iterations, 0, 10_000),
                ("scales.cycles", scale.cycles, 0, 1_000),
                ("scales.cycle_iterations", scale.cycle_iterations, 0, 10_000),
            ] {
                Kind::Whole(min, max).check(name, f64::from(value))?;
            }
        }
        Ok(())
    }

    /// Views a hypothesis must be seen in for its cost to mean anything. The sum of [`Aggregation::AllViews`] is infinite
    /// for fewer than two by itself.
    pub(crate) fn min_matched(&self) -> usize {
        match self.aggregation {
            Aggregation::AllViews => 2,
            Aggregation::BestViews(_) => self.min_consistent.min(2) as usize,
        }
    }

    /// Every option by name with its value, for reports and listings.
    pub fn entries(&self) -> Vec<(&'static str, String)> {
        let scale = |s: &Scale| {
            format!(
                "1/{}: {} foods, {} + {}x{} iterations",
                1u32 << s.halvings,
                s.foods,
                s.first_iterations,
                s.cycles,
                s.cycle_iterations
            )
        };
        let simd = self.simd.map_or("best".to_owned(), |level| level.name().to_owned());
        let mut entries = vec![
            ("seed", self.seed.to_string()),
            ("simd", simd),
            ("scales", self.scales.iter().map(scale).collect::<Vec<_>>().join("; ")),
        ];
        entries.extend(TABLE.iter().map(|entry| (entry.name(), (entry.get)(self).to_string())));
        entries
    }
}

impl Default for Options {
    /// What measures best today.
    fn default() -> Options {
        Options {
            scales: vec![
                Scale { halvings: 1, foods: 3, first_iterations: 5, cycles: 4, cycle_iterations: 1 },
                Scale { halvings: 0, foods: 2, first_iterations: 1, cycles: 2, cycle_iterations: 1 },
            ],
            finest_window_radius: 3,
            round_window: true,
            spatial_sigma: 3.0,
            colour_sigma: 0.03,
            noise_ratio: 2.5,
            aggregation: Aggregation::BestViews(4),
            focused_views: 5,
            restart_spread: 0.01,
            restart_tilt: 0.3,
            smoothness: 0.1,
            employed_foods: 1,
            neighbours_drawn: 3,
            plane_fit: 0.02,
            edge_passes: 2,
            smoothing_passes: 1,
            average_views: true,
            close_gaps: true,
            triangulation_angle: (4.0, 40.0),
            max_sources: 12,
            reward: 0.05,
            geometric_weight: 0.3,
            geometric_limit: 2.0,
            geometric_unknown: 1.75,
            consistent_share: 0.5,
            occluders_abstain: true,
            fusion: FusionOptions { min_views: 3, ..Options::paper().fusion },
            ..Options::paper()
        }
    }
}
