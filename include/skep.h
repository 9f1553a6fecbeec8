/* skep: dense multi-view stereo on the CPU. This file is generated; it is also the manual.
 *
 * Input: calibrated photographs. Output: depth maps, normal maps and view sets, and a fused point cloud.
 * There are four levels of functions, which can be mixed:
 *
 *   whole runs  skep_scene_create, skep_scene_add_view, ..., skep_reconstruct, skep_result_get_depth, ...
 *   stepwise    skep_stepper_create, then the stages of a run on single views; skep_fuse fuses any maps
 *   in folders  skep_job_plan, skep_job_run: runs larger than memory, resumed, divided among machines
 *   kernels     skep_plane_homographies, skep_patch_ncc: stateless
 *
 * and files: skep_scene_read, skep_result_write_workspace and others, for programs without a parser.
 *
 * Rules for all functions:
 *   - Status: a call returns SKEP_OK or a negative status; skep_last_error then returns the argument that was
 *     wrong, its value, and what was expected. A call that fails writes nothing to its outputs and changes
 *     nothing.
 *   - Errors: the descriptions list the statuses of each call. Besides those, every call may return
 *       SKEP_ERR_NULL      an argument that must not be NULL is NULL
 *       SKEP_ERR_ARGUMENT  a pointer that is not aligned for its type, or a text that is not UTF-8
 *       SKEP_ERR_POISONED  a scene or options object that an earlier call left unusable
 *       SKEP_ERR_PANIC     an error in the library itself
 *   - NULL: pointers must not be NULL unless their name or description says so; an array of 0 elements may be
 *     NULL.
 *   - Sizes: buffers and capacities are counted in elements, strides in bytes. width and height are those of
 *     the view, of skep_result_get_size or of skep_stepper_get_size. Outputs must have room for the elements
 *     that their description names. What a call writes must not overlap what it reads, nor another of its
 *     outputs.
 *   - Ownership: inputs are copied, or read during the call only. Outputs belong to the caller. An object
 *     that a call puts into a ..._out parameter is destroyed with its ..._destroy function, which accepts
 *     NULL.
 *   - Texts end in NUL and are UTF-8; static texts are never freed. Paths are in the bytes of the file
 *     system.
 *   - Threads: any function may be called from any thread at any time, on the same objects too, except that
 *     an object must not be destroyed while another call uses it. Immutable objects are shared without locks.
 *     The library keeps no global state, prints nothing, never exits, and does not touch signal handlers.
 *   - The same input, options and library version give the same bits, for any number of threads and
 *     instruction set.
 *
 * C99, C++98 and later. Until 1.0 every minor version may change the interface; the SONAME says so.
 *
 * Sections:
 *   Objects
 *   Statuses, errors and versions
 *   Options
 *   Cameras
 *   Images
 *   Scenes
 *   Progress and cancellation
 *   Whole runs and their results
 *   Maps inside a result
 *   Point clouds
 *   Fusion
 *   Stepwise runs
 *   Estimates of single views
 *   Kernels
 *   Files
 *   Runs in a folder
 */


#ifndef SKEP_H
#define SKEP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Objects ------------------------------------------------------------------------------------------- */

/**
 * Planes of other views, transferred to the pixels of a view. Immutable. They cannot be saved: transfer and
 * search of a view run in the same process.
 */
typedef struct skep_candidates skep_candidates;

/**
 * Fused points. Immutable.
 */
typedef struct skep_cloud skep_cloud;

/**
 * Planes and costs of the pixels of one view after a search, or after the check that follows; before the
 * check also the view sets that it uses. Immutable.
 */
typedef struct skep_estimate skep_estimate;

/**
 * A run in a folder: it keeps to a budget of memory, goes on after an interruption, and can be divided among
 * processes and machines that share the folder. Immutable.
 */
typedef struct skep_job skep_job;

/**
 * Sample positions of a patch and their weights. Immutable.
 */
typedef struct skep_ncc_window skep_ncc_window;

/**
 * Every number the method depends on, by name.
 */
typedef struct skep_options skep_options;

/**
 * A gray image in the memory layout that the kernels sample. Immutable.
 */
typedef struct skep_packed_image skep_packed_image;

/**
 * Maps of views, and the cloud of a whole run. Immutable.
 */
typedef struct skep_result skep_result;

/**
 * Views (photographs with cameras) and sparse points.
 */
typedef struct skep_scene skep_scene;

/**
 * The stages of a run on single views, for hosts that schedule views themselves. Immutable.
 */
typedef struct skep_stepper skep_stepper;

/* ---- Statuses, errors and versions --------------------------------------------------------------------- */

/**
 * Version of this interface; it rises with every incompatible change. The SONAME follows the library's
 * version.
 */
#define SKEP_ABI_VERSION 1

/**
 * Success.
 */
#define SKEP_OK 0

/**
 * A pointer that must not be NULL is NULL.
 */
#define SKEP_ERR_NULL -1

/**
 * A value cannot be used: out of range, not finite, of the wrong size, unknown, or in the wrong order.
 */
#define SKEP_ERR_ARGUMENT -2

/**
 * A scene or options object cannot be used any more: a call that was changing it panicked. Destroy it.
 */
#define SKEP_ERR_POISONED -3

/**
 * The progress callback returned non-zero.
 */
#define SKEP_ERR_CANCELLED -4

/**
 * A file cannot be read, parsed or written.
 */
#define SKEP_ERR_FILE -5

/**
 * A buffer is too small for the output.
 */
#define SKEP_ERR_CAPACITY -6

/**
 * An error in the library itself; please report the text.
 */
#define SKEP_ERR_PANIC -7

/**
 * There is not enough memory for the call.
 */
#define SKEP_ERR_MEMORY -8

/**
 * Result of a call: SKEP_OK or one of the negative SKEP_ERR_ codes; skep_last_error returns the text.
 */
typedef int32_t skep_status;

/**
 * Version of the interface that the library was built with; compare it with SKEP_ABI_VERSION of the header.
 *
 * @return The version.
 */
uint32_t skep_abi_version(void);

/**
 * Version of the library, such as "0.1.0".
 *
 * @return A static text.
 */
const char *skep_version(void);

/**
 * Instruction set that runs use unless option "simd" says otherwise: "scalar", "baseline" or "v3" (AVX2).
 * Results do not depend on it. The environment variable SKEP_SIMD selects another one, lowered to what the
 * machine has.
 *
 * @return A static text.
 */
const char *skep_simd_level_name(void);

/**
 * Short name of a status, such as "argument".
 *
 * @param status  Any number.
 * @return A static text, never NULL; "unknown" for other numbers.
 */
const char *skep_status_name(skep_status status);

/**
 * Copies the error text of the last failed call of the calling thread: the argument, its value and what was
 * expected. It is empty before the first failure; calls that succeed do not change it.
 *
 * A text that is too long is cut between characters, and still ends with NUL.
 *
 * @param buffer    Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
 * @param capacity  Bytes of room in `buffer`.
 * @return Bytes of the whole text with its NUL.
 */
size_t skep_last_error(char *buffer, size_t capacity);

/* ---- Options ------------------------------------------------------------------------------------------- */

/*
 * Options have a name with a group, which may be left out where no other group has an option of that name.
 * Below each name: what it does; the accepted values with their unit; the value of the default preset, and
 * those of other presets where they differ.
 *
 * Of the whole run:
 *   seed
 *       Seed of the random generator; the same seed gives the same bits.
 *       whole number, 0 to 18446744073709551615, any; default: 0
 *   threads
 *       Worker threads at most; 0 takes one for each core. At most four for each core are started, and no
 *       more than the images keep busy. The result does not depend on it.
 *       whole number, 0 to 4096, threads; default: 0
 *   memory
 *       Bytes of memory that a run in a folder keeps to; 0 takes three quarters of what the machine or its
 *       control group allows. The result does not depend on it.
 *       whole number, 0 to 9007199254740992, bytes; default: 0
 *   simd
 *       Instruction set: scalar, baseline, v3, or best for the best the machine has; the result does not
 *       depend on it.
 *       default: best
 *
 * Input: what a run takes from a scene in files.
 *   input.max_image_size
 *       Largest side of the photographs of a scene in files: larger ones are reduced, and the maps have their
 *       reduced size. 0 keeps all pixels.
 *       whole number, 0 to 32768, pixels; default: 0
 *   input.alpha_mask
 *       Pixels of alpha 0 are ignored like masked ones.
 *       switch, true or false; default: false
 *   input.images
 *       The photographs to take: names or patterns with * and ?, separated by commas, or the path of a text
 *       file with one on each line; all if empty.
 *       default:
 *   input.reference
 *       The photographs that get maps, in the form of input.images; all if empty. Of the others only their
 *       source views are taken, which get none.
 *       default:
 *   input.masks
 *       Folder of masks: NAME.png for the photograph NAME; where it is 0 nothing is estimated. None if empty.
 *       default:
 *   input.sources
 *       File with the source views of each view, in the layout of COLMAP's patch-match.cfg; chosen by
 *       triangulation angle if empty.
 *       default:
 *   input.depth_ranges
 *       File with depth ranges of views, lines NAME NEAR FAR; the ranges of other views follow from the
 *       sparse points. None if empty.
 *       default:
 *   input.bounds
 *       Box of the world in which surfaces are reconstructed, x0 y0 z0 x1 y1 z1; everything if empty.
 *       default:
 *
 * Schedule: the scales of a run and the cycles on each.
 *   schedule.scales
 *       Scales from coarse to fine, each twice as large as the one before, the last at full size:
 *       `downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1` is half
 *       size with 3 food sources a pixel, 5 iterations in the first cycle and 4 more cycles of 1, then full
 *       size.
 *       default: downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1
 *       fast: downscale=2 food_sources=2 iterations=4+3x1; downscale=1 food_sources=2 iterations=0+0x1
 *       paper: downscale=1 food_sources=10 iterations=20+3x2
 *   schedule.min_changed_fraction
 *       From the second cycle of a scale on, the scale ends early once fewer than this fraction of the pixels
 *       changed their depth.
 *       number, 0 to 1, fraction of the pixels; default: 0.01
 *
 * Window: which samples make a patch and how they are weighted.
 *   window.window_radius
 *       Half the side of the window.
 *       whole number, 1 to 16, pixels; default: 5
 *   window.full_size_window_radius
 *       The same at full size after coarser scales, where the window is a square; 0 keeps `window_radius`.
 *       whole number, 0 to 16, pixels; default: 3, paper: 0
 *   window.window_step
 *       Distance between the samples of the window.
 *       whole number, 1 to 8, pixels; default: 2
 *   window.circular_window
 *       Leave out the corners of the window: a disc of samples instead of a square.
 *       switch, true or false; default: true, paper: false
 *   window.sigma_spatial
 *       Sigma of the bilateral weight in space.
 *       number, 0.001 to 1000000, pixels; default: 3, paper: 5
 *   window.sigma_color
 *       Sigma of the bilateral weight in gray value.
 *       number, 0.001 to 1000000, gray value, of [0, 1]; default: 0.03, paper: 0.2
 *   window.min_variance
 *       Weighted variance under which a window has no texture and costs 2.
 *       number, 0 to 1, squared gray value, of [0, 1]; default: 0.00001
 *   window.min_texture_to_noise
 *       Ratio of the window's variance to the image noise under which the pixel is not matched: it keeps the
 *       plane of the cycle before where that matches in a larger window, or is filled from the surrounding
 *       planes. 0 matches all pixels.
 *       number, 0 to 1000, ratio of variances; default: 2.5, paper: 0
 *
 * Cost: how the costs of the source views become the cost of a plane, and what is added to it.
 *   cost.best_views
 *       Mean over the best views of the pixel's view set; 0 takes the sum over all divided by one less than
 *       their number (equation 3 of the paper).
 *       whole number, 0 to 8, views; default: 4, fast: 3, paper: 0
 *   cost.max_views_per_pixel
 *       From the second cycle on, match a pixel only with this many views of its set: those whose validated
 *       surfaces its plane agrees with best, or of lowest cost where too few of them agree; 0 takes the whole
 *       set.
 *       whole number, at least 0, views; default: 5, fast: 4, paper: 0
 *   cost.geom_consistency_weight
 *       Geometric consistency: cost at the largest error against the validated depth of a source view; 0
 *       turns the term off.
 *       number, 0 to 1000, cost; default: 0.3, paper: 0
 *   cost.geom_consistency_max_error
 *       Relative depth error against a source view's validated depth at which the penalty saturates;
 *       quadratic below.
 *       number, 0.00001 to 10, fraction of the depth; default: 0.02, paper: 0.03
 *   cost.geom_consistency_missing_error
 *       Relative depth error that is assumed where the source view has no validated depth.
 *       number, 0 to 10, fraction of the depth; default: 0.0175, paper: 0.015
 *   cost.smoothness_weight
 *       Smoothness: cost of a plane that contradicts the validated planes of all four neighbors of similar
 *       gray value; 0 turns the term off.
 *       number, 0 to 1000, cost; default: 0.1, fast: 0.2, paper: 0
 *   cost.smoothness_max_depth_error
 *       Relative depth error against a neighbor's plane at which the smoothness penalty saturates; quadratic
 *       below.
 *       number, 0.000001 to 1, fraction of the depth; default: 0.01
 *   cost.smoothness_max_normal_error
 *       Angle to a neighbor's normal at which the smoothness penalty saturates; quadratic in 1 - cos below.
 *       number, 0.001 to 180, degrees; default: 40
 *
 * Search: the Artificial Multi-Bee Colony of each pixel.
 *   search.trial_limit
 *       Failed attempts to improve a food source after which a scout bee may replace it.
 *       whole number, at least 0, attempts; default: 10
 *   search.employed_bees
 *       In the first cycle, the number of food sources, best first, that employed bees perturb; no colony has
 *       more than 64.
 *       whole number, 0 to 64, food sources; default: 1, paper: 64
 *   search.later_employed_bees
 *       The same from the second cycle on, where the food sources that a colony starts with are perturbations
 *       already.
 *       whole number, 0 to 64, food sources; default: 0, paper: 64
 *   search.onlooker_tournament_size
 *       Random neighbors of which an onlooker bee visits the one of lowest cost; different gray values raise
 *       the cost.
 *       whole number, 1 to 20, neighbors; default: 3, fast: 6, paper: 1
 *   search.local_plane_tolerance
 *       In the first cycle, relative inverse-depth error up to which a neighbor takes part in the local plane
 *       fit of each iteration; 0 fits no planes.
 *       number, 0 to 1, fraction of the inverse depth; default: 0.02, fast: 0.03, paper: 0
 *   search.depth_perturbation
 *       From the second cycle on, half the range of inverse depths in which food sources start around a
 *       validated estimate, halved each cycle of a scale; 0 starts them at random. Around an estimate that is
 *       not validated one starts so, unless there is a candidate of another view, and the others at random.
 *       number, 0 to 0.5, fraction of the inverse depth; default: 0.01, fast: 0.005, paper: 0
 *   search.normal_perturbation
 *       Half the side of the cube from which a vector is added to the normals of those food sources, halved
 *       each cycle of a scale.
 *       number, 0 to 10, length, of a unit normal; default: 0.3, paper: 0
 *   search.smoothness_reward
 *       Fitness bonus of a plane that comes from a validated neighbor, in the comparison only (section 5.6 of
 *       the paper); 0 turns it off.
 *       number, 0 to 1, fitness; default: 0.05
 *   search.view_propagation
 *       Propagate consistent planes to the pixels of other views that have no validated plane.
 *       switch, true or false; default: true
 *
 * View selection: the source views of a view, and of each of its pixels.
 *   view_selection.pixelwise_view_selection
 *       Refine the view set of each pixel by incident angle and visibility; off keeps all source views.
 *       switch, true or false; default: true
 *   view_selection.min_triangulation_angle
 *       Smallest triangulation angle of a source view.
 *       number, 0 to 180, degrees; default: 3, paper: 10
 *   view_selection.max_triangulation_angle
 *       Largest triangulation angle of a source view.
 *       number, 0 to 180, degrees; default: 60, paper: 30
 *   view_selection.min_sources
 *       Source views that a view gets at least, where as many overlap with it: if fewer lie in the range of
 *       angles, those nearest to it are added.
 *       whole number, at least 0, views; default: 6, paper: 0
 *   view_selection.max_sources
 *       Source views of a view at most; of more, those that are the most useful beside each other. 0 takes
 *       all.
 *       whole number, at least 0, views; default: 12, fast: 8, paper: 0
 *   view_selection.max_incident_angle
 *       Largest angle between the normal and the ray to a source view.
 *       number, 0 to 90, degrees; default: 80
 *   view_selection.occlusion_tolerance
 *       Relative depth by which a validated surface of a source view must lie in front of a point to occlude
 *       it.
 *       number, 0 to 1, fraction of the depth; default: 0.01
 *
 * Check: the geometric consistency check after each cycle.
 *   check.depth_tolerance
 *       Largest relative depth difference of consistent planes.
 *       number, 0 to 1, fraction of the depth; default: 0.01
 *   check.normal_tolerance
 *       Largest angle between the normals of consistent planes.
 *       number, 0 to 180, degrees; default: 30
 *   check.reprojection_tolerance
 *       Reprojection error up to which depths count as equal at any triangulation angle, also beyond
 *       `depth_tolerance`; widened where the poses have larger errors. 0 leaves it to `depth_tolerance`
 *       alone.
 *       number, 0 to 100, pixels; default: 1.25, paper: 0
 *   check.slant_tolerance
 *       Reprojection error, at the distance of a window's radius, up to which normals count as equal at any
 *       triangulation angle; 0 leaves it to `normal_tolerance` alone.
 *       number, 0 to 100, pixels; default: 1, paper: 0
 *   check.min_consistent_views
 *       Source views that must be consistent to validate a plane; with 1 and `best_views` a single source
 *       view is enough to match a pixel, as scenes of two views need.
 *       whole number, at least 1, views; default: 2
 *   check.min_consistent_fraction
 *       Fraction of the pixel's view set that must be consistent to validate a plane.
 *       number, 0 to 1, fraction of the view set; default: 0.5, paper: 0.7
 *   check.few_views
 *       Where at most this many source views see the surface, a single consistent one validates a plane, if
 *       the errors of the poses leave its depth certain; 0 asks for `min_consistent_views` everywhere.
 *       whole number, 0 to 255, views; default: 2, paper: 0
 *   check.ignore_occluders
 *       Leave source views whose own depth is clearly smaller out of that fraction: they may be occluded
 *       there.
 *       switch, true or false; default: true, paper: false
 *
 * Refinement: filters of the planes beyond the paper.
 *   refine.fattening_passes
 *       Passes of the correction of foreground fattening after a check that may be the last of its scale; 0
 *       turns it off.
 *       whole number, 0 to 100, passes; default: 2, paper: 0
 *   refine.smoothing_passes
 *       Passes of plane smoothing after each check; 0 turns it off.
 *       whole number, 0 to 100, passes; default: 1, fast: 2, paper: 0
 *   refine.cross_view_averaging
 *       Average validated planes with those of the source views after the last cycle.
 *       switch, true or false; default: true, paper: false
 *   refine.fill_gaps
 *       Fill small gaps from the surrounding planes after the last cycle, where the source views confirm
 *       them.
 *       switch, true or false; default: true, paper: false
 *   refine.max_speckle_size
 *       Largest number of pixels of a speckle after the last cycle: an island of validated planes that no
 *       surface around it continues. Speckles lose their validation; 0 keeps them.
 *       whole number, at least 0, pixels; default: 30, paper: 0
 *
 * Fusion: which pixels become points (section 6 of the paper).
 *   fusion.depth_tolerance
 *       Largest relative depth difference of pixels that are fused.
 *       number, 0 to 1, fraction of the depth; default: 0.01
 *   fusion.normal_tolerance
 *       Largest angle between the normals of pixels that are fused.
 *       number, 0 to 180, degrees; default: 30
 *   fusion.reprojection_tolerance
 *       Reprojection error up to which depths count as equal at any triangulation angle, also beyond
 *       `depth_tolerance`; 0 leaves it to `depth_tolerance` alone.
 *       number, 0 to 100, pixels; default: 1.25, paper: 0
 *   fusion.min_agreeing_views
 *       Other views that must agree with a pixel to make a point, where enough see the surface.
 *       whole number, at least 0, views; default: 3, paper: 4
 *   fusion.min_agreeing_fraction
 *       Fraction of the views that see the surface which must agree, at least one, where that is fewer than
 *       `min_agreeing_views`; no view may then contradict the point. 0 asks for `min_agreeing_views`
 *       everywhere.
 *       number, 0 to 1, fraction of the views; default: 0.5, paper: 0
 *   fusion.min_confidence
 *       Smallest confidence of pixels that are fused.
 *       number, 0 to 1, probability; default: 0
 *   fusion.compensate_exposure
 *       Multiply the colors of each photograph by a factor for each channel, so that photographs of different
 *       exposure or white balance agree on the points they share.
 *       switch, true or false; default: true, paper: false
 *   fusion.voxel_size
 *       Side of the cubes in which all points become one: the mean of their positions, normals and colors,
 *       seen by all of their views. 0 keeps all points.
 *       number, 0 to 1000000000000, units of the scene; default: 0
 *   fusion.max_points
 *       Points of the cloud at most: of more, so many are drawn at random. 0 keeps all points.
 *       whole number, at least 0, points; default: 0
 *
 * Output: what a run in a folder writes; it changes no values.
 *   output.write
 *       Files of each view: some of depth, normals, confidence, status, graphs, previews, separated by
 *       commas; with + or - before each name they are added to those of the default or left out.
 *       default: depth,normals,confidence,status,previews
 *   output.cloud_format
 *       Format of the cloud: ply, las or laz.
 *       default: ply
 *   output.splat
 *       Write a scene for Gaussian splatting too, in `splat/`: photographs, cameras, and the cloud as the
 *       points to start from.
 *       switch, true or false; default: false
 */

/**
 * Creates options from a preset.
 *
 * @param preset_or_null  "default" (also NULL): most accurate; "fast": less than half of its time; "paper":
 *                        follows the paper literally.
 * @param options_out     Receives the options; destroy them with skep_options_destroy.
 * @retval SKEP_ERR_ARGUMENT  No preset of this name.
 */
skep_status skep_options_create(const char *preset_or_null, struct skep_options **options_out);

/**
 * Destroys options. Runs and steppers that were created with them are not affected.
 *
 * @param options  The options; NULL is ignored.
 */
void skep_options_destroy(struct skep_options *options);

/**
 * Sets an option that is a number, a whole number or a switch.
 *
 * @param options  The options.
 * @param name     Name of the option; the group may be left out where no other group has an option of this
 *                 name.
 * @param value    The value in the unit of the option; 0 or 1 for a switch. Whole numbers are exact up to
 *                 2^53.
 * @retval SKEP_ERR_ARGUMENT  No option of this name, several, one that is a text, or a value out of its
 *                            range.
 */
skep_status skep_options_set(struct skep_options *options, const char *name, double value);

/**
 * Gets an option that is a number, a whole number or a switch.
 *
 * @param options    The options.
 * @param name       Name of the option, as in skep_options_set.
 * @param value_out  Receives the value; 0 or 1 for a switch.
 * @retval SKEP_ERR_ARGUMENT  No option of this name, several, or one that is a text.
 */
skep_status skep_options_get(const struct skep_options *options, const char *name, double *value_out);

/**
 * Sets any option from its text.
 *
 * @param options  The options.
 * @param name     Name of the option, as in skep_options_set.
 * @param value    A number, "true" or "false", a name, or a schedule such as "downscale=2 food_sources=3
 *                 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1".
 * @retval SKEP_ERR_ARGUMENT  No option of this name, several, or a text or value that it does not accept.
 */
skep_status skep_options_set_text(struct skep_options *options, const char *name, const char *value);

/**
 * Copies the text of any option, in the form that skep_options_set_text accepts.
 *
 * @param options     The options.
 * @param name        Name of the option, as in skep_options_set.
 * @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
 * @param capacity    Bytes of room in `buffer`; a longer text is cut.
 * @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
 * @retval SKEP_ERR_ARGUMENT  No option of this name, or several.
 */
skep_status skep_options_get_text(const struct skep_options *options,
                                  const char *name,
                                  char *buffer,
                                  size_t capacity,
                                  size_t *needed_out);

/**
 * Lists the options.
 *
 * @param index  Index of the option, from 0.
 * @return Name of the option with its group, a static text; NULL after the last.
 */
const char *skep_option_name(size_t index);

/* ---- Cameras ------------------------------------------------------------------------------------------- */

/**
 * A pinhole camera without distortion. x_cam = rotation * X_world + translation, with x right, y down, z
 * forward; depth is z. The center of the top-left pixel is (0, 0), as in OpenCV; COLMAP's principal points
 * are half a pixel larger. The layout of this struct is frozen.
 */
typedef struct skep_camera {
    /**
     * Focal length in x, in pixels, of 0.001 to 1e9.
     */
    double fx;
    /**
     * Focal length in y, in pixels, of 0.001 to 1e9.
     */
    double fy;
    /**
     * Column of the principal point, in pixels, of -1e9 to 1e9.
     */
    double cx;
    /**
     * Row of the principal point, in pixels, of -1e9 to 1e9.
     */
    double cy;
    /**
     * Rotation from world to camera, row by row; orthonormal within 1e-4, determinant 1.
     */
    double rotation[9];
    /**
     * Translation from world to camera, in world units, of -1e18 to 1e18.
     */
    double translation[3];
} skep_camera;

/* ---- Images -------------------------------------------------------------------------------------------- */

/**
 * Gray. A format is a layout of channels of 8 bits, plus SKEP_FORMAT_16 or SKEP_FORMAT_FLOAT for other
 * channels: SKEP_FORMAT_BGR is 8-bit BGR, SKEP_FORMAT_BGR + SKEP_FORMAT_16 is 16-bit BGR.
 */
#define SKEP_FORMAT_GRAY 0

/**
 * Red, green, blue.
 */
#define SKEP_FORMAT_RGB 1

/**
 * Blue, green, red: the order of OpenCV.
 */
#define SKEP_FORMAT_BGR 2

/**
 * Red, green, blue, and a fourth channel that is ignored.
 */
#define SKEP_FORMAT_RGBA 3

/**
 * Blue, green, red, and a fourth channel that is ignored.
 */
#define SKEP_FORMAT_BGRA 4

/**
 * Added to a layout: channels of uint16_t in the machine's byte order, 0 to 65535. Scale samples of fewer
 * bits to that range, or most of the gray values are lost: 12 bits, 0 to 4095, by 65535 / 4095.
 */
#define SKEP_FORMAT_16 16

/**
 * Added to a layout: channels of float, 0 (black) to 1 (white). Values up to 1/255 outside, as interpolation
 * leaves them, are clamped; others and NaN are refused, so scale pixels of 0 to 255 by 1/255.
 */
#define SKEP_FORMAT_FLOAT 32

/**
 * Pixels in the caller's memory, read during the call only. The layout of this struct is frozen.
 */
typedef struct skep_image {
    /**
     * Address of the top-left pixel; needs no alignment.
     */
    const void *data;
    /**
     * Width in pixels, 1 to 32768.
     */
    uint32_t width;
    /**
     * Height in pixels, 1 to 32768.
     */
    uint32_t height;
    /**
     * Bytes from a row to the next, at least those of the pixels of a row.
     */
    size_t stride_bytes;
    /**
     * A SKEP_FORMAT_ layout, plus SKEP_FORMAT_16 or SKEP_FORMAT_FLOAT.
     */
    uint32_t format;
} skep_image;

/* ---- Scenes -------------------------------------------------------------------------------------------- */

/*
 * Images are copied when a view is added, and shared from then on: runs do not copy them again. A run uses
 * the scene as it is when the run starts; later changes do not affect it.
 *
 * What skep_scene_validate, skep_scene_get_depth_range, _get_sources, _get_overlap and
 * _get_triangulation_angle derive from the scene is kept until the scene is changed: the first call after a
 * change works through the whole scene, the next ones only look up what is known. Source views are kept for
 * the last options asked for.
 */

/**
 * Creates an empty scene.
 *
 * @param scene_out  Receives the scene; destroy it with skep_scene_destroy.
 */
skep_status skep_scene_create(struct skep_scene **scene_out);

/**
 * Copies a scene: later changes of one do not affect the other. Images are shared, not copied.
 *
 * @param scene      The scene.
 * @param scene_out  Receives the copy; destroy it with skep_scene_destroy.
 */
skep_status skep_scene_copy(const struct skep_scene *scene, struct skep_scene **scene_out);

/**
 * Destroys a scene. Results, steppers and clouds created from it are not affected.
 *
 * @param scene  The scene; NULL is ignored.
 */
void skep_scene_destroy(struct skep_scene *scene);

/**
 * Adds a photograph with its camera. Views are numbered from 0 in the order in which they are added. Colors
 * are converted to gray as luma (ITU-R BT.601).
 *
 * @param scene         The scene.
 * @param name_or_null  Name of the view in messages and files, copied; NULL: "view0000.png" with its number.
 * @param image         The pixels; copied, rounded to 8 bits a channel.
 * @param camera        The camera; copied.
 * @param view_out      Receives the number of the view; may be NULL.
 * @retval SKEP_ERR_ARGUMENT  A size, stride, format, float pixel or camera that cannot be used, or a name
 *                            that another view has.
 */
skep_status skep_scene_add_view(struct skep_scene *scene,
                                const char *name_or_null,
                                const struct skep_image *image,
                                const struct skep_camera *camera,
                                uint32_t *view_out);

/**
 * Sets the mask of a view. Pixels that are masked out get no estimate, but still serve as source pixels of
 * other views.
 *
 * @param scene         The scene.
 * @param view          Number of the view.
 * @param mask_or_null  height rows of width bytes, copied: 0 masks a pixel out; NULL removes the mask.
 * @param stride_bytes  Bytes from a row to the next, at least width; ignored with NULL.
 * @retval SKEP_ERR_ARGUMENT  No such view, or a stride that is too small.
 */
skep_status skep_scene_set_mask(struct skep_scene *scene,
                                uint32_t view,
                                const uint8_t *mask_or_null,
                                size_t stride_bytes);

/**
 * Sets the depth range that is searched in a view. By default it is derived from the sparse points that the
 * view observes.
 *
 * @param scene  The scene.
 * @param view   Number of the view.
 * @param near   Smallest depth in world units, above 0; 0 with `far` 0 restores the default.
 * @param far    Largest depth in world units, above `near`.
 * @retval SKEP_ERR_ARGUMENT  No such view, or not 0 < near < far.
 */
skep_status skep_scene_set_depth_range(struct skep_scene *scene, uint32_t view, double near, double far);

/**
 * Sets the source views of a view, which it is matched with. By default they are selected by triangulation
 * angle. The views may be added later.
 *
 * @param scene    The scene.
 * @param view     Number of the view.
 * @param sources  `count` numbers of other views, the most important first, each at most once; copied; may
 *                 be NULL when `count` is 0.
 * @param count    Number of source views; 0 restores the default.
 * @retval SKEP_ERR_ARGUMENT  No such view.
 */
skep_status skep_scene_set_sources(struct skep_scene *scene,
                                   uint32_t view,
                                   const uint32_t *sources,
                                   size_t count);

/**
 * Adds sparse points with the views that observe them. Depth ranges and source views are derived from them;
 * without any points each view needs a depth range. The views may be added later.
 *
 * @param scene        The scene.
 * @param positions    3 * count doubles: x, y, z of each point in the world; copied.
 * @param count        Number of points.
 * @param view_counts  `count` numbers: how many views observe each point; copied.
 * @param views        `view_total` numbers of views, point after point; copied.
 * @param view_total   Sum of `view_counts`.
 * @retval SKEP_ERR_ARGUMENT  A coordinate that is not finite, or a `view_total` that is not the sum of
 *                            `view_counts`.
 */
skep_status skep_scene_add_points(struct skep_scene *scene,
                                  const double *positions,
                                  size_t count,
                                  const uint32_t *view_counts,
                                  const uint32_t *views,
                                  size_t view_total);

/**
 * Checks a scene as a run does when it starts: at least two views, source views and observing views that
 * exist, a depth range for every view.
 *
 * @param scene  The scene.
 * @retval SKEP_ERR_ARGUMENT  The first violation; the text names it.
 */
skep_status skep_scene_validate(const struct skep_scene *scene);

/**
 * Gets the number of views.
 *
 * @param scene      The scene.
 * @param count_out  Receives the number.
 */
skep_status skep_scene_get_view_count(const struct skep_scene *scene, uint32_t *count_out);

/**
 * Gets the size and the camera of a view.
 *
 * @param scene       The scene.
 * @param view        Number of the view.
 * @param width_out   Receives the width in pixels; may be NULL.
 * @param height_out  Receives the height in pixels; may be NULL.
 * @param camera_out  Receives the camera; may be NULL.
 * @retval SKEP_ERR_ARGUMENT  No such view.
 */
skep_status skep_scene_get_view(const struct skep_scene *scene,
                                uint32_t view,
                                uint32_t *width_out,
                                uint32_t *height_out,
                                struct skep_camera *camera_out);

/**
 * Copies the name of a view.
 *
 * @param scene       The scene.
 * @param view        Number of the view.
 * @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
 * @param capacity    Bytes of room in `buffer`; a longer name is cut.
 * @param needed_out  Receives the bytes of the whole name with its NUL; may be NULL.
 * @retval SKEP_ERR_ARGUMENT  No such view.
 */
skep_status skep_scene_get_name(const struct skep_scene *scene,
                                uint32_t view,
                                char *buffer,
                                size_t capacity,
                                size_t *needed_out);

/**
 * Gets the depth range that a run searches in a view: its own, or the one derived from the sparse points.
 * Beyond a derived one a small part of the search goes on, to 0.7 times its near and 4 times its far end.
 *
 * @param scene     The scene.
 * @param view      Number of the view.
 * @param near_out  Receives the smallest depth in world units.
 * @param far_out   Receives the largest depth in world units.
 * @retval SKEP_ERR_ARGUMENT  No such view, or a scene that skep_scene_validate refuses.
 */
skep_status skep_scene_get_depth_range(const struct skep_scene *scene,
                                       uint32_t view,
                                       double *near_out,
                                       double *far_out);

/**
 * Copies one of the warnings about a scene, such as that a view saw no sparse point and where its depth
 * range comes from. Those about source views depend on the options: skep_result_get_warning gives them.
 *
 * @param scene       The scene.
 * @param index       Index of the warning, from 0.
 * @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
 * @param capacity    Bytes of room in `buffer`; a longer text is cut.
 * @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
 * @retval SKEP_ERR_ARGUMENT  `index` is not below the number of warnings: all have been listed; or a scene
 *                            that skep_scene_validate refuses.
 */
skep_status skep_scene_get_warning(const struct skep_scene *scene,
                                   size_t index,
                                   char *buffer,
                                   size_t capacity,
                                   size_t *needed_out);

/**
 * Gets the source views that a run with these options matches a view with. Of more than 1,000 views only
 * those that share sparse points and the 256 whose cameras are the nearest are considered for each.
 *
 * @param scene            The scene.
 * @param options_or_null  The options; NULL: the default preset.
 * @param view             Number of the view.
 * @param sources          Receives `*count_out` numbers of views; may be NULL to ask for their number.
 * @param capacity         Elements of room in `sources`; at most the number of views is needed.
 * @param count_out        Receives the number of source views.
 * @retval SKEP_ERR_ARGUMENT  No such view, a scene that skep_scene_validate refuses, or options out of
 *                            range.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_scene_get_sources(const struct skep_scene *scene,
                                   const struct skep_options *options_or_null,
                                   uint32_t view,
                                   uint32_t *sources,
                                   size_t capacity,
                                   size_t *count_out);

/**
 * Gets the views that fusion compares with a view: those that share a sparse point with it. A view that
 * shares none with any other is compared with all others and they with it; of more than 1,000 views, with
 * the 256 whose cameras are the nearest.
 *
 * @param scene      The scene.
 * @param view       Number of the view.
 * @param views      Receives `*count_out` numbers of views; may be NULL to ask for their number.
 * @param capacity   Elements of room in `views`; at most the number of views is needed.
 * @param count_out  Receives the number of views.
 * @retval SKEP_ERR_ARGUMENT  No such view, or a scene that skep_scene_validate refuses.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_scene_get_overlap(const struct skep_scene *scene,
                                   uint32_t view,
                                   uint32_t *views,
                                   size_t capacity,
                                   size_t *count_out);

/**
 * Gets the triangulation angle of two views: the 75th percentile of the angles at the sparse points that
 * both observe or, where they share fewer than three, the angle at the geometric mean of the depth range of
 * `reference`.
 *
 * @param scene        The scene.
 * @param reference    Number of the reference view.
 * @param source       Number of another view.
 * @param degrees_out  Receives the angle in degrees; -1 when the views share no surface.
 * @retval SKEP_ERR_ARGUMENT  No such view, twice the same view, or a scene that skep_scene_validate refuses.
 */
skep_status skep_scene_get_triangulation_angle(const struct skep_scene *scene,
                                               uint32_t reference,
                                               uint32_t source,
                                               double *degrees_out);

/* ---- Progress and cancellation ------------------------------------------------------------------------- */

/**
 * Search of the planes of a view.
 */
#define SKEP_PHASE_SEARCH 0

/**
 * Checks between views.
 */
#define SKEP_PHASE_CHECK 1

/**
 * Fusion of maps into points.
 */
#define SKEP_PHASE_FUSION 2

/**
 * Reading of photographs.
 */
#define SKEP_PHASE_READ 3

/**
 * Progress of a call.
 */
typedef struct skep_progress {
    /**
     * Fraction of the work of the call that is done, 0 to 1.
     */
    double done;
    /**
     * Stage of the call: a SKEP_PHASE_ value.
     */
    uint32_t phase;
    /**
     * Scale of the images: 1 is full size, 2 half, 4 a quarter.
     */
    uint32_t downscale;
    /**
     * Number of the cycle on this scale, from 0.
     */
    uint32_t cycle;
    /**
     * Number of the view that is worked on.
     */
    uint32_t view;
    /**
     * Number of views.
     */
    uint32_t view_count;
} skep_progress;

/**
 * Progress callback of the host. It is called about a hundred times a second from any thread of the library,
 * never twice at the same time for one call. Returning non-zero cancels the call, which then returns
 * SKEP_ERR_CANCELLED, usually within 100 ms. The callback must return soon, must not throw or unwind, and
 * must not destroy objects that the call uses. NULL: no callback.
 *
 * @param user      The pointer that was passed to the call.
 * @param progress  Progress of the call; valid during the callback only.
 * @return 0 to continue, non-zero to cancel.
 */
typedef int32_t (*skep_progress_fn)(void *user, const struct skep_progress *progress);

/* ---- Whole runs and their results ---------------------------------------------------------------------- */

/**
 * The planes of all pixels.
 */
#define SKEP_MAPS_RAW 0

/**
 * The planes of validated pixels; the others are 0.
 */
#define SKEP_MAPS_VALIDATED 1

/**
 * The plane is consistent with enough source views.
 */
#define SKEP_PIXEL_VALIDATED 0

/**
 * The mask excludes the pixel.
 */
#define SKEP_PIXEL_MASKED 1

/**
 * The variance in the window around the pixel is too small for matching.
 */
#define SKEP_PIXEL_NO_TEXTURE 2

/**
 * There is no plane, or it is visible in fewer source views than matching needs: two, or one with option
 * "check.min_consistent_views" = 1.
 */
#define SKEP_PIXEL_NO_SOURCES 3

/**
 * Too few source views are consistent with the plane.
 */
#define SKEP_PIXEL_INCONSISTENT 4

/**
 * The depth is at an end of the depth range: the surface may lie outside of it.
 */
#define SKEP_PIXEL_OUT_OF_RANGE 5

/**
 * Work spent on a view, and status of its pixels. The numbers depend on input and options only, not on the
 * machine.
 */
typedef struct skep_statistics {
    /**
     * Comparisons of a patch with its image in one source view.
     */
    uint64_t ncc_evaluations;
    /**
     * Bilinear samples taken from source views.
     */
    uint64_t bilinear_samples;
    /**
     * Plane evaluations that ended before all source views were compared.
     */
    uint64_t early_terminations;
    /**
     * Number of pixels of each SKEP_PIXEL_ value; entries after the last value are 0.
     */
    uint64_t status_counts[8];
} skep_statistics;

/**
 * Search and check of one view in one cycle.
 */
typedef struct skep_cycle_record {
    /**
     * Scale of the images: 1 is full size, 2 half, 4 a quarter.
     */
    uint32_t downscale;
    /**
     * Number of the cycle on that scale, from 0.
     */
    uint32_t cycle;
    /**
     * Pixels with a plane.
     */
    uint64_t pixels;
    /**
     * Pixels whose depth the search changed by more than 0.1 %.
     */
    uint64_t changed;
    /**
     * Pixels that the check validated.
     */
    uint64_t validated;
    /**
     * Median distance between where planes project to in the source views and where the source views' own
     * depths lie, in pixels of the cycle's scale: errors of the poses and of the matching. 0 without planes.
     */
    double median_residual;
} skep_cycle_record;

/**
 * Estimates depth, normal and view set of every pixel of every view, and fuses the validated pixels into
 * points.
 *
 * A run has its own threads (option "threads"), which have ended when the call returns; several runs may be
 * made at the same time.
 *
 * @param scene             The scene, as it is when the call starts.
 * @param options_or_null   The options; NULL: the default preset.
 * @param progress_or_null  Receives the progress and may cancel; NULL: none.
 * @param user              Passed to the callback; may be NULL.
 * @param result_out        Receives the result; destroy it with skep_result_destroy. Not written when the
 *                          call fails.
 * @retval SKEP_ERR_ARGUMENT   A scene that skep_scene_validate refuses, options out of range, or threads
 *                             that cannot be started.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
 */
skep_status skep_reconstruct(const struct skep_scene *scene,
                             const struct skep_options *options_or_null,
                             skep_progress_fn progress_or_null,
                             void *user,
                             struct skep_result **result_out);

/**
 * Destroys a result. Clouds taken from it are not affected; borrowed maps are freed.
 *
 * @param result  The result; NULL is ignored.
 */
void skep_result_destroy(struct skep_result *result);

/**
 * Gets the cloud of a whole run, as an object of its own. The points are shared, not copied.
 *
 * @param result     The result of skep_reconstruct.
 * @param cloud_out  Receives the cloud; destroy it with skep_cloud_destroy.
 * @retval SKEP_ERR_ARGUMENT  The result of a single view, from skep_stepper_finish, has no cloud.
 */
skep_status skep_result_get_cloud(const struct skep_result *result, struct skep_cloud **cloud_out);

/**
 * Gets the numbers of the views in a result, ascending: all views of the scene after a whole run.
 *
 * @param result     The result.
 * @param views      Receives `*count_out` numbers of views; may be NULL to ask for their number.
 * @param capacity   Elements of room in `views`.
 * @param count_out  Receives the number of views.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_result_get_views(const struct skep_result *result,
                                  uint32_t *views,
                                  size_t capacity,
                                  size_t *count_out);

/**
 * Copies one of the warnings of a run for its user, such as that a view has no source views.
 *
 * @param result      The result.
 * @param index       Index of the warning, from 0.
 * @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
 * @param capacity    Bytes of room in `buffer`; a longer text is cut.
 * @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
 * @retval SKEP_ERR_ARGUMENT  `index` is not below the number of warnings: all have been listed.
 */
skep_status skep_result_get_warning(const struct skep_result *result,
                                    size_t index,
                                    char *buffer,
                                    size_t capacity,
                                    size_t *needed_out);

/**
 * Gets the source views of a view.
 *
 * @param result     The result.
 * @param view       Number of a view in the result.
 * @param sources    Receives `*count_out` numbers of views; may be NULL to ask for their number.
 * @param capacity   Elements of room in `sources`.
 * @param count_out  Receives the number of source views.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_result_get_sources(const struct skep_result *result,
                                    uint32_t view,
                                    uint32_t *sources,
                                    size_t capacity,
                                    size_t *count_out);

/**
 * Gets the size of the maps of a view.
 *
 * @param result      The result.
 * @param view        Number of a view in the result.
 * @param width_out   Receives the width in pixels.
 * @param height_out  Receives the height in pixels.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 */
skep_status skep_result_get_size(const struct skep_result *result,
                                 uint32_t view,
                                 uint32_t *width_out,
                                 uint32_t *height_out);

/**
 * Gets the work spent on a view and the number of pixels of each status.
 *
 * @param result          The result.
 * @param view            Number of a view in the result.
 * @param statistics_out  Receives the numbers.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 */
skep_status skep_result_get_statistics(const struct skep_result *result,
                                       uint32_t view,
                                       struct skep_statistics *statistics_out);

/**
 * Gets the records of the cycles of a view, in order.
 *
 * @param result     The result.
 * @param view       Number of a view in the result.
 * @param cycles     Receives `*count_out` records; may be NULL to ask for their number.
 * @param capacity   Elements of room in `cycles`.
 * @param count_out  Receives the number of records.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_result_get_cycles(const struct skep_result *result,
                                   uint32_t view,
                                   struct skep_cycle_record *cycles,
                                   size_t capacity,
                                   size_t *count_out);

/**
 * Copies the depth map of a view.
 *
 * @param result        The result.
 * @param view          Number of a view in the result.
 * @param which         SKEP_MAPS_RAW or SKEP_MAPS_VALIDATED.
 * @param out           Receives height rows of width floats: depth in world units, 0 where there is none.
 * @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result, another `which`, or a stride that is too small.
 */
skep_status skep_result_get_depth(const struct skep_result *result,
                                  uint32_t view,
                                  uint32_t which,
                                  float *out,
                                  size_t stride_bytes);

/**
 * Copies the normal map of a view.
 *
 * @param result        The result.
 * @param view          Number of a view in the result.
 * @param which         SKEP_MAPS_RAW or SKEP_MAPS_VALIDATED.
 * @param out           Receives height rows of 3 * width floats: x, y, z of each pixel, a unit vector in the
 *                      camera frame of the view that faces the camera; zeros where there is none.
 * @param stride_bytes  Bytes from a row of `out` to the next, at least 12 * width.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result, another `which`, or a stride that is too small.
 */
skep_status skep_result_get_normal(const struct skep_result *result,
                                   uint32_t view,
                                   uint32_t which,
                                   float *out,
                                   size_t stride_bytes);

/**
 * Copies the matching cost of the raw planes of a view: the mean of 1 - NCC over the view set of each pixel,
 * 0 to 2; lower is better.
 *
 * @param result        The result.
 * @param view          Number of a view in the result.
 * @param out           Receives height rows of width floats.
 * @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
 */
skep_status skep_result_get_cost(const struct skep_result *result,
                                 uint32_t view,
                                 float *out,
                                 size_t stride_bytes);

/**
 * Copies the confidence of the raw depths of a view: the probability of each to be within 1 % of the true
 * one, 0 to 1; 0 where there is none.
 *
 * @param result        The result.
 * @param view          Number of a view in the result.
 * @param out           Receives height rows of width floats.
 * @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
 */
skep_status skep_result_get_confidence(const struct skep_result *result,
                                       uint32_t view,
                                       float *out,
                                       size_t stride_bytes);

/**
 * Copies the status of the pixels of a view: a SKEP_PIXEL_ value for each.
 *
 * @param result        The result.
 * @param view          Number of a view in the result.
 * @param out           Receives height rows of width bytes.
 * @param stride_bytes  Bytes from a row of `out` to the next, at least width.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
 */
skep_status skep_result_get_status(const struct skep_result *result,
                                   uint32_t view,
                                   uint8_t *out,
                                   size_t stride_bytes);

/**
 * Copies the number of source views in the view set of every pixel.
 *
 * @param result        The result.
 * @param view          Number of a view in the result.
 * @param out           Receives height rows of width uint16_t.
 * @param stride_bytes  Bytes from a row of `out` to the next, at least 2 * width.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result, or a stride that is too small.
 */
skep_status skep_result_get_source_count(const struct skep_result *result,
                                         uint32_t view,
                                         uint16_t *out,
                                         size_t stride_bytes);

/**
 * Copies the view sets of the pixels, 32 source views at a time: bit i of a pixel stands for entry 32 * word
 * + i of skep_result_get_sources.
 *
 * @param result        The result.
 * @param view          Number of a view in the result.
 * @param word          Which 32 source views, from 0.
 * @param out           Receives height rows of width uint32_t.
 * @param stride_bytes  Bytes from a row of `out` to the next, at least 4 * width.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result, 32 * word beyond its source views, or a stride that
 *                            is too small.
 */
skep_status skep_result_get_source_bits(const struct skep_result *result,
                                        uint32_t view,
                                        uint32_t word,
                                        uint32_t *out,
                                        size_t stride_bytes);

/* ---- Maps inside a result ------------------------------------------------------------------------------ */

/**
 * Borrows the raw depth map of a view.
 *
 * @param result     The result.
 * @param view       Number of a view in the result.
 * @param depth_out  Receives the address of width * height floats, row after row; owned by the result.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 */
skep_status skep_result_borrow_depth(const struct skep_result *result,
                                     uint32_t view,
                                     const float **depth_out);

/**
 * Borrows the raw normal map of a view.
 *
 * @param result      The result.
 * @param view        Number of a view in the result.
 * @param normal_out  Receives the address of 3 * width * height floats, row after row; owned by the result.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 */
skep_status skep_result_borrow_normal(const struct skep_result *result,
                                      uint32_t view,
                                      const float **normal_out);

/**
 * Borrows the matching costs of a view; see skep_result_get_cost.
 *
 * @param result    The result.
 * @param view      Number of a view in the result.
 * @param cost_out  Receives the address of width * height floats, row after row; owned by the result.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 */
skep_status skep_result_borrow_cost(const struct skep_result *result, uint32_t view, const float **cost_out);

/**
 * Borrows the confidences of a view; see skep_result_get_confidence.
 *
 * @param result          The result.
 * @param view            Number of a view in the result.
 * @param confidence_out  Receives the address of width * height floats, row after row; owned by the result.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 */
skep_status skep_result_borrow_confidence(const struct skep_result *result,
                                          uint32_t view,
                                          const float **confidence_out);

/**
 * Borrows the status of the pixels of a view, SKEP_PIXEL_ values.
 *
 * @param result      The result.
 * @param view        Number of a view in the result.
 * @param status_out  Receives the address of width * height bytes, row after row; owned by the result.
 * @retval SKEP_ERR_ARGUMENT  No such view in the result.
 */
skep_status skep_result_borrow_status(const struct skep_result *result,
                                      uint32_t view,
                                      const uint8_t **status_out);

/* ---- Point clouds -------------------------------------------------------------------------------------- */

/**
 * Destroys a cloud. The result it was taken from is not affected.
 *
 * @param cloud  The cloud; NULL is ignored.
 */
void skep_cloud_destroy(struct skep_cloud *cloud);

/**
 * Gets the number of points.
 *
 * @param cloud           The cloud.
 * @param count_out       Receives the number of points.
 * @param view_total_out  Receives the sum of the lengths of their view lists; may be NULL.
 */
skep_status skep_cloud_get_count(const struct skep_cloud *cloud, size_t *count_out, size_t *view_total_out);

/**
 * Copies the points.
 *
 * @param cloud      The cloud.
 * @param positions  Receives 3 * count doubles: x, y, z in the world; may be NULL.
 * @param normals    Receives 3 * count floats: unit normals in the world; may be NULL.
 * @param colors     Receives 3 * count bytes: red, green, blue; 128 where no image was given; may be NULL.
 * @param capacity   Points of room in each buffer.
 * @retval SKEP_ERR_CAPACITY  `capacity` is below the number of points.
 */
skep_status skep_cloud_get_points(const struct skep_cloud *cloud,
                                  double *positions,
                                  float *normals,
                                  uint8_t *colors,
                                  size_t capacity);

/**
 * Copies the views that each point was fused from, the one where it started first.
 *
 * @param cloud          The cloud.
 * @param view_counts    Receives the number of views of each point, one number a point; may be NULL.
 * @param capacity       Elements of room in `view_counts`; the number of points is needed.
 * @param views          Receives the numbers of the views, point after point; may be NULL.
 * @param view_capacity  Elements of room in `views`; skep_cloud_get_count returns how many are needed.
 * @retval SKEP_ERR_CAPACITY  A buffer is too small.
 */
skep_status skep_cloud_get_views(const struct skep_cloud *cloud,
                                 uint32_t *view_counts,
                                 size_t capacity,
                                 uint32_t *views,
                                 size_t view_capacity);

/* ---- Fusion -------------------------------------------------------------------------------------------- */

/**
 * A view with maps to be fused, in the caller's memory, read during the call only. The layout of this struct
 * is frozen.
 */
typedef struct skep_fusion_view {
    /**
     * Camera of the maps.
     */
    const struct skep_camera *camera;
    /**
     * Width of the maps, 1 to 32768.
     */
    uint32_t width;
    /**
     * Height of the maps, 1 to 32768.
     */
    uint32_t height;
    /**
     * height rows of width floats: depth in world units; 0, negative and not finite: no estimate.
     */
    const float *depth;
    /**
     * Bytes from a row of `depth` to the next, at least 4 * width.
     */
    size_t depth_stride_bytes;
    /**
     * height rows of 3 * width floats: unit normals x, y, z in the camera frame.
     */
    const float *normal;
    /**
     * Bytes from a row of `normal` to the next, at least 12 * width.
     */
    size_t normal_stride_bytes;
    /**
     * Image of the size of the maps, for the colors; NULL: gray points.
     */
    const struct skep_image *image_or_null;
    /**
     * Views that may observe the same surface, as indices into the array of views; see
     * skep_scene_get_overlap.
     */
    const uint32_t *overlap;
    /**
     * Number of elements of `overlap`.
     */
    size_t overlap_count;
    /**
     * height rows of width floats: the confidence of each pixel, 0 to 1; NULL: 1 for all.
     */
    const float *confidence_or_null;
    /**
     * Bytes from a row of `confidence_or_null` to the next, at least 4 * width; ignored without it.
     */
    size_t confidence_stride_bytes;
} skep_fusion_view;

/**
 * Fuses depth and normal maps into points, with the options of group "fusion" and "threads". The validated
 * maps of a whole run with its images and overlaps give the cloud of the run, to the bit.
 *
 * @param views             `view_count` views with their maps; read during the call only.
 * @param view_count        Number of views.
 * @param options_or_null   The options; NULL: the default preset.
 * @param progress_or_null  Receives the progress and may cancel; NULL: none.
 * @param user              Passed to the callback; may be NULL.
 * @param cloud_out         Receives the cloud; destroy it with skep_cloud_destroy. Not written when the call
 *                          fails.
 * @retval SKEP_ERR_ARGUMENT   A camera, size, stride, image or overlap that cannot be used, named like
 *                             `views[2].depth`; options out of range.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
 */
skep_status skep_fuse(const struct skep_fusion_view *views,
                      size_t view_count,
                      const struct skep_options *options_or_null,
                      skep_progress_fn progress_or_null,
                      void *user,
                      struct skep_cloud **cloud_out);

/* ---- Stepwise runs ------------------------------------------------------------------------------------- */

/*
 * A stepper holds what all stages share: image pyramids, source views and threads. Different views may be
 * processed at the same time from several threads, or on several machines: estimates are saved to bytes and
 * loaded by a stepper of the same scene and options.
 *
 * A run is, for cycle 0 and then for each cycle that skep_stepper_next returns, until SKEP_CYCLE_NONE:
 *   - for each view, if the cycle is on a finer scale than its estimate: skep_stepper_upsample
 *   - for each view: skep_stepper_propagate, then skep_stepper_search, from the checked estimates of the
 *     previous cycle
 *   - for each view: skep_stepper_check, from the searched estimates of the same cycle
 *
 * and then, for each view, skep_stepper_finish from the checked estimates of the last cycle, and skep_fuse
 * for the validated maps of all views. That gives the same bits as skep_reconstruct. What each call
 * performs, and which estimates of other views it reads:
 *
 *   call       stages                                  estimates of other views
 *   upsample   upsampling                              none
 *   propagate  transfer of planes                      checked planes, previous cycle, of the views whose
 *                                                      source lists contain the view
 *   search     search,                                 validated surfaces, previous cycle, of the view's
 *              filling of textureless regions          sources
 *   check      consistency check,                      searched planes, same cycle, of the view's sources
 *              correction of foreground fattening,
 *              plane smoothing,
 *              publication of the validated surface
 *   finish     averaging across views, gap filling,    validated surfaces and checked planes, last cycle,
 *              check of filled pixels, classification  of the view's sources
 *
 * Arrays of estimates hold one pointer for each view of the scene. Those of the view itself and of the views
 * named above are read; entries of other views may be NULL. A view without an estimate contributes nothing.
 */

/**
 * No cycle: the run is complete.
 */
#define SKEP_CYCLE_NONE 4294967295

/**
 * Scale and search parameters of a cycle.
 */
typedef struct skep_cycle {
    /**
     * Scale of the images: 1 is full size, 2 half, 4 a quarter.
     */
    uint32_t downscale;
    /**
     * Number of the cycle on that scale, from 0.
     */
    uint32_t cycle_on_scale;
    /**
     * Food sources (plane hypotheses) of the colony of each pixel.
     */
    uint32_t food_sources;
    /**
     * Iterations: turns of the employed, onlooker and scout bees.
     */
    uint32_t iterations;
} skep_cycle;

/**
 * Creates a stepper: builds the image pyramids, selects source views and starts threads.
 *
 * @param scene            The scene, as it is when the call starts; it may be destroyed afterwards.
 * @param options_or_null  The options, copied; NULL: the default preset.
 * @param stepper_out      Receives the stepper; destroy it with skep_stepper_destroy.
 * @retval SKEP_ERR_ARGUMENT  A scene that skep_scene_validate refuses, options out of range, or threads that
 *                            cannot be started.
 */
skep_status skep_stepper_create(const struct skep_scene *scene,
                                const struct skep_options *options_or_null,
                                struct skep_stepper **stepper_out);

/**
 * Destroys a stepper and ends its threads. Estimates and results made with it are not affected.
 *
 * @param stepper  The stepper; NULL is ignored.
 */
void skep_stepper_destroy(struct skep_stepper *stepper);

/**
 * Gets the number of cycles of the schedule, and of views.
 *
 * @param stepper          The stepper.
 * @param cycle_count_out  Receives the number of cycles on all scales; may be NULL.
 * @param view_count_out   Receives the number of views; may be NULL.
 */
skep_status skep_stepper_get_count(const struct skep_stepper *stepper,
                                   uint32_t *cycle_count_out,
                                   uint32_t *view_count_out);

/**
 * Gets the scale and the search parameters of a cycle.
 *
 * @param stepper    The stepper.
 * @param cycle      Number of the cycle, from 0, on all scales.
 * @param cycle_out  Receives the parameters.
 * @retval SKEP_ERR_ARGUMENT  No such cycle.
 */
skep_status skep_stepper_get_cycle(const struct skep_stepper *stepper,
                                   uint32_t cycle,
                                   struct skep_cycle *cycle_out);

/**
 * Gets the size of the maps of a view in a cycle.
 *
 * @param stepper     The stepper.
 * @param cycle       Number of the cycle.
 * @param view        Number of the view.
 * @param width_out   Receives the width in pixels.
 * @param height_out  Receives the height in pixels.
 * @retval SKEP_ERR_ARGUMENT  No such cycle or view.
 */
skep_status skep_stepper_get_size(const struct skep_stepper *stepper,
                                  uint32_t cycle,
                                  uint32_t view,
                                  uint32_t *width_out,
                                  uint32_t *height_out);

/**
 * Gets the source views of a view.
 *
 * @param stepper    The stepper.
 * @param view       Number of the view.
 * @param sources    Receives `*count_out` numbers of views; may be NULL to ask for their number.
 * @param capacity   Elements of room in `sources`.
 * @param count_out  Receives the number of source views.
 * @retval SKEP_ERR_ARGUMENT  No such view.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_stepper_get_sources(const struct skep_stepper *stepper,
                                     uint32_t view,
                                     uint32_t *sources,
                                     size_t capacity,
                                     size_t *count_out);

/**
 * Transfers planes of other views to a view: for each pixel without a validated plane, the consistent plane
 * of lowest cost that projects onto it. There are none in the first cycle of a scale, without an estimate of
 * the view itself, and with option "search.view_propagation" off.
 *
 * Reads the checked planes of the previous cycle of the views whose source lists contain the view, and of
 * the view itself. Changes nothing.
 *
 * @param stepper         The stepper.
 * @param cycle           Number of the cycle that the candidates are for.
 * @param view            Number of the view.
 * @param estimates       `estimate_count` pointers by view: checked estimates on the scale of the cycle,
 *                        NULL for none; may be NULL when `estimate_count` is 0.
 * @param estimate_count  The number of views, or 0.
 * @param candidates_out  Receives the candidates; destroy them with skep_candidates_destroy.
 * @retval SKEP_ERR_ARGUMENT  No such cycle or view; estimates of another view, scale or scene, or that are
 *                            not checked.
 */
skep_status skep_stepper_propagate(const struct skep_stepper *stepper,
                                   uint32_t cycle,
                                   uint32_t view,
                                   const struct skep_estimate *const *estimates,
                                   size_t estimate_count,
                                   struct skep_candidates **candidates_out);

/**
 * Destroys candidates.
 *
 * @param candidates  The candidates; NULL is ignored.
 */
void skep_candidates_destroy(struct skep_candidates *candidates);

/**
 * Searches the planes of a view for one cycle, then fills its textureless regions from the planes around
 * them. The new estimate is to be checked before it is used for anything else.
 *
 * Reads the planes of the view itself, random ones where it has no estimate, and the validated surfaces of
 * its sources, all of the previous cycle. Changes depth, normal, cost and view set of the pixels, in the new
 * estimate.
 *
 * @param stepper             The stepper.
 * @param cycle               Number of the cycle.
 * @param view                Number of the view.
 * @param estimates           `estimate_count` pointers by view: checked estimates on the scale of the cycle,
 *                            NULL for none; may be NULL when `estimate_count` is 0.
 * @param estimate_count      The number of views, or 0.
 * @param candidates_or_null  Candidates of skep_stepper_propagate for this cycle and view; NULL: none.
 * @param progress_or_null    Receives the progress and may cancel; NULL: none.
 * @param user                Passed to the callback; may be NULL.
 * @param estimate_out        Receives the searched estimate; destroy it with skep_estimate_destroy. Not
 *                            written when the call fails.
 * @retval SKEP_ERR_ARGUMENT   No such cycle or view; estimates of another view, scale or scene, or that are
 *                             not checked; candidates of another cycle or view.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
 */
skep_status skep_stepper_search(const struct skep_stepper *stepper,
                                uint32_t cycle,
                                uint32_t view,
                                const struct skep_estimate *const *estimates,
                                size_t estimate_count,
                                const struct skep_candidates *candidates_or_null,
                                skep_progress_fn progress_or_null,
                                void *user,
                                struct skep_estimate **estimate_out);

/**
 * Checks the planes of a view, and prepares them for the next cycle. Four stages, in this order:
 *
 *   1. consistency check: compares the planes with those of the source views; writes the
 *      number of consistent views, and which planes are validated
 *   2. correction of foreground fattening, if the scale may end with this cycle (option
 *      "refine.fattening_passes"): gives validated pixels beside a depth edge the plane of the surface
 *      behind where their gray values are closer to it; in the last cycle some keep their plane and lose
 *      their validation
 *   3. plane smoothing (option "refine.smoothing_passes"): changes depths and normals
 *   4. publication of the validated surface, which the searches of the next cycle and the averaging of
 *      skep_stepper_finish read
 *
 * So the new estimate differs in depths, normals, numbers of consistent views and validation; the view sets
 * are dropped, costs stay. The call reads depths and normals of the view's sources, searched in the same
 * cycle; for a source with maps of the host's own (skep_estimate_from_maps) its checked estimate is taken. A
 * source without an estimate takes no part in the check.
 *
 * @param stepper         The stepper.
 * @param cycle           Number of the cycle.
 * @param view            Number of the view.
 * @param estimates       `estimate_count` pointers by view: searched estimates of this cycle, NULL for none,
 *                        except that of the view itself.
 * @param estimate_count  The number of views.
 * @param estimate_out    Receives the checked estimate; destroy it with skep_estimate_destroy.
 * @retval SKEP_ERR_ARGUMENT  No such cycle or view; estimates of another view, scale or scene; none of the
 *                            view itself, or one that is checked already.
 */
skep_status skep_stepper_check(const struct skep_stepper *stepper,
                               uint32_t cycle,
                               uint32_t view,
                               const struct skep_estimate *const *estimates,
                               size_t estimate_count,
                               struct skep_estimate **estimate_out);

/**
 * Upsamples a checked estimate to the next finer scale: each pixel gets the plane of its coarse pixel, with
 * its flags.
 *
 * Reads the estimate only.
 *
 * @param stepper       The stepper.
 * @param cycle         Number of a cycle on the finer scale.
 * @param view          Number of the view.
 * @param estimate      The checked estimate of the view, on the scale before.
 * @param estimate_out  Receives the checked estimate on the finer scale; destroy it with
 *                      skep_estimate_destroy.
 * @retval SKEP_ERR_ARGUMENT  No such cycle or view; an estimate of another view, scale or scene, or that is
 *                            not checked.
 */
skep_status skep_stepper_upsample(const struct skep_stepper *stepper,
                                  uint32_t cycle,
                                  uint32_t view,
                                  const struct skep_estimate *estimate,
                                  struct skep_estimate **estimate_out);

/**
 * Gets the cycle that follows a cycle. From its second cycle on, a scale ends early when the fraction of
 * changed pixels in all given estimates is below option "schedule.min_changed_fraction".
 *
 * Reads the numbers of changed pixels only.
 *
 * @param stepper         The stepper.
 * @param cycle           Number of the cycle that was searched and checked.
 * @param estimates       `estimate_count` pointers by view: checked estimates of this cycle, NULL for none;
 *                        may be NULL when `estimate_count` is 0.
 * @param estimate_count  The number of views, or 0.
 * @param next_out        Receives the number of the next cycle; SKEP_CYCLE_NONE after the last.
 * @retval SKEP_ERR_ARGUMENT  No such cycle; estimates of another view, scale or scene, or that are not
 *                            checked.
 */
skep_status skep_stepper_next(const struct skep_stepper *stepper,
                              uint32_t cycle,
                              const struct skep_estimate *const *estimates,
                              size_t estimate_count,
                              uint32_t *next_out);

/**
 * Finishes a view after the last cycle. Five stages, in this order:
 *
 *   1. averaging of the validated planes with those of the source views (option
 *      "refine.cross_view_averaging"); reads the published surfaces of the last cycle of the view's sources
 *   2. gap filling from the surrounding planes (option "refine.fill_gaps")
 *   3. check of the filled pixels against the planes of the source views as they were before averaging:
 *      reads the checked planes of the last cycle of the view's sources; pixels that fail keep what they had
 *   4. speckle removal: small islands of planes lose their validation (option "refine.max_speckle_size")
 *   5. classification: determines view set, cost and status of every pixel
 *
 * The estimates are not changed.
 *
 * @param stepper           The stepper.
 * @param view              Number of the view.
 * @param estimates         `estimate_count` pointers by view: checked estimates of the last cycle, NULL for
 *                          none, except that of the view itself.
 * @param estimate_count    The number of views.
 * @param progress_or_null  Receives the progress and may cancel; NULL: none.
 * @param user              Passed to the callback; may be NULL.
 * @param result_out        Receives a result that holds this view alone, under its number; destroy it with
 *                          skep_result_destroy. Not written when the call fails.
 * @retval SKEP_ERR_ARGUMENT   No such view; estimates of another view, scale or scene, or that are not
 *                             checked; none of the view itself.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
 */
skep_status skep_stepper_finish(const struct skep_stepper *stepper,
                                uint32_t view,
                                const struct skep_estimate *const *estimates,
                                size_t estimate_count,
                                skep_progress_fn progress_or_null,
                                void *user,
                                struct skep_result **result_out);

/* ---- Estimates of single views ------------------------------------------------------------------------- */

/**
 * Identity and numbers of an estimate.
 */
typedef struct skep_estimate_info {
    /**
     * Number of the view.
     */
    uint32_t view;
    /**
     * Number of the cycle it was searched in, or to whose scale it was upsampled.
     */
    uint32_t cycle;
    /**
     * 1 for a checked estimate, 0 for a searched one.
     */
    uint32_t is_checked;
    /**
     * Always 0.
     */
    uint32_t reserved;
    /**
     * Number of pixels.
     */
    uint64_t pixels;
    /**
     * Pixels whose depth the last search changed by more than 0.1 %.
     */
    uint64_t changed;
    /**
     * Pixels that the last check validated.
     */
    uint64_t validated;
    /**
     * NCC evaluations of the view so far.
     */
    uint64_t ncc_evaluations;
} skep_estimate_info;

/**
 * Makes a checked estimate from the caller's own maps, of the size that skep_stepper_get_size returns.
 *
 * @param stepper                 The stepper.
 * @param cycle                   Number of the cycle that the estimate is of.
 * @param view                    Number of the view.
 * @param depth                   height rows of width floats: depth in world units, 0 for none; copied.
 * @param depth_stride_bytes      Bytes from a row of `depth` to the next, at least 4 * width.
 * @param normal                  height rows of 3 * width floats: x, y, z in the camera frame, a unit vector
 *                                that faces the camera where there is a depth; copied.
 * @param normal_stride_bytes     Bytes from a row of `normal` to the next, at least 12 * width.
 * @param validated_or_null       height rows of width bytes, not 0 where the plane is validated, copied;
 *                                NULL: wherever there is a depth.
 * @param validated_stride_bytes  Bytes from a row to the next, at least width; ignored with NULL.
 * @param cost_or_null            height rows of width floats, at least 0, rounded to 1/256, copied: ranks
 *                                the planes in the propagation to other views; NULL: 0.
 * @param cost_stride_bytes       Bytes from a row to the next, at least 4 * width; ignored with NULL.
 * @param estimate_out            Receives the estimate; destroy it with skep_estimate_destroy.
 * @retval SKEP_ERR_ARGUMENT  No such cycle or view; a stride that is too small; a depth, normal or cost that
 *                            cannot be used, with its column and row.
 */
skep_status skep_estimate_from_maps(const struct skep_stepper *stepper,
                                    uint32_t cycle,
                                    uint32_t view,
                                    const float *depth,
                                    size_t depth_stride_bytes,
                                    const float *normal,
                                    size_t normal_stride_bytes,
                                    const uint8_t *validated_or_null,
                                    size_t validated_stride_bytes,
                                    const float *cost_or_null,
                                    size_t cost_stride_bytes,
                                    struct skep_estimate **estimate_out);

/**
 * Destroys an estimate.
 *
 * @param estimate  The estimate; NULL is ignored.
 */
void skep_estimate_destroy(struct skep_estimate *estimate);

/**
 * Gets the identity and the numbers of an estimate.
 *
 * @param estimate  The estimate.
 * @param info_out  Receives them.
 */
skep_status skep_estimate_get_info(const struct skep_estimate *estimate, struct skep_estimate_info *info_out);

/**
 * Copies the maps of an estimate, row after row without gaps.
 *
 * @param estimate   The estimate.
 * @param depth      Receives pixels floats: depth in world units, 0 where there is none; may be NULL.
 * @param normal     Receives 3 * pixels floats: x, y, z in the camera frame; may be NULL.
 * @param cost       Receives pixels floats: aggregated cost of the search, rounded to 1/256; may be NULL.
 * @param validated  Receives pixels bytes: 1 where the check validated the plane, else 0; may be NULL.
 * @param capacity   Pixels of room in each buffer; skep_estimate_get_info returns how many are needed.
 * @retval SKEP_ERR_CAPACITY  `capacity` is below the number of pixels.
 */
skep_status skep_estimate_get_maps(const struct skep_estimate *estimate,
                                   float *depth,
                                   float *normal,
                                   float *cost,
                                   uint8_t *validated,
                                   size_t capacity);

/**
 * Saves an estimate as bytes, to keep it or to send it to another machine.
 *
 * @param estimate  The estimate.
 * @param buffer    Receives `*size_out` bytes; may be NULL to ask for their number.
 * @param capacity  Bytes of room in `buffer`.
 * @param size_out  Receives the number of bytes.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_estimate_save(const struct skep_estimate *estimate,
                               uint8_t *buffer,
                               size_t capacity,
                               size_t *size_out);

/**
 * Loads an estimate that the same version of the library saved.
 *
 * @param stepper       A stepper of the same scene and options as the one it was made with.
 * @param bytes         `size` bytes of skep_estimate_save; read during the call only.
 * @param size          Number of bytes.
 * @param estimate_out  Receives the estimate; destroy it with skep_estimate_destroy.
 * @retval SKEP_ERR_ARGUMENT  Bytes that are not an estimate, are truncated or too many, or do not fit the
 *                            stepper.
 */
skep_status skep_estimate_load(const struct skep_stepper *stepper,
                               const uint8_t *bytes,
                               size_t size,
                               struct skep_estimate **estimate_out);

/* ---- Kernels ------------------------------------------------------------------------------------------- */

/*
 * The kernels are stateless: they may be called from any number of threads. skep_plane_through,
 * skep_plane_homographies and skep_patch_ncc allocate no memory.
 */

/**
 * A plane in the frame of a camera, normal . X = -distance. The layout of this struct is frozen.
 */
typedef struct skep_plane {
    /**
     * Unit normal that faces the camera.
     */
    double normal[3];
    /**
     * Distance from the center of the camera in world units, above 0.
     */
    double distance;
} skep_plane;

/**
 * Makes the plane with a given normal through the point of a pixel at a given depth.
 *
 * @param camera     The camera.
 * @param x          Column of the pixel; may be fractional.
 * @param y          Row of the pixel; may be fractional.
 * @param depth      Depth of the point in world units, above 0.
 * @param normal     3 doubles: unit normal in the camera frame that faces the camera (n . ray < 0).
 * @param plane_out  Receives the plane in the camera frame.
 * @retval SKEP_ERR_ARGUMENT  A camera, coordinate, depth or normal that cannot be used.
 */
skep_status skep_plane_through(const struct skep_camera *camera,
                               double x,
                               double y,
                               double depth,
                               const double *normal,
                               struct skep_plane *plane_out);

/**
 * Computes the homographies that planes induce from the pixels of one camera to those of another, H = K' (R
 * - t n^T / D) K^-1 (equation 2 of the paper), so that (x', y', 1) ~ H (x, y, 1).
 *
 * @param reference     The camera in whose frame the planes are.
 * @param source        The other camera.
 * @param planes        `count` planes.
 * @param count         Number of planes.
 * @param homographies  Receives 9 * count doubles: each matrix row by row; may be NULL when `count` is 0.
 * @retval SKEP_ERR_ARGUMENT  A camera or plane that cannot be used.
 */
skep_status skep_plane_homographies(const struct skep_camera *reference,
                                    const struct skep_camera *source,
                                    const struct skep_plane *planes,
                                    size_t count,
                                    double *homographies);

/**
 * Copies an image into the memory layout that the kernels sample. Colors are converted to gray as in
 * skep_scene_add_view.
 *
 * @param image             The pixels.
 * @param packed_image_out  Receives the packed image; destroy it with skep_packed_image_destroy.
 * @retval SKEP_ERR_ARGUMENT  A size, stride, format or float pixel that cannot be used.
 */
skep_status skep_packed_image_create(const struct skep_image *image,
                                     struct skep_packed_image **packed_image_out);

/**
 * Destroys a packed image.
 *
 * @param packed_image  The packed image; NULL is ignored.
 */
void skep_packed_image_destroy(struct skep_packed_image *packed_image);

/**
 * Creates a square window of samples. A sample weighs exp(-r^2 / (2 sigma_spatial^2) - dI^2 / (2
 * sigma_color^2)), with r its distance from the center in pixels and dI its difference in gray value from
 * the center, of [0, 1].
 *
 * The window keeps the instruction set that skep_simd_level_name returns at this moment.
 *
 * @param radius          Half the side of the window in pixels, 1 to 16.
 * @param step            Distance between samples in pixels, 1 to 8.
 * @param sigma_spatial   Sigma of the weight in space in pixels, at least 0.001; INFINITY: no such weight.
 * @param sigma_color     Sigma of the weight in gray value, of [0, 1], at least 0.001; INFINITY: no such
 *                        weight.
 * @param min_variance    Weighted variance of gray values below which a patch has no texture, 0 to 1; 1e-5
 *                        suits photographs.
 * @param ncc_window_out  Receives the window; destroy it with skep_ncc_window_destroy.
 * @retval SKEP_ERR_ARGUMENT  A number out of its range.
 */
skep_status skep_ncc_window_create(uint32_t radius,
                                   uint32_t step,
                                   double sigma_spatial,
                                   double sigma_color,
                                   double min_variance,
                                   struct skep_ncc_window **ncc_window_out);

/**
 * Destroys a window.
 *
 * @param window  The window; NULL is ignored.
 */
void skep_ncc_window_destroy(struct skep_ncc_window *window);

/**
 * Computes the normalized cross-correlation (NCC) of patches of the reference image with the patches of the
 * source image that homographies map them to. Samples outside of the reference image have no weight; outside
 * of the source image its border is repeated. The source is interpolated bilinearly at positions truncated
 * to 1/256 pixel, so that an NCC differs from the exact one by some 1e-4.
 *
 * Consecutive patches at the same pixel share the samples of the reference: sort by pixel.
 *
 * @param window        The window.
 * @param reference     The reference image.
 * @param source        The source image.
 * @param pixels        2 * count numbers: x, y of the center of each patch in the reference image.
 * @param homographies  9 * count doubles: maps pixels of the reference to pixels of the source, row by row,
 *                      one for each patch.
 * @param count         Number of patches.
 * @param ncc           Receives `count` floats from -1 to 1; -1 also where either patch has no texture; may
 *                      be NULL when `count` is 0.
 * @retval SKEP_ERR_ARGUMENT  A pixel outside of the reference image, or a homography that is not finite.
 */
skep_status skep_patch_ncc(const struct skep_ncc_window *window,
                           const struct skep_packed_image *reference,
                           const struct skep_packed_image *source,
                           const uint32_t *pixels,
                           const double *homographies,
                           size_t count,
                           float *ncc);

/* ---- Files --------------------------------------------------------------------------------------------- */

/**
 * Reads a scene of any format that skep_job_plan reads: a COLMAP workspace or model with any lens, text or
 * binary, nerfstudio's transforms.json, OpenMVS, MVSNet, OpenSfM, Middlebury. Photographs are undistorted;
 * the options `input.*` choose, reduce and mask them. Uses threads of its own, as many as the option
 * `threads` says.
 *
 * @param path             Path of the scene, a folder or a file, in the bytes of the file system.
 * @param options_or_null  Options, of which `input.*`, `threads` and `memory` count; NULL for the defaults.
 * @param near             Smallest depth of every view in world units; 0 with `far` 0 derives the ranges
 *                         from the scene.
 * @param far              Largest depth of every view in world units.
 * @param progress_or_null  Receives the progress of reading the photographs and may cancel; NULL: none.
 * @param user             Passed to the callback; may be NULL.
 * @param scene_out        Receives the scene; destroy it with skep_scene_destroy. skep_scene_get_warning
 *                         tells what was found out while it was read.
 * @retval SKEP_ERR_ARGUMENT  Not 0 < near < far, a choice that fits no photograph, or a scene that
 *                            skep_scene_validate refuses.
 * @retval SKEP_ERR_FILE      A file that is missing or cannot be used; the text names the file, the line
 *                            where there is one, and what was expected.
 * @retval SKEP_ERR_MEMORY    Photographs that do not fit.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
 */
skep_status skep_scene_read(const char *path,
                            const struct skep_options *options_or_null,
                            double near,
                            double far,
                            skep_progress_fn progress_or_null,
                            void *user,
                            struct skep_scene **scene_out);

/**
 * Writes a scene as a folder that COLMAP and skep_scene_read read: images as PNG files under the
 * names of their views in images/, and a binary model in sparse/. A name need not end in .png: readers of
 * images look at the content.
 *
 * @param scene   The scene.
 * @param folder  Path of the folder, which is created.
 * @retval SKEP_ERR_ARGUMENT  A view whose name leads out of the folder, or a scene that skep_scene_validate
 *                            refuses.
 * @retval SKEP_ERR_FILE      A file that cannot be written.
 */
skep_status skep_scene_write_colmap(const struct skep_scene *scene, const char *folder);

/**
 * Writes what COLMAP calls a dense folder, except images/ and sparse/, which skep_scene_write_colmap writes:
 * for every view of the result depth maps, normal maps and consistency graphs in stereo/, raw
 * ("photometric") and validated ("geometric"), and previews in preview/; the lists of images for COLMAP in
 * stereo/; fused.ply with fused.ply.vis if there is a cloud. A file appears when it is complete.
 *
 * @param result  The result.
 * @param scene   The scene that the result was made from.
 * @param folder  Path of the folder, which is created.
 * @retval SKEP_ERR_ARGUMENT  Another scene, or a view whose name leads out of the folder.
 * @retval SKEP_ERR_FILE      A file that cannot be written.
 */
skep_status skep_result_write_workspace(const struct skep_result *result,
                                        const struct skep_scene *scene,
                                        const char *folder);

/**
 * Writes a cloud as binary PLY (x, y, z, normals, colors), and the views of each point beside it in
 * FILE.vis, as COLMAP does. x, y and z are float, or double where floats cannot hold the distances of the
 * points, as with geographic coordinates.
 *
 * @param cloud  The cloud.
 * @param file   Path of the file.
 * @retval SKEP_ERR_FILE  A file that cannot be written.
 */
skep_status skep_cloud_write_ply(const struct skep_cloud *cloud, const char *file);

/**
 * Writes a depth map in COLMAP's layout.
 *
 * @param file          Path of the file.
 * @param depth         height rows of width floats: finite depths, 0 for none.
 * @param width         Width in pixels, 1 to 32768.
 * @param height        Height in pixels, 1 to 32768.
 * @param stride_bytes  Bytes from a row of `depth` to the next, at least 4 * width.
 * @retval SKEP_ERR_ARGUMENT  A size, stride or depth that cannot be used.
 * @retval SKEP_ERR_FILE      The file cannot be written.
 */
skep_status skep_write_depth_map(const char *file,
                                 const float *depth,
                                 uint32_t width,
                                 uint32_t height,
                                 size_t stride_bytes);

/**
 * Writes a normal map in COLMAP's layout.
 *
 * @param file          Path of the file.
 * @param normal        height rows of 3 * width floats: x, y, z of each pixel, finite.
 * @param width         Width in pixels, 1 to 32768.
 * @param height        Height in pixels, 1 to 32768.
 * @param stride_bytes  Bytes from a row of `normal` to the next, at least 12 * width.
 * @retval SKEP_ERR_ARGUMENT  A size, stride or normal that cannot be used.
 * @retval SKEP_ERR_FILE      The file cannot be written.
 */
skep_status skep_write_normal_map(const char *file,
                                  const float *normal,
                                  uint32_t width,
                                  uint32_t height,
                                  size_t stride_bytes);

/**
 * Writes a consistency graph in COLMAP's layout: the views that each pixel is consistent with. Pixels
 * without any are left out of the file.
 *
 * @param file        Path of the file.
 * @param width       Width in pixels, 1 to 32768.
 * @param height      Height in pixels, 1 to 32768.
 * @param counts      width * height numbers: how many views each pixel has.
 * @param views       `view_total` numbers of views, pixel after pixel.
 * @param view_total  Sum of `counts`.
 * @retval SKEP_ERR_ARGUMENT  A size that cannot be used, a `view_total` that is not the sum of `counts`, or
 *                            a number above 2^31 - 1.
 * @retval SKEP_ERR_FILE      The file cannot be written.
 */
skep_status skep_write_consistency_graph(const char *file,
                                         uint32_t width,
                                         uint32_t height,
                                         const uint32_t *counts,
                                         const uint32_t *views,
                                         size_t view_total);

/**
 * Reads a depth map in COLMAP's layout, row after row without gaps.
 *
 * @param file        Path of the file.
 * @param depth       Receives width * height floats; may be NULL to ask for the size.
 * @param capacity    Elements of room in `depth`.
 * @param width_out   Receives the width in pixels.
 * @param height_out  Receives the height in pixels.
 * @retval SKEP_ERR_FILE      A file that is missing, truncated or in another layout.
 * @retval SKEP_ERR_CAPACITY  `capacity` is below width * height.
 */
skep_status skep_read_depth_map(const char *file,
                                float *depth,
                                size_t capacity,
                                uint32_t *width_out,
                                uint32_t *height_out);

/**
 * Reads a normal map in COLMAP's layout, row after row without gaps.
 *
 * @param file        Path of the file.
 * @param normal      Receives 3 * width * height floats: x, y, z of each pixel; may be NULL to ask for the
 *                    size.
 * @param capacity    Elements of room in `normal`.
 * @param width_out   Receives the width in pixels.
 * @param height_out  Receives the height in pixels.
 * @retval SKEP_ERR_FILE      A file that is missing, truncated or in another layout.
 * @retval SKEP_ERR_CAPACITY  `capacity` is below 3 * width * height.
 */
skep_status skep_read_normal_map(const char *file,
                                 float *normal,
                                 size_t capacity,
                                 uint32_t *width_out,
                                 uint32_t *height_out);

/**
 * Reads a consistency graph in COLMAP's layout.
 *
 * @param file            Path of the file.
 * @param counts          Receives width * height numbers: how many views each pixel has; may be NULL to ask
 *                        for the size.
 * @param count_capacity  Elements of room in `counts`.
 * @param views           Receives `*view_total_out` numbers of views, pixel after pixel; may be NULL to ask
 *                        for their number.
 * @param view_capacity   Elements of room in `views`.
 * @param width_out       Receives the width in pixels.
 * @param height_out      Receives the height in pixels.
 * @param view_total_out  Receives the sum of `counts`.
 * @retval SKEP_ERR_FILE      A file that is missing, truncated or in another layout.
 * @retval SKEP_ERR_CAPACITY  A buffer is too small.
 */
skep_status skep_read_consistency_graph(const char *file,
                                        uint32_t *counts,
                                        size_t count_capacity,
                                        uint32_t *views,
                                        size_t view_capacity,
                                        uint32_t *width_out,
                                        uint32_t *height_out,
                                        size_t *view_total_out);

/* ---- Runs in a folder ---------------------------------------------------------------------------------- */

/*
 * A run is a set of tasks. skep_job_run does all of them; a host with a scheduler of its own calls
 * skep_job_run_task in this order, those of a line at the same time if it likes, each process with a job
 * that skep_job_open gave:
 *
 *   for each cycle, from 0:  SKEP_TASK_SEARCH of every view
 *                            SKEP_TASK_CHECK of every view
 *                            SKEP_TASK_NEXT
 *   then                     SKEP_TASK_FINISH of every view
 *                            SKEP_TASK_FUSE
 *
 * A task that is done, or of a cycle that the run skips, succeeds at once. The results are files in the
 * folder, which is a COLMAP workspace: stereo/, preview/, fused.ply. The options of the group "output"
 * choose among them.
 */

/**
 * Task: search the planes of a view in a cycle.
 */
#define SKEP_TASK_SEARCH 0

/**
 * Task: check the planes of a view in a cycle, after all views were searched.
 */
#define SKEP_TASK_CHECK 1

/**
 * Task: decide which cycle follows, after all views were checked.
 */
#define SKEP_TASK_NEXT 2

/**
 * Task: write the maps of a view, after the last cycle.
 */
#define SKEP_TASK_FINISH 3

/**
 * Task: fuse the maps, after all views are finished.
 */
#define SKEP_TASK_FUSE 4

/**
 * What a run needs, estimated before it starts.
 */
typedef struct skep_job_needs {
    /**
     * The least memory in bytes with which the run works.
     */
    uint64_t least_memory;
    /**
     * The memory in bytes that the run keeps to.
     */
    uint64_t memory;
    /**
     * Bytes on disk, at most at any time.
     */
    uint64_t disk;
    /**
     * CPU seconds of all threads together, within a factor of about two.
     */
    double cpu_seconds;
} skep_job_needs;

/**
 * Plans the run of a scene in files in a folder, which is created. A run of the same photographs, model,
 * options and version that began there goes on; anything else begins anew, and skep_job_get_notice tells
 * why. The options "threads", "memory" and "simd" may change. No other process can work on the run while the
 * job exists.
 *
 * @param scene            Path of the folder with images/ and a COLMAP model in sparse/ or sparse/0/, or of
 *                         a scene of another program, whose formats docs/formats.md lists.
 * @param near             Smallest depth of every view in world units; 0 with `far` 0 derives the ranges.
 * @param far              Largest depth of every view in world units.
 * @param options_or_null  The options, copied; NULL: the default preset.
 * @param folder           Path of the folder of the run.
 * @param fresh            Non-zero begins anew in any case.
 * @param progress_or_null  Receives the progress of reading the photographs and may cancel; NULL: none.
 * @param user             Passed to the callback; may be NULL.
 * @param job_out          Receives the job; destroy it with skep_job_destroy.
 * @retval SKEP_ERR_ARGUMENT  Options or depths out of range, less memory than the run needs, or a scene that
 *                            skep_scene_validate refuses.
 * @retval SKEP_ERR_FILE      A file that is missing or damaged; a folder that cannot be written, holds
 *                            another scene, or in which another process works.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero; an earlier run in the folder is as it was.
 */
skep_status skep_job_plan(const char *scene,
                          double near,
                          double far,
                          const struct skep_options *options_or_null,
                          const char *folder,
                          int32_t fresh,
                          skep_progress_fn progress_or_null,
                          void *user,
                          struct skep_job **job_out);

/**
 * Opens a run that was planned, to do some of its tasks; other processes may do others at the same time.
 *
 * @param folder           Path of the folder of the run.
 * @param options_or_null  Options "threads", "memory" and "simd"; the others are those the run was planned
 *                         with. NULL: the default preset.
 * @param job_out          Receives the job; destroy it with skep_job_destroy.
 * @retval SKEP_ERR_ARGUMENT  Less memory than the run needs.
 * @retval SKEP_ERR_FILE      No run of this version; a model that changed; another process that plans or
 *                            does the whole run.
 */
skep_status skep_job_open(const char *folder,
                          const struct skep_options *options_or_null,
                          struct skep_job **job_out);

/**
 * Destroys a job and unlocks its folder; what is done stays there.
 *
 * @param job  The job; NULL is ignored.
 */
void skep_job_destroy(struct skep_job *job);

/**
 * Gets the number of cycles of the schedule, and of views.
 *
 * @param job              The job.
 * @param cycle_count_out  Receives the number of cycles on all scales; may be NULL.
 * @param view_count_out   Receives the number of views; may be NULL.
 */
skep_status skep_job_get_count(const struct skep_job *job,
                               uint32_t *cycle_count_out,
                               uint32_t *view_count_out);

/**
 * Gets what the run needs.
 *
 * @param job        The job.
 * @param needs_out  Receives memory, disk and time.
 */
skep_status skep_job_get_needs(const struct skep_job *job, struct skep_job_needs *needs_out);

/**
 * Copies a notice on what became of an earlier run in the folder, or a warning about the scene.
 *
 * @param job         The job.
 * @param index       Number of the notice, from 0.
 * @param buffer      Receives up to `capacity` bytes, the last one NUL; may be NULL to ask for the size.
 * @param capacity    Bytes of room in `buffer`; a longer text is cut.
 * @param needed_out  Receives the bytes of the whole text with its NUL; may be NULL.
 * @retval SKEP_ERR_ARGUMENT  No such notice.
 */
skep_status skep_job_get_notice(const struct skep_job *job,
                                size_t index,
                                char *buffer,
                                size_t capacity,
                                size_t *needed_out);

/**
 * Gets the views whose files the tasks of a view read, ascending: its own, its sources, and those whose
 * source it is. A scheduler places tasks by them.
 *
 * @param job        The job.
 * @param view       Number of the view.
 * @param views      Receives `*count_out` numbers of views; may be NULL to ask for their number.
 * @param capacity   Elements of room in `views`; at most the number of views is needed.
 * @param count_out  Receives the number of views.
 * @retval SKEP_ERR_ARGUMENT  No such view.
 * @retval SKEP_ERR_CAPACITY  `capacity` is too small.
 */
skep_status skep_job_get_views_read(const struct skep_job *job,
                                    uint32_t view,
                                    uint32_t *views,
                                    size_t capacity,
                                    size_t *count_out);

/**
 * Does all tasks that are not done. Files that were damaged since they were written are made again.
 *
 * @param job               The job.
 * @param progress_or_null  Receives the progress and may cancel; NULL: none.
 * @param user              Passed to the callback; may be NULL.
 * @param point_count_out   Receives the number of points; may be NULL.
 * @retval SKEP_ERR_FILE       A file that cannot be read or written; what is done stays done, as in every
 *                             other case.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero; the same call goes on from there.
 */
skep_status skep_job_run(const struct skep_job *job,
                         skep_progress_fn progress_or_null,
                         void *user,
                         uint64_t *point_count_out);

/**
 * Does a task; nothing if it is done or needless. The tasks it depends on must be done. Several tasks may be
 * done at the same time, by threads, processes or machines.
 *
 * @param job               The job.
 * @param task              A SKEP_TASK_ value.
 * @param cycle             Number of the cycle; ignored by SKEP_TASK_FINISH and SKEP_TASK_FUSE.
 * @param view              Number of the view; ignored by SKEP_TASK_NEXT and SKEP_TASK_FUSE.
 * @param progress_or_null  Receives the progress and may cancel; NULL: none.
 * @param user              Passed to the callback; may be NULL.
 * @retval SKEP_ERR_ARGUMENT   No such task, cycle or view; a task it depends on is not done.
 * @retval SKEP_ERR_FILE       A file that is damaged, or cannot be written.
 * @retval SKEP_ERR_CANCELLED  The callback returned non-zero.
 */
skep_status skep_job_run_task(const struct skep_job *job,
                              uint32_t task,
                              uint32_t cycle,
                              uint32_t view,
                              skep_progress_fn progress_or_null,
                              void *user);

/**
 * Gets whether a task is done, or needless because a scale ended early.
 *
 * @param job       The job.
 * @param task      A SKEP_TASK_ value.
 * @param cycle     Number of the cycle; ignored by SKEP_TASK_FINISH and SKEP_TASK_FUSE.
 * @param view      Number of the view; ignored by SKEP_TASK_NEXT and SKEP_TASK_FUSE.
 * @param done_out  Receives 1 or 0.
 * @retval SKEP_ERR_ARGUMENT  No such task.
 */
skep_status skep_job_is_done(const struct skep_job *job,
                             uint32_t task,
                             uint32_t cycle,
                             uint32_t view,
                             int32_t *done_out);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* SKEP_H */
