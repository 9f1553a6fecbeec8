// Options. Part of skep.hpp.
//
// Names have a group, which may be left out where no other group has an option of that name. Below each
// name: what it does; the accepted values with their unit; the value of the default preset, and those of
// other presets where they differ.
//
// BEGIN OPTIONS
//
// Of the whole run:
//   seed
//       Seed of the random generator; the same seed gives the same bits.
//       whole number, 0 to 18446744073709551615, any; default: 0
//   threads
//       Worker threads at most; 0 takes one for each core. At most four for each core are started, and no
//       more than the images keep busy. The result does not depend on it.
//       whole number, 0 to 4096, threads; default: 0
//   memory
//       Bytes of memory that a run in a folder keeps to; 0 takes three quarters of what the machine or its
//       control group allows. The result does not depend on it.
//       whole number, 0 to 9007199254740992, bytes; default: 0
//   simd
//       Instruction set: scalar, baseline, v3, or best for the best the machine has; the result does not
//       depend on it.
//       default: best
//
// Input: what a run takes from a scene in files.
//   input.max_image_size
//       Largest side of the photographs of a scene in files: larger ones are reduced, and the maps have their
//       reduced size. 0 keeps all pixels.
//       whole number, 0 to 32768, pixels; default: 0
//   input.alpha_mask
//       Pixels of alpha 0 are ignored like masked ones.
//       switch, true or false; default: false
//   input.images
//       The photographs to take: names or patterns with * and ?, separated by commas, or the path of a text
//       file with one on each line; all if empty.
//       default:
//   input.reference
//       The photographs that get maps, in the form of input.images; all if empty. Of the others only their
//       source views are taken, which get none.
//       default:
//   input.masks
//       Folder of masks: NAME.png for the photograph NAME; where it is 0 nothing is estimated. None if empty.
//       default:
//   input.sources
//       File with the source views of each view, in the layout of COLMAP's patch-match.cfg; chosen by
//       triangulation angle if empty.
//       default:
//   input.depth_ranges
//       File with depth ranges of views, lines NAME NEAR FAR; the ranges of other views follow from the
//       sparse points. None if empty.
//       default:
//   input.bounds
//       Box of the world in which surfaces are reconstructed, x0 y0 z0 x1 y1 z1; everything if empty.
//       default:
//
// Schedule: the scales of a run and the cycles on each.
//   schedule.scales
//       Scales from coarse to fine, each twice as large as the one before, the last at full size:
//       `downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1` is half
//       size with 3 food sources a pixel, 5 iterations in the first cycle and 4 more cycles of 1, then full
//       size.
//       default: downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1
//       fast: downscale=2 food_sources=2 iterations=4+3x1; downscale=1 food_sources=2 iterations=0+0x1
//       paper: downscale=1 food_sources=10 iterations=20+3x2
//   schedule.min_changed_fraction
//       From the second cycle of a scale on, the scale ends early once fewer than this fraction of the pixels
//       changed their depth.
//       number, 0 to 1, fraction of the pixels; default: 0.01
//
// Window: which samples make a patch and how they are weighted.
//   window.window_radius
//       Half the side of the window.
//       whole number, 1 to 16, pixels; default: 5
//   window.full_size_window_radius
//       The same at full size after coarser scales, where the window is a square; 0 keeps `window_radius`.
//       whole number, 0 to 16, pixels; default: 3, paper: 0
//   window.window_step
//       Distance between the samples of the window.
//       whole number, 1 to 8, pixels; default: 2
//   window.circular_window
//       Leave out the corners of the window: a disc of samples instead of a square.
//       switch, true or false; default: true, paper: false
//   window.sigma_spatial
//       Sigma of the bilateral weight in space.
//       number, 0.001 to 1000000, pixels; default: 3, paper: 5
//   window.sigma_color
//       Sigma of the bilateral weight in gray value.
//       number, 0.001 to 1000000, gray value, of [0, 1]; default: 0.03, paper: 0.2
//   window.min_variance
//       Weighted variance under which a window has no texture and costs 2.
//       number, 0 to 1, squared gray value, of [0, 1]; default: 0.00001
//   window.min_texture_to_noise
//       Ratio of the window's variance to the image noise under which the pixel is not matched: it keeps the
//       plane of the cycle before where that matches in a larger window, or is filled from the surrounding
//       planes. 0 matches all pixels.
//       number, 0 to 1000, ratio of variances; default: 2.5, paper: 0
//
// Cost: how the costs of the source views become the cost of a plane, and what is added to it.
//   cost.best_views
//       Mean over the best views of the pixel's view set; 0 takes the sum over all divided by one less than
//       their number (equation 3 of the paper).
//       whole number, 0 to 8, views; default: 4, fast: 3, paper: 0
//   cost.max_views_per_pixel
//       From the second cycle on, match a pixel only with this many views of its set: those whose validated
//       surfaces its plane agrees with best, or of lowest cost where too few of them agree; 0 takes the whole
//       set.
//       whole number, at least 0, views; default: 5, fast: 4, paper: 0
//   cost.geom_consistency_weight
//       Geometric consistency: cost at the largest error against the validated depth of a source view; 0
//       turns the term off.
//       number, 0 to 1000, cost; default: 0.3, paper: 0
//   cost.geom_consistency_max_error
//       Relative depth error against a source view's validated depth at which the penalty saturates;
//       quadratic below.
//       number, 0.00001 to 10, fraction of the depth; default: 0.02, paper: 0.03
//   cost.geom_consistency_missing_error
//       Relative depth error that is assumed where the source view has no validated depth.
//       number, 0 to 10, fraction of the depth; default: 0.0175, paper: 0.015
//   cost.smoothness_weight
//       Smoothness: cost of a plane that contradicts the validated planes of all four neighbors of similar
//       gray value; 0 turns the term off.
//       number, 0 to 1000, cost; default: 0.1, fast: 0.2, paper: 0
//   cost.smoothness_max_depth_error
//       Relative depth error against a neighbor's plane at which the smoothness penalty saturates; quadratic
//       below.
//       number, 0.000001 to 1, fraction of the depth; default: 0.01
//   cost.smoothness_max_normal_error
//       Angle to a neighbor's normal at which the smoothness penalty saturates; quadratic in 1 - cos below.
//       number, 0.001 to 180, degrees; default: 40
//
// Search: the Artificial Multi-Bee Colony of each pixel.
//   search.trial_limit
//       Failed attempts to improve a food source after which a scout bee may replace it.
//       whole number, at least 0, attempts; default: 10
//   search.employed_bees
//       In the first cycle, the number of food sources, best first, that employed bees perturb; no colony has
//       more than 64.
//       whole number, 0 to 64, food sources; default: 1, paper: 64
//   search.later_employed_bees
//       The same from the second cycle on, where the food sources that a colony starts with are perturbations
//       already.
//       whole number, 0 to 64, food sources; default: 0, paper: 64
//   search.onlooker_tournament_size
//       Random neighbors of which an onlooker bee visits the one of lowest cost; different gray values raise
//       the cost.
//       whole number, 1 to 20, neighbors; default: 3, fast: 6, paper: 1
//   search.local_plane_tolerance
//       In the first cycle, relative inverse-depth error up to which a neighbor takes part in the local plane
//       fit of each iteration; 0 fits no planes.
//       number, 0 to 1, fraction of the inverse depth; default: 0.02, fast: 0.03, paper: 0
//   search.depth_perturbation
//       From the second cycle on, half the range of inverse depths in which food sources start around a
//       validated estimate, halved each cycle of a scale; 0 starts them at random. Around an estimate that is
//       not validated one starts so, unless there is a candidate of another view, and the others at random.
//       number, 0 to 0.5, fraction of the inverse depth; default: 0.01, fast: 0.005, paper: 0
//   search.normal_perturbation
//       Half the side of the cube from which a vector is added to the normals of those food sources, halved
//       each cycle of a scale.
//       number, 0 to 10, length, of a unit normal; default: 0.3, paper: 0
//   search.smoothness_reward
//       Fitness bonus of a plane that comes from a validated neighbor, in the comparison only (section 5.6 of
//       the paper); 0 turns it off.
//       number, 0 to 1, fitness; default: 0.05
//   search.view_propagation
//       Propagate consistent planes to the pixels of other views that have no validated plane.
//       switch, true or false; default: true
//
// View selection: the source views of a view, and of each of its pixels.
//   view_selection.pixelwise_view_selection
//       Refine the view set of each pixel by incident angle and visibility; off keeps all source views.
//       switch, true or false; default: true
//   view_selection.min_triangulation_angle
//       Smallest triangulation angle of a source view.
//       number, 0 to 180, degrees; default: 3, paper: 10
//   view_selection.max_triangulation_angle
//       Largest triangulation angle of a source view.
//       number, 0 to 180, degrees; default: 60, paper: 30
//   view_selection.min_sources
//       Source views that a view gets at least, where as many overlap with it: if fewer lie in the range of
//       angles, those nearest to it are added.
//       whole number, at least 0, views; default: 6, paper: 0
//   view_selection.max_sources
//       Source views of a view at most; of more, those that are the most useful beside each other. 0 takes
//       all.
//       whole number, at least 0, views; default: 12, fast: 8, paper: 0
//   view_selection.max_incident_angle
//       Largest angle between the normal and the ray to a source view.
//       number, 0 to 90, degrees; default: 80
//   view_selection.occlusion_tolerance
//       Relative depth by which a validated surface of a source view must lie in front of a point to occlude
//       it.
//       number, 0 to 1, fraction of the depth; default: 0.01
//
// Check: the geometric consistency check after each cycle.
//   check.depth_tolerance
//       Largest relative depth difference of consistent planes.
//       number, 0 to 1, fraction of the depth; default: 0.01
//   check.normal_tolerance
//       Largest angle between the normals of consistent planes.
//       number, 0 to 180, degrees; default: 30
//   check.reprojection_tolerance
//       Reprojection error up to which depths count as equal at any triangulation angle, also beyond
//       `depth_tolerance`; widened where the poses have larger errors. 0 leaves it to `depth_tolerance`
//       alone.
//       number, 0 to 100, pixels; default: 1.25, paper: 0
//   check.slant_tolerance
//       Reprojection error, at the distance of a window's radius, up to which normals count as equal at any
//       triangulation angle; 0 leaves it to `normal_tolerance` alone.
//       number, 0 to 100, pixels; default: 1, paper: 0
//   check.min_consistent_views
//       Source views that must be consistent to validate a plane; with 1 and `best_views` a single source
//       view is enough to match a pixel, as scenes of two views need.
//       whole number, at least 1, views; default: 2
//   check.min_consistent_fraction
//       Fraction of the pixel's view set that must be consistent to validate a plane.
//       number, 0 to 1, fraction of the view set; default: 0.5, paper: 0.7
//   check.few_views
//       Where at most this many source views see the surface, a single consistent one validates a plane, if
//       the errors of the poses leave its depth certain; 0 asks for `min_consistent_views` everywhere.
//       whole number, 0 to 255, views; default: 2, paper: 0
//   check.ignore_occluders
//       Leave source views whose own depth is clearly smaller out of that fraction: they may be occluded
//       there.
//       switch, true or false; default: true, paper: false
//
// Refinement: filters of the planes beyond the paper.
//   refine.fattening_passes
//       Passes of the correction of foreground fattening after a check that may be the last of its scale; 0
//       turns it off.
//       whole number, 0 to 100, passes; default: 2, paper: 0
//   refine.smoothing_passes
//       Passes of plane smoothing after each check; 0 turns it off.
//       whole number, 0 to 100, passes; default: 1, fast: 2, paper: 0
//   refine.cross_view_averaging
//       Average validated planes with those of the source views after the last cycle.
//       switch, true or false; default: true, paper: false
//   refine.fill_gaps
//       Fill small gaps from the surrounding planes after the last cycle, where the source views confirm
//       them.
//       switch, true or false; default: true, paper: false
//   refine.max_speckle_size
//       Largest number of pixels of a speckle after the last cycle: an island of validated planes that no
//       surface around it continues. Speckles lose their validation; 0 keeps them.
//       whole number, at least 0, pixels; default: 30, paper: 0
//
// Fusion: which pixels become points (section 6 of the paper).
//   fusion.depth_tolerance
//       Largest relative depth difference of pixels that are fused.
//       number, 0 to 1, fraction of the depth; default: 0.01
//   fusion.normal_tolerance
//       Largest angle between the normals of pixels that are fused.
//       number, 0 to 180, degrees; default: 30
//   fusion.reprojection_tolerance
//       Reprojection error up to which depths count as equal at any triangulation angle, also beyond
//       `depth_tolerance`; 0 leaves it to `depth_tolerance` alone.
//       number, 0 to 100, pixels; default: 1.25, paper: 0
//   fusion.min_agreeing_views
//       Other views that must agree with a pixel to make a point, where enough see the surface.
//       whole number, at least 0, views; default: 3, paper: 4
//   fusion.min_agreeing_fraction
//       Fraction of the views that see the surface which must agree, at least one, where that is fewer than
//       `min_agreeing_views`; no view may then contradict the point. 0 asks for `min_agreeing_views`
//       everywhere.
//       number, 0 to 1, fraction of the views; default: 0.5, paper: 0
//   fusion.min_confidence
//       Smallest confidence of pixels that are fused.
//       number, 0 to 1, probability; default: 0
//   fusion.compensate_exposure
//       Multiply the colors of each photograph by a factor for each channel, so that photographs of different
//       exposure or white balance agree on the points they share.
//       switch, true or false; default: true, paper: false
//   fusion.voxel_size
//       Side of the cubes in which all points become one: the mean of their positions, normals and colors,
//       seen by all of their views. 0 keeps all points.
//       number, 0 to 1000000000000, units of the scene; default: 0
//   fusion.max_points
//       Points of the cloud at most: of more, so many are drawn at random. 0 keeps all points.
//       whole number, at least 0, points; default: 0
//
// Output: what a run in a folder writes; it changes no values.
//   output.write
//       Files of each view: some of depth, normals, confidence, status, graphs, previews, separated by
//       commas; with + or - before each name they are added to those of the default or left out.
//       default: depth,normals,confidence,status,previews
//   output.cloud_format
//       Format of the cloud: ply, las or laz.
//       default: ply
//   output.splat
//       Write a scene for Gaussian splatting too, in `splat/`: photographs, cameras, and the cloud as the
//       points to start from.
//       switch, true or false; default: false
// END OPTIONS
#ifndef SKEP_OPTIONS_HPP
#define SKEP_OPTIONS_HPP

#include "object.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// Every number the method depends on, by name. The list at the top of this file explains each.
class Options : public detail::Handle<skep_options, skep_options_destroy> {
  public:
    using Handle::Handle;
#ifndef SKEP_NO_EXCEPTIONS
    /// Presets: "default", "fast" and "paper".
    explicit Options(const char *preset = "default") : Options(create(preset)) {}
#endif
    static Fallible<Options> create(const char *preset = "default") {
        Options options(static_cast<skep_options *>(nullptr));
        return detail::give(skep_options_create(preset, options.put()), options);
    }
    /// Sets an option that is a number, a whole number or a switch.
    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    Fallible<void> set(const char *name, Number value) {
        return detail::give(skep_options_set(get(), name, double(value)));
    }
    /// Sets any option from its text.
    Fallible<void> set(const char *name, const std::string &text) {
        return detail::give(skep_options_set_text(get(), name, text.c_str()));
    }
    /// The value of an option that is a number, a whole number or a switch (1 or 0).
    Fallible<double> get(const char *name) const {
        double value = 0;
        return detail::give(skep_options_get(get(), name, &value), value);
    }
    /// The text of any option, which set() takes.
    Fallible<std::string> text(const char *name) const {
        std::string text;
        detail::Status status = detail::text(
            text, [&](auto... out) { return skep_options_get_text(get(), name, out...); });
        return detail::give(std::move(status), text);
    }
    /// The names of all options.
    static std::vector<std::string> names() {
        std::vector<std::string> names;
        while (const char *name = skep_option_name(names.size()))
            names.emplace_back(name);
        return names;
    }
    using Handle::get;
};

/// Options, or none for the default.
class OptionsOrDefault {
  public:
    OptionsOrDefault() = default;
    OptionsOrDefault(const Options &options) : raw_(options.get()), is_empty_(!options) {}
    const skep_options *get() const noexcept { return raw_; }
    /// Options that were moved from are not the default.
    detail::Status check() const {
        return is_empty_ ? detail::Status::argument("options", "empty",
                                                    "options that were not moved from")
                         : detail::Status();
    }

  private:
    const skep_options *raw_ = nullptr;
    bool is_empty_ = false;
};

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_OPTIONS_HPP
