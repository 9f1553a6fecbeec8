//! The table of options: structs, names, ranges, units and explanations are generated from it.

use super::value::{Entry, Kind};
use std::ffi::CStr;

/// The type of a field.
macro_rules! field_type {
    (count) => {
        u32
    };
    (number) => {
        f64
    };
    (switch) => {
        bool
    };
}

macro_rules! kind {
    (count, $min:expr, $max:expr) => {
        Kind::Count { min: $min, max: $max }
    };
    (number, $min:expr, $max:expr) => {
        Kind::Number { min: $min, max: $max }
    };
    (switch,) => {
        Kind::Switch
    };
}

macro_rules! to_number {
    (switch, $value:expr) => {
        f64::from(u8::from($value))
    };
    ($kind:ident, $value:expr) => {
        f64::from($value)
    };
}

macro_rules! from_number {
    (count, $value:expr) => {
        $value as u32
    };
    (number, $value:expr) => {
        $value
    };
    (switch, $value:expr) => {
        $value != 0.0
    };
}

/// The name of an option as a C string.
const fn c_name(with_nul: &'static str) -> &'static CStr {
    match CStr::from_bytes_with_nul(with_nul.as_bytes()) {
        Ok(name) => name,
        Err(_) => panic!("a name ends in its only NUL"),
    }
}

macro_rules! options {
    ($(
        $(#[doc = $group_doc:literal])+
        $group:ident: $struct:ident {
            $(
                $(#[doc = $doc:literal])+
                $field:ident: $kind:ident($($min:literal to $max:literal)?) $unit:literal,
            )+
        }
    )+) => {
        $(
            $(#[doc = $group_doc])+
            #[derive(Debug, Clone, Copy, PartialEq)]
            pub struct $struct {
                $(
                    $(#[doc = $doc])+
                    #[doc = ""]
                    #[doc = concat!($unit, $("; ", $min, " to ", $max)?)]
                    pub $field: field_type!($kind),
                )+
            }
        )+

        /// The options of the groups, in the order of their definition.
        pub(super) const GROUPED: &[Entry] = &[$($(
            Entry {
                c_name: c_name(concat!(stringify!($group), ".", stringify!($field), "\0")),
                explanation: concat!($($doc),+),
                unit: $unit,
                kind: kind!($kind, $($min, $max)?),
                get: |options| to_number!($kind, options.$group.$field),
                set: |options, value| options.$group.$field = from_number!($kind, value),
            },
        )+)+];

        /// Names of the groups with their explanations.
        pub(super) const GROUPS: &[(&str, &str)] = &[$((stringify!($group), concat!($($group_doc),+)),)+];
    };
}

options! {
    /// Window: which samples make a patch and how they are weighted.
    window: WindowOptions {
        /// Half the side of the window.
        window_radius: count(1 to 16) "pixels",
        /// The same at full size after coarser scales, where the window is a square; 0 keeps `window_radius`.
        full_size_window_radius: count(0 to 16) "pixels",
        /// Distance between the samples of the window.
        window_step: count(1 to 8) "pixels",
        /// Leave out the corners of the window: a disc of samples instead of a square.
        circular_window: switch() "switch",
        /// Sigma of the bilateral weight in space.
        sigma_spatial: number(0.001 to 1e6) "pixels",
        /// Sigma of the bilateral weight in gray value.
        sigma_color: number(0.001 to 1e6) "gray value, of [0, 1]",
        /// Weighted variance under which a window has no texture and costs 2.
        min_variance: number(0.0 to 1.0) "squared gray value, of [0, 1]",
        /// Ratio of the window's variance to the image noise under which the pixel is not matched: it keeps
        /// the plane of the cycle before where that matches in a larger window, or is filled from the
        /// surrounding planes. 0 matches all pixels.
        min_texture_to_noise: number(0.0 to 1000.0) "ratio of variances",
    }

    /// Cost: how the costs of the source views become the cost of a plane, and what is added to it.
    cost: CostOptions {
        /// Mean over the best views of the pixel's view set; 0 takes the sum over all divided by one less
        /// than their number (equation 3 of the paper).
        best_views: count(0 to 8) "views",
        /// From the second cycle on, match a pixel only with this many views of its set: those whose
        /// validated surfaces its plane agrees with best, or of lowest cost where too few of them agree; 0
        /// takes the whole set.
        max_views_per_pixel: count(0 to 4294967295) "views",
        /// Geometric consistency: cost at the largest error against the validated depth of a source view; 0
        /// turns the term off.
        geom_consistency_weight: number(0.0 to 1000.0) "cost",
        /// Relative depth error against a source view's validated depth at which the penalty saturates;
        /// quadratic below.
        geom_consistency_max_error: number(1e-5 to 10.0) "fraction of the depth",
        /// Relative depth error that is assumed where the source view has no validated depth.
        geom_consistency_missing_error: number(0.0 to 10.0) "fraction of the depth",
        /// Smoothness: cost of a plane that contradicts the validated planes of all four neighbors of similar
        /// gray value; 0 turns the term off.
        smoothness_weight: number(0.0 to 1000.0) "cost",
        /// Relative depth error against a neighbor's plane at which the smoothness penalty saturates;
        /// quadratic below.
        smoothness_max_depth_error: number(1e-6 to 1.0) "fraction of the depth",
        /// Angle to a neighbor's normal at which the smoothness penalty saturates; quadratic in 1 - cos
        /// below.
        smoothness_max_normal_error: number(0.001 to 180.0) "degrees",
    }

    /// Search: the Artificial Multi-Bee Colony of each pixel.
    search: SearchOptions {
        /// Failed attempts to improve a food source after which a scout bee may replace it.
        trial_limit: count(0 to 4294967295) "attempts",
        /// In the first cycle, the number of food sources, best first, that employed bees perturb; no colony
        /// has more than 64.
        employed_bees: count(0 to 64) "food sources",
        /// The same from the second cycle on, where the food sources that a colony starts with are
        /// perturbations already.
        later_employed_bees: count(0 to 64) "food sources",
        /// Random neighbors of which an onlooker bee visits the one of lowest cost; different gray values
        /// raise the cost.
        onlooker_tournament_size: count(1 to 20) "neighbors",
        /// In the first cycle, relative inverse-depth error up to which a neighbor takes part in the local
        /// plane fit of each iteration; 0 fits no planes.
        local_plane_tolerance: number(0.0 to 1.0) "fraction of the inverse depth",
        /// From the second cycle on, half the range of inverse depths in which food sources start around a
        /// validated estimate, halved each cycle of a scale; 0 starts them at random. Around an estimate that
        /// is not validated one starts so, unless there is a candidate of another view, and the others at
        /// random.
        depth_perturbation: number(0.0 to 0.5) "fraction of the inverse depth",
        /// Half the side of the cube from which a vector is added to the normals of those food sources,
        /// halved each cycle of a scale.
        normal_perturbation: number(0.0 to 10.0) "length, of a unit normal",
        /// Fitness bonus of a plane that comes from a validated neighbor, in the comparison only (section 5.6
        /// of the paper); 0 turns it off.
        smoothness_reward: number(0.0 to 1.0) "fitness",
        /// Propagate consistent planes to the pixels of other views that have no validated plane.
        view_propagation: switch() "switch",
    }

    /// View selection: the source views of a view, and of each of its pixels.
    view_selection: ViewSelectionOptions {
        /// Refine the view set of each pixel by incident angle and visibility; off keeps all source views.
        pixelwise_view_selection: switch() "switch",
        /// Smallest triangulation angle of a source view.
        min_triangulation_angle: number(0.0 to 180.0) "degrees",
        /// Largest triangulation angle of a source view.
        max_triangulation_angle: number(0.0 to 180.0) "degrees",
        /// Source views that a view gets at least, where as many overlap with it: if fewer lie in the range
        /// of angles, those nearest to it are added.
        min_sources: count(0 to 4294967295) "views",
        /// Source views of a view at most; of more, those that are the most useful beside each other. 0 takes
        /// all.
        max_sources: count(0 to 4294967295) "views",
        /// Largest angle between the normal and the ray to a source view.
        max_incident_angle: number(0.0 to 90.0) "degrees",
        /// Relative depth by which a validated surface of a source view must lie in front of a point to
        /// occlude it.
        occlusion_tolerance: number(0.0 to 1.0) "fraction of the depth",
    }

    /// Check: the geometric consistency check after each cycle.
    check: CheckOptions {
        /// Largest relative depth difference of consistent planes.
        depth_tolerance: number(0.0 to 1.0) "fraction of the depth",
        /// Largest angle between the normals of consistent planes.
        normal_tolerance: number(0.0 to 180.0) "degrees",
        /// Reprojection error up to which depths count as equal at any triangulation angle, also beyond
        /// `depth_tolerance`; widened where the poses have larger errors. 0 leaves it to `depth_tolerance`
        /// alone.
        reprojection_tolerance: number(0.0 to 100.0) "pixels",
        /// Reprojection error, at the distance of a window's radius, up to which normals count as equal at
        /// any triangulation angle; 0 leaves it to `normal_tolerance` alone.
        slant_tolerance: number(0.0 to 100.0) "pixels",
        /// Source views that must be consistent to validate a plane; with 1 and `best_views` a single source
        /// view is enough to match a pixel, as scenes of two views need.
        min_consistent_views: count(1 to 4294967295) "views",
        /// Fraction of the pixel's view set that must be consistent to validate a plane.
        min_consistent_fraction: number(0.0 to 1.0) "fraction of the view set",
        /// Where at most this many source views see the surface, a single consistent one validates a plane,
        /// if the errors of the poses leave its depth certain; 0 asks for `min_consistent_views` everywhere.
        few_views: count(0 to 255) "views",
        /// Leave source views whose own depth is clearly smaller out of that fraction: they may be occluded
        /// there.
        ignore_occluders: switch() "switch",
    }

    /// Refinement: filters of the planes beyond the paper.
    refine: RefineOptions {
        /// Passes of the correction of foreground fattening after a check that may be the last of its scale;
        /// 0 turns it off.
        fattening_passes: count(0 to 100) "passes",
        /// Passes of plane smoothing after each check; 0 turns it off.
        smoothing_passes: count(0 to 100) "passes",
        /// Average validated planes with those of the source views after the last cycle.
        cross_view_averaging: switch() "switch",
        /// Fill small gaps from the surrounding planes after the last cycle, where the source views confirm
        /// them.
        fill_gaps: switch() "switch",
        /// Largest number of pixels of a speckle after the last cycle: an island of validated planes that no
        /// surface around it continues. Speckles lose their validation; 0 keeps them.
        max_speckle_size: count(0 to 4294967295) "pixels",
    }

    /// Fusion: which pixels become points (section 6 of the paper).
    fusion: FusionOptions {
        /// Largest relative depth difference of pixels that are fused.
        depth_tolerance: number(0.0 to 1.0) "fraction of the depth",
        /// Largest angle between the normals of pixels that are fused.
        normal_tolerance: number(0.0 to 180.0) "degrees",
        /// Reprojection error up to which depths count as equal at any triangulation angle, also beyond
        /// `depth_tolerance`; 0 leaves it to `depth_tolerance` alone.
        reprojection_tolerance: number(0.0 to 100.0) "pixels",
        /// Other views that must agree with a pixel to make a point, where enough see the surface.
        min_agreeing_views: count(0 to 4294967295) "views",
        /// Fraction of the views that see the surface which must agree, at least one, where that is fewer
        /// than `min_agreeing_views`; no view may then contradict the point. 0 asks for `min_agreeing_views`
        /// everywhere.
        min_agreeing_fraction: number(0.0 to 1.0) "fraction of the views",
        /// Smallest confidence of pixels that are fused.
        min_confidence: number(0.0 to 1.0) "probability",
        /// Multiply the colors of each photograph by a factor for each channel, so that photographs of
        /// different exposure or white balance agree on the points they share.
        compensate_exposure: switch() "switch",
        /// Side of the cubes in which all points become one: the mean of their positions, normals and colors,
        /// seen by all of their views. 0 keeps all points.
        voxel_size: number(0.0 to 1e12) "units of the scene",
        /// Points of the cloud at most: of more, so many are drawn at random. 0 keeps all points.
        max_points: count(0 to 4294967295) "points",
    }
}
