/* skep: dense multi-view stereo on the CPU. This file is generated; it is also the manual.
 *
 * Calibrated photographs go in; depth, normal and source-view maps and a fused point cloud come out. There are three
 * levels, which can be mixed:
 *
 *   whole    skep_scene_create, skep_scene_add_view ..., skep_reconstruct, skep_result_get_..., skep_cloud_get_points
 *   stepwise skep_stepper_create, then search, check and propagate single views; skep_fuse fuses any maps
 *   kernels  skep_plane_homographies, skep_patch_ncc: stateless, no allocation
 *
 * and files: skep_scene_read_colmap, skep_result_write_workspace and others, for programs without a parser.
 *
 * What holds everywhere:
 *   - A call returns SKEP_OK or a negative status; skep_last_error then tells which argument was wrong, its value, and
 *     what would have been right. A call that fails writes nothing to its outputs and changes nothing.
 *   - Pointers must not be NULL unless their name or description says so; an array of 0 elements may be NULL. Numbers,
 *     sizes and order are checked; that memory is there, as large as was said, cannot be.
 *   - Inputs are copied, or only read during the call. Outputs belong to the caller. Objects from a ..._out parameter
 *     or a ..._create function are destroyed with their ..._destroy function, which takes NULL. What a call writes
 *     must not overlap what it reads, nor anything else it writes.
 *   - Sizes count elements; strides are bytes from one row to the next. Texts end in NUL and are UTF-8.
 *   - Any function may be called from any thread at any time, on different objects or on the same, except that an
 *     object must not be destroyed while another call uses it. The library keeps no global state, prints nothing,
 *     never exits, and leaves signal handlers alone.
 *   - The same input, options and library version give the same bits, for any number of threads and instruction set.
 *
 * C99 and C++98 and later. Until 1.0 every minor version may change the interface; the SONAME says so.
 */


#ifndef SKEP_H
#define SKEP_H

#include <stddef.h>
#include <stdint.h>

/**
 * Version of this interface, which rises with every incompatible change. The SONAME follows the library's version.
 */
#define SKEP_ABI_VERSION 1

/**
 * Done.
 */
#define SKEP_OK 0

/**
 * A pointer that must not be NULL is.
 */
#define SKEP_ERR_NULL -1

/**
 * A value cannot be used: out of range, not a number, of the wrong size, unknown, or in the wrong order.
 */
#define SKEP_ERR_ARGUMENT -2

/**
 * The object cannot be used any more: a call that was changing it panicked. Destroy it.
 */
#define SKEP_ERR_POISONED -3

/**
 * The progress callback asked to stop.
 */
#define SKEP_ERR_CANCELLED -4

/**
 * A file cannot be read, understood or written.
 */
#define SKEP_ERR_FILE -5

/**
 * A buffer is smaller than what goes into it.
 */
#define SKEP_ERR_CAPACITY -6

/**
 * An error of the library itself; please report the text.
 */
#define SKEP_ERR_PANIC -7

/**
 * Gray. An image's format is a layout, of 8 bits a channel, plus a depth when it is another: SKEP_FORMAT_BGR is 8-bit
 * BGR, SKEP_FORMAT_BGR + SKEP_FORMAT_16 is 16-bit BGR.
 */
#define SKEP_FORMAT_GRAY 0

/**
 * Red, green, blue.
 */
#define SKEP_FORMAT_RGB 1

/**
 * Blue, green, red, as OpenCV has it.
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
 * Added to a layout: uint16_t in the machine's byte order, 0 to 65535.
 */
#define SKEP_FORMAT_16 16

/**
 * Added to a layout: float, 0 to 1; values beyond are clamped.
 */
#define SKEP_FORMAT_FLOAT 32

/**
 * Bees search the solutions of a view.
 */
#define SKEP_PHASE_SEARCH 0

/**
 * Views check each other's solutions.
 */
#define SKEP_PHASE_CHECK 1

/**
 * Maps become points.
 */
#define SKEP_PHASE_FUSION 2

/**
 * The raw estimate of every pixel.
 */
#define SKEP_MAPS_RAW 0

/**
 * What was validated by other views; the rest is empty.
 */
#define SKEP_MAPS_VALIDATED 1

/**
 * The solution is consistent with enough source views.
 */
#define SKEP_PIXEL_VALIDATED 0

/**
 * The mask leaves the pixel out.
 */
#define SKEP_PIXEL_MASKED 1

/**
 * The window around the pixel is too uniform to be matched.
 */
#define SKEP_PIXEL_NO_TEXTURE 2

/**
 * Fewer than two source views can see the solution.
 */
#define SKEP_PIXEL_NO_SOURCES 3

/**
 * Too few source views agree with the solution.
 */
#define SKEP_PIXEL_INCONSISTENT 4

/**
 * The solution lies at an end of the depth range: the surface may lie beyond.
 */
#define SKEP_PIXEL_OUT_OF_RANGE 5

/**
 * No step: the run is done.
 */
#define SKEP_CYCLE_NONE 4294967295

/**
 * Planes that other views offer to the pixels of a view. Never changes.
 */
typedef struct skep_candidates skep_candidates;

/**
 * Fused points. Never changes: may be used from several threads at once.
 */
typedef struct skep_cloud skep_cloud;

/**
 * What is known of one view after it was searched in a step or, once checked, after the check. Never changes: may be
 * used from several threads at once.
 */
typedef struct skep_estimate skep_estimate;

/**
 * Where patches are sampled and how samples are weighted. Never changes: may be used from several threads at once.
 */
typedef struct skep_ncc_window skep_ncc_window;

/**
 * Every number the method depends on. May be used from several threads at once.
 */
typedef struct skep_options skep_options;

/**
 * A gray image in the layout the kernels sample. Never changes: may be used from several threads at once.
 */
typedef struct skep_packed_image skep_packed_image;

/**
 * Maps of views, and the cloud when they come from a whole run. Never changes: may be used from several threads at
 * once.
 */
typedef struct skep_result skep_result;

/**
 * Calibrated photographs and sparse points. May be used from several threads at once; runs that were started with it
 * keep what it was when they started. Pictures are copied in and shared from then on: a run does not copy them again.
 */
typedef struct skep_scene skep_scene;

/**
 * A run taken apart, for hosts that schedule views themselves, on one machine or on many, or that bring maps of their
 * own. Holds what all stepper share (images of all scales, source views, threads) and never changes: stepper of
 * different views may be taken at the same time from several threads. The scene may be destroyed.
 *
 * A run is this, for step 0 and then for what skep_stepper_next says, until that is SKEP_CYCLE_NONE:
 *   - when the step is on a finer scale than the estimates, skep_stepper_upsample each of them;
 *   - skep_stepper_propagate, then skep_stepper_search each view, all from the estimates the step before left;
 *   - skep_stepper_check each view against what all have just found: that is what the next step starts from.
 *
 * After the last, skep_stepper_finish each view, and skep_fuse the validated maps. Done so for all views, that gives the
 * same bits as skep_reconstruct.
 *
 * States are passed as an array with one pointer for each view of the scene. Looked at are only the view itself, its
 * sources, and the views it is a source of; NULL says that nothing is known of a view. (NULL, 0) knows of none.
 */
typedef struct skep_stepper skep_stepper;

/**
 * What a call came to: SKEP_OK or one of the negative SKEP_ERR_ codes. skep_last_error tells the rest.
 */
typedef int32_t skep_status;

/**
 * Pixels in the caller's memory, which is only read, and only during the call. This struct never changes.
 */
typedef struct skep_image {
    /**
     * The top-left pixel. 16-bit and float pixels need no alignment.
     */
    const void *data;
    /**
     * Pixels of a row, 1 to 32768.
     */
    uint32_t width;
    /**
     * Rows, 1 to 32768.
     */
    uint32_t height;
    /**
     * Bytes from a row to the next, at least those of a row's pixels; bytes between rows are not touched.
     */
    size_t stride_bytes;
    /**
     * Layout plus depth, from the SKEP_FORMAT_ values.
     */
    uint32_t format;
} skep_image;

/**
 * A pinhole camera without distortion. x_cam = rotation * X_world + translation, with x right, y down, z forward;
 * depth is z. The center of the top-left pixel is (0, 0), as in OpenCV; COLMAP's principal points are half a pixel
 * larger. This struct never changes.
 */
typedef struct skep_camera {
    /**
     * Focal lengths in pixels, above 0.
     */
    double fx;
    /**
     * See fx.
     */
    double fy;
    /**
     * Principal point in pixels.
     */
    double cx;
    /**
     * See cx.
     */
    double cy;
    /**
     * World to camera, row by row; orthonormal within 1e-4, determinant 1.
     */
    double rotation[9];
    /**
     * World to camera, in world units.
     */
    double translation[3];
} skep_camera;

/**
 * Where a call stands.
 */
typedef struct skep_progress {
    /**
     * Share of the whole call that is done, 0 to 1.
     */
    double done;
    /**
     * What is being done: a SKEP_PHASE_ value.
     */
    uint32_t phase;
    /**
     * Size of the images searched: 1 is full, 2 half, 4 a quarter.
     */
    uint32_t downscale;
    /**
     * The cycle on this scale, counted from 0.
     */
    uint32_t cycle;
    /**
     * The view at work.
     */
    uint32_t view;
    /**
     * Number of views.
     */
    uint32_t view_count;
} skep_progress;

/**
 * The host's callback: called about a hundred times a second, never twice at the same time, but from any thread of
 * the library. Non-zero cancels the call it is handed to, which then returns SKEP_ERR_CANCELLED, in general within
 * 100 ms. It must return soon, must not throw or unwind, and must not destroy what the call uses. NULL is a host that
 * neither looks nor stops.
 */
typedef int32_t (*skep_progress_fn)(void *user, const struct skep_progress *progress);

/**
 * What a view cost and what became of its pixels. Counts depend on input and options only, not on the machine.
 */
typedef struct skep_statistics {
    /**
     * Patches compared with a patch in one source view.
     */
    uint64_t ncc_evaluations;
    /**
     * Bilinear samples taken from source views.
     */
    uint64_t bilinear_samples;
    /**
     * Hypotheses given up before all their source views were looked at.
     */
    uint64_t early_terminations;
    /**
     * Number of pixels of each SKEP_PIXEL_ value; those beyond the last are 0.
     */
    uint64_t status_counts[8];
} skep_statistics;

/**
 * One cycle's search of one view.
 */
typedef struct skep_cycle_record {
    /**
     * Size of the images: 1 is full, 2 half, 4 a quarter.
     */
    uint32_t downscale;
    /**
     * The cycle on that scale, counted from 0.
     */
    uint32_t cycle;
    /**
     * Pixels searched.
     */
    uint64_t pixels;
    /**
     * Pixels whose solution changed.
     */
    uint64_t changed;
    /**
     * Pixels validated by the check after it.
     */
    uint64_t validated;
} skep_cycle_record;

/**
 * A view with maps to be fused, in the caller's memory, which is only read, and only during the call. This struct
 * never changes.
 */
typedef struct skep_fusion_view {
    /**
     * The camera of the maps.
     */
    const struct skep_camera *camera;
    /**
     * Width of the maps.
     */
    uint32_t width;
    /**
     * Height of the maps.
     */
    uint32_t height;
    /**
     * Depth of each pixel; one that is not a finite number above 0 is no estimate.
     */
    const float *depth;
    /**
     * Bytes from row to row of `depth`, at least 4 * width.
     */
    size_t depth_stride_bytes;
    /**
     * Normal of each pixel in the camera frame, x, y, z.
     */
    const float *normal;
    /**
     * Bytes from row to row of `normal`, at least 12 * width.
     */
    size_t normal_stride_bytes;
    /**
     * For the colors, of the maps' size; NULL gives gray points.
     */
    const struct skep_image *image_or_null;
    /**
     * The views that may see the same surface, as indices into the list of views; see skep_scene_get_overlap.
     */
    const uint32_t *overlap;
    /**
     * Number of those.
     */
    size_t overlap_count;
} skep_fusion_view;

/**
 * One cycle on one scale.
 */
typedef struct skep_cycle {
    /**
     * Size of the images: 1 is full, 2 half, 4 a quarter.
     */
    uint32_t downscale;
    /**
     * The cycle on that scale, counted from 0.
     */
    uint32_t cycle_on_scale;
    /**
     * Food sources of each pixel's colony.
     */
    uint32_t food_sources;
    /**
     * Rounds of bees.
     */
    uint32_t iterations;
} skep_cycle;

/**
 * What a estimate is.
 */
typedef struct skep_estimate_info {
    /**
     * The view it is of.
     */
    uint32_t view;
    /**
     * The step it was searched in, or whose scale it was handed up to.
     */
    uint32_t cycle;
    /**
     * 1 when it carries the verdicts of a check, else 0.
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
     * Pixels whose solution the last search changed.
     */
    uint64_t changed;
    /**
     * Pixels the last check validated.
     */
    uint64_t validated;
    /**
     * NCC evaluations spent on the view so far.
     */
    uint64_t ncc_evaluations;
} skep_estimate_info;

/**
 * A plane in the reference camera's frame: normal . X = -distance, with a unit normal that faces the camera and a
 * distance above 0. This struct never changes.
 */
typedef struct skep_plane {
    /**
     * Unit normal.
     */
    double normal[3];
    /**
     * Distance from the camera's center.
     */
    double distance;
} skep_plane;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The SKEP_ABI_VERSION the library was built with. Compare it with the one of the header you compiled against.
 */
uint32_t skep_abi_version(void);

/**
 * The library's version, such as "0.1.0"; static.
 */
const char *skep_version(void);

/**
 * The instruction set that runs are made on unless an option says otherwise: "scalar", "baseline" or "v3" (AVX2); static.
 * The environment variable SKEP_SIMD forces one of them, lowered to what the machine has. Results do not depend on it.
 */
const char *skep_simd_level_name(void);

/**
 * A word for a status, such as "argument"; static, never NULL.
 */
const char *skep_status_name(skep_status status);

/**
 * Copies the text of the last call of this thread that failed: the argument, its value, and what would have been
 * right. Empty before the first failure; calls that succeed leave it alone.
 *
 * At most `capacity` bytes are written, the last of them NUL; a longer text is cut between characters. (NULL, 0) only
 * asks for the length. Returns the bytes the whole text takes with its NUL.
 */
size_t skep_last_error(char *buffer,
                       size_t capacity);

/**
 * Makes options from a preset: "default" (or NULL), which measures best, "fast", which takes less than half of
 * its time, or "paper", which follows the paper to the letter.
 */
skep_status skep_options_create(const char *preset_or_null,
                                struct skep_options **options_out);

/**
 * Destroys options; NULL is ignored. Runs that were started with them are not touched.
 */
void skep_options_destroy(struct skep_options *options);

/**
 * Sets an option that is a number. Switches are 0 or 1; whole numbers must be whole. The list of options above explains
 * each; where a name is the only one without its group, it may be left out.
 *
 * SKEP_ERR_ARGUMENT: no option of this name, or one that is a text, or a value out of its range.
 */
skep_status skep_options_set(struct skep_options *options,
                             const char *name,
                             double value);

/**
 * Gets an option that is a number; switches are 0 or 1.
 *
 * SKEP_ERR_ARGUMENT: no option of this name, or one that is a text.
 */
skep_status skep_options_get(const struct skep_options *options, const char *name, double *value_out);

/**
 * Sets any option from its text: a number, "true" or "false", a name, or a schedule such as
 * "downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1".
 *
 * SKEP_ERR_ARGUMENT: no option of this name, or a text or value that it does not take.
 */
skep_status skep_options_set_text(struct skep_options *options, const char *name, const char *value);

/**
 * Copies the text of any option, which skep_options_set_text takes; see skep_scene_get_name for the buffer.
 *
 * SKEP_ERR_ARGUMENT: no option of this name.
 */
skep_status skep_options_get_text(const struct skep_options *options,
                                  const char *name,
                                  char *buffer,
                                  size_t capacity,
                                  size_t *needed_out);

/**
 * The name of the option with this index, counted from 0; static. NULL after the last.
 */
const char *skep_option_name(size_t index);

/**
 * Makes an empty scene.
 */
skep_status skep_scene_create(struct skep_scene **scene_out);

/**
 * Destroys a scene; NULL is ignored. Results, steps and clouds made from it stay.
 */
void skep_scene_destroy(struct skep_scene *scene);

/**
 * Adds a photograph, copied, rounded to 8 bits a channel; gray is the luma of colors (ITU-R BT.601). `name_or_null`
 * (UTF-8, copied) names it in messages and files; NULL names it "view0000.png" by its number. Views are numbered in the
 * order they are added; `view_out`, which may be NULL, receives the number.
 */
skep_status skep_scene_add_view(struct skep_scene *scene,
                                const char *name_or_null,
                                const struct skep_image *image,
                                const struct skep_camera *camera,
                                uint32_t *view_out);

/**
 * Says where depths are wanted in a view: one byte for each pixel, `stride_bytes` from row to row, 0 where none is
 * wanted. Masked pixels still serve as sources for other views. NULL takes the mask away.
 */
skep_status skep_scene_set_mask(struct skep_scene *scene,
                                uint32_t view,
                                const uint8_t *mask_or_null,
                                size_t stride_bytes);

/**
 * Says between which depths surfaces are looked for in a view, in world units, 0 < near < far. (0, 0) goes back to
 * the range that the sparse points the view saw suggest, which is the default.
 */
skep_status skep_scene_set_depth_range(struct skep_scene *scene,
                                       uint32_t view,
                                       double near,
                                       double far);

/**
 * Says which views a view is matched with, the most important first, each at most once, not itself. They may be added
 * later. (NULL, 0) goes back to choosing them by their triangulation angle, which is the default.
 */
skep_status skep_scene_set_sources(struct skep_scene *scene,
                                   uint32_t view,
                                   const uint32_t *sources,
                                   size_t count);

/**
 * Adds sparse points with the views that saw them, copied. `positions` holds x, y, z of each point; `view_counts` the
 * number of views of each, and `views` their numbers, point after point, `view_total` in all.
 *
 * The views may be added later. Points give the depth ranges and choose the source views; without any, give each view
 * a depth range.
 */
skep_status skep_scene_add_points(struct skep_scene *scene,
                                  const double *positions,
                                  size_t count,
                                  const uint32_t *view_counts,
                                  const uint32_t *views,
                                  size_t view_total);

/**
 * Checks the scene as a run would: at least two views, points and sources that name views there are, a depth range
 * for every view. A run checks it too.
 */
skep_status skep_scene_validate(const struct skep_scene *scene);

/**
 * The number of views.
 */
skep_status skep_scene_get_view_count(const struct skep_scene *scene, uint32_t *count_out);

/**
 * A view's size and camera. Each output may be NULL.
 */
skep_status skep_scene_get_view(const struct skep_scene *scene,
                                uint32_t view,
                                uint32_t *width_out,
                                uint32_t *height_out,
                                struct skep_camera *camera_out);

/**
 * Copies a view's name as skep_last_error copies its text: at most `capacity` bytes with the NUL. `needed_out`, which
 * may be NULL, receives the bytes the whole name takes with its NUL.
 */
skep_status skep_scene_get_name(const struct skep_scene *scene,
                                uint32_t view,
                                char *buffer,
                                size_t capacity,
                                size_t *needed_out);

/**
 * The depth range a run would search in a view: its own, or the one its sparse points suggest.
 */
skep_status skep_scene_get_depth_range(const struct skep_scene *scene,
                                       uint32_t view,
                                       double *near_out,
                                       double *far_out);

/**
 * The source views a run with these options would match a view with. `sources` may be NULL to only ask for their
 * number.
 */
skep_status skep_scene_get_sources(const struct skep_scene *scene,
                                   const struct skep_options *options_or_null,
                                   uint32_t view,
                                   uint32_t *sources,
                                   size_t capacity,
                                   size_t *count_out);

/**
 * The views that may see the same surface as a view, which is what fusion asks: those that saw a sparse point together
 * with it, or all others when it saw none. `views` may be NULL to only ask for their number.
 */
skep_status skep_scene_get_overlap(const struct skep_scene *scene,
                                   uint32_t view,
                                   uint32_t *views,
                                   size_t capacity,
                                   size_t *count_out);

/**
 * The triangulation angle of two views in degrees: the 75th percentile of the angles at the sparse points both saw
 * or, where they share fewer than three, at the geometric mean of `reference`'s depth range. -1 when they
 * see nothing together.
 */
skep_status skep_scene_get_triangulation_angle(const struct skep_scene *scene,
                                               uint32_t reference,
                                               uint32_t source,
                                               double *degrees_out);

/**
 * Estimates depth, normal and source views of every pixel of every view, and fuses what was validated.
 *
 * Runs on threads of its own (option "threads"), which have ended when it returns; any number of runs may go on at the
 * same time. The same scene, options and library version give the same bits for any number of threads and any
 * instruction set. When it is cancelled or fails, `result_out` is not written.
 *
 * SKEP_ERR_ARGUMENT: the scene is not in order (see skep_scene_validate) or an option is out of range.
 */
skep_status skep_reconstruct(const struct skep_scene *scene,
                             const struct skep_options *options_or_null,
                             skep_progress_fn progress_or_null,
                             void *user,
                             struct skep_result **result_out);

/**
 * Destroys a result; NULL is ignored. Clouds taken from it stay.
 */
void skep_result_destroy(struct skep_result *result);

/**
 * The cloud of a whole run, as an object of its own that is destroyed by itself; the points are not copied.
 *
 * SKEP_ERR_ARGUMENT: the result of a single view has no cloud.
 */
skep_status skep_result_get_cloud(const struct skep_result *result, struct skep_cloud **cloud_out);

/**
 * The numbers of the views in a result, ascending: all of the scene's after a whole run. `views` may be NULL to only
 * ask for how many there are.
 */
skep_status skep_result_get_views(const struct skep_result *result,
                                  uint32_t *views,
                                  size_t capacity,
                                  size_t *count_out);

/**
 * Copies one of the sentences about the run that its user should read, such as views without any source view;
 * `index` counts from 0. See skep_scene_get_name for the buffer.
 *
 * SKEP_ERR_ARGUMENT: there is no such warning; asking until then lists them all.
 */
skep_status skep_result_get_warning(const struct skep_result *result,
                                    size_t index,
                                    char *buffer,
                                    size_t capacity,
                                    size_t *needed_out);

/**
 * Copies a view's depth map: width floats a row, height rows, `stride_bytes` from row to row (at least 4 * width).
 * World units, 0 where there is no estimate. `which` is a SKEP_MAPS_ value.
 */
skep_status skep_result_get_depth(const struct skep_result *result,
                                  uint32_t view,
                                  uint32_t which,
                                  float *out,
                                  size_t stride_bytes);

/**
 * Copies a view's normal map: x, y, z of each pixel, so 3 * width floats a row (`stride_bytes` at least 12 * width).
 * Unit vectors in the view's camera frame that face the camera, zeros where there is no estimate.
 */
skep_status skep_result_get_normal(const struct skep_result *result,
                                   uint32_t view,
                                   uint32_t which,
                                   float *out,
                                   size_t stride_bytes);

/**
 * Copies the matching cost of every pixel's raw estimate: the mean of 1 - NCC over its source views, 0 to 2; lower is
 * surer. `stride_bytes` is at least 4 * width.
 */
skep_status skep_result_get_cost(const struct skep_result *result,
                                 uint32_t view,
                                 float *out,
                                 size_t stride_bytes);

/**
 * Copies what became of every pixel, a SKEP_PIXEL_ value each: the reason where there is no validated depth.
 */
skep_status skep_result_get_status(const struct skep_result *result,
                                   uint32_t view,
                                   uint8_t *out,
                                   size_t stride_bytes);

/**
 * Copies the number of source views of every pixel; `stride_bytes` is at least 2 * width.
 */
skep_status skep_result_get_source_count(const struct skep_result *result,
                                         uint32_t view,
                                         uint16_t *out,
                                         size_t stride_bytes);

/**
 * Copies which source views each pixel was matched with, as bits, 32 of them: bit i of pixel (x, y) stands for entry
 * 32 * word + i of skep_result_get_sources. One uint32_t a pixel; ask for word 0, 1, ... as long as there are
 * sources. `stride_bytes` is at least 4 * width.
 */
skep_status skep_result_get_source_bits(const struct skep_result *result,
                                        uint32_t view,
                                        uint32_t word,
                                        uint32_t *out,
                                        size_t stride_bytes);

/**
 * The source views of a view, as numbers of the scene's views. `sources` may be NULL to only ask for their number.
 */
skep_status skep_result_get_sources(const struct skep_result *result,
                                    uint32_t view,
                                    uint32_t *sources,
                                    size_t capacity,
                                    size_t *count_out);

/**
 * Width and height of a view's maps.
 */
skep_status skep_result_get_size(const struct skep_result *result,
                                 uint32_t view,
                                 uint32_t *width_out,
                                 uint32_t *height_out);

/**
 * What a view cost and what became of its pixels.
 */
skep_status skep_result_get_statistics(const struct skep_result *result,
                                       uint32_t view,
                                       struct skep_statistics *statistics_out);

/**
 * The cycles of a view in order. `cycles` may be NULL to only ask for their number.
 */
skep_status skep_result_get_cycles(const struct skep_result *result,
                                   uint32_t view,
                                   struct skep_cycle_record *cycles,
                                   size_t capacity,
                                   size_t *count_out);

/**
 * The raw depth map inside the result, without a copy: height rows of width floats, dense. Valid until the result is
 * destroyed; only to be read.
 */
skep_status skep_result_borrow_depth(const struct skep_result *result,
                                     uint32_t view,
                                     const float **depth_out);

/**
 * The raw normal map inside the result, without a copy: height rows of width times x, y, z, dense. Valid until the
 * result is destroyed; only to be read.
 */
skep_status skep_result_borrow_normal(const struct skep_result *result,
                                      uint32_t view,
                                      const float **normal_out);

/**
 * The costs inside the result, without a copy, as skep_result_get_cost explains them. Valid until the result is
 * destroyed; only to be read.
 */
skep_status skep_result_borrow_cost(const struct skep_result *result,
                                    uint32_t view,
                                    const float **cost_out);

/**
 * The SKEP_PIXEL_ values inside the result, without a copy: height rows of width bytes, dense. Valid until the result
 * is destroyed; only to be read.
 */
skep_status skep_result_borrow_status(const struct skep_result *result,
                                      uint32_t view,
                                      const uint8_t **status_out);

/**
 * Destroys a cloud; NULL is ignored.
 */
void skep_cloud_destroy(struct skep_cloud *cloud);

/**
 * The number of points and, when `view_total_out` is not NULL, the lengths of their view lists added up.
 */
skep_status skep_cloud_get_count(const struct skep_cloud *cloud, size_t *count_out, size_t *view_total_out);

/**
 * Copies the points: `positions` x, y, z in the world (3 doubles a point), `normals` unit vectors in the world (3
 * floats a point), `colors` red, green, blue (3 bytes a point, 128 where no picture was given). Any of them may be
 * NULL. `capacity` is the number of points each buffer has room for; SKEP_ERR_CAPACITY when it is less than there are.
 */
skep_status skep_cloud_get_points(const struct skep_cloud *cloud,
                                  double *positions,
                                  float *normals,
                                  uint8_t *colors,
                                  size_t capacity);

/**
 * Copies the views each point was fused from, the one it started in first: `view_counts` their number for each point
 * (room for `capacity`), `views` their numbers, point after point (room for `view_capacity`; skep_cloud_get_count says
 * how many there are). Either may be NULL.
 */
skep_status skep_cloud_get_views(const struct skep_cloud *cloud,
                                 uint32_t *view_counts,
                                 size_t capacity,
                                 uint32_t *views,
                                 size_t view_capacity);

/**
 * Fuses maps into points, with the "fusion." options and "threads". Results of a run fused with their validated maps,
 * images and overlaps give the run's own cloud to the bit.
 *
 * SKEP_ERR_ARGUMENT: a camera, size, stride, image or overlap that makes no sense, named like "views[2].depth".
 */
skep_status skep_fuse(const struct skep_fusion_view *views,
                      size_t view_count,
                      const struct skep_options *options_or_null,
                      skep_progress_fn progress_or_null,
                      void *user,
                      struct skep_cloud **cloud_out);

/**
 * Prepares the stepper of a run.
 *
 * SKEP_ERR_ARGUMENT: the scene is not in order (see skep_scene_validate) or an option is out of range.
 */
skep_status skep_stepper_create(const struct skep_scene *scene,
                                const struct skep_options *options_or_null,
                                struct skep_stepper **stepper_out);

/**
 * Destroys stepper and ends their threads; NULL is ignored. States and results stay.
 */
void skep_stepper_destroy(struct skep_stepper *stepper);

/**
 * The number of stepper, and of views. Either output may be NULL.
 */
skep_status skep_stepper_get_count(const struct skep_stepper *stepper,
                                   uint32_t *cycle_count_out,
                                   uint32_t *view_count_out);

/**
 * What a step does.
 */
skep_status skep_stepper_get_cycle(const struct skep_stepper *stepper,
                                   uint32_t cycle,
                                   struct skep_cycle *cycle_out);

/**
 * Width and height of a view's maps at a step.
 */
skep_status skep_stepper_get_size(const struct skep_stepper *stepper,
                                  uint32_t cycle,
                                  uint32_t view,
                                  uint32_t *width_out,
                                  uint32_t *height_out);

/**
 * The source views of a view: those whose estimates its stepper look at. `sources` may be NULL to only ask for their number.
 */
skep_status skep_stepper_get_sources(const struct skep_stepper *stepper,
                                     uint32_t view,
                                     uint32_t *sources,
                                     size_t capacity,
                                     size_t *count_out);

/**
 * The planes that other views offer to a view: their consistent solutions where it has no validated one of its own.
 * From checked estimates.
 */
skep_status skep_stepper_propagate(const struct skep_stepper *stepper,
                                   uint32_t cycle,
                                   uint32_t view,
                                   const struct skep_estimate *const *estimates,
                                   size_t estimate_count,
                                   struct skep_candidates **candidates_out);

/**
 * Destroys candidates; NULL is ignored.
 */
void skep_candidates_destroy(struct skep_candidates *candidates);

/**
 * Searches a view for one cycle: from its own estimate, helped by what is validated in its sources and by what is offered.
 * Without a estimate of its own it starts at random. From checked estimates on the step's scale; gives one that is still to
 * be checked. When it is cancelled or fails, `estimate_out` is not written.
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
 * Checks a view's solutions against what its sources have just found, and gives its estimate with the verdicts in it. From
 * estimates that skep_stepper_search gave; a source whose estimate is NULL cannot speak.
 */
skep_status skep_stepper_check(const struct skep_stepper *stepper,
                               uint32_t cycle,
                               uint32_t view,
                               const struct skep_estimate *const *estimates,
                               size_t estimate_count,
                               struct skep_estimate **estimate_out);

/**
 * A checked estimate on the next finer scale, that of `step`: each pixel gets the plane of its coarse pixel.
 */
skep_status skep_stepper_upsample(const struct skep_stepper *stepper,
                                  uint32_t cycle,
                                  uint32_t view,
                                  const struct skep_estimate *estimate,
                                  struct skep_estimate **estimate_out);

/**
 * The step to take after `step` was taken for all views; SKEP_CYCLE_NONE after the last. A scale ends early when too
 * few pixels of the given estimates, which are checked ones of `step`, changed (option "stop_share").
 */
skep_status skep_stepper_next(const struct skep_stepper *stepper,
                              uint32_t cycle,
                              const struct skep_estimate *const *estimates,
                              size_t estimate_count,
                              uint32_t *next_out);

/**
 * Averages planes with those of the source views, closes small gaps, and settles source views, cost and status of
 * every pixel of a view after the last step, from checked estimates. The result holds this view alone, under its own
 * number.
 */
skep_status skep_stepper_finish(const struct skep_stepper *stepper,
                                uint32_t view,
                                const struct skep_estimate *const *estimates,
                                size_t estimate_count,
                                skep_progress_fn progress_or_null,
                                void *user,
                                struct skep_result **result_out);

/**
 * Makes a estimate from the caller's own maps, as if it had been checked in `step`. The maps have the size that
 * skep_stepper_get_size tells for that step: `depth` in world units, 0 for none; `normal` unit x, y, z in the camera
 * frame, facing the camera, where there is a depth. `validated_or_null`: one byte a pixel, not 0 where the solution
 * counts as validated; NULL validates all that have a depth. `cost_or_null`: at least 0, kept to a 256th, ranks what is
 * offered to other views; NULL is 0. Strides in bytes; those of NULL maps are ignored.
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
 * Destroys a estimate; NULL is ignored.
 */
void skep_estimate_destroy(struct skep_estimate *estimate);

/**
 * What a estimate is.
 */
skep_status skep_estimate_get_info(const struct skep_estimate *estimate, struct skep_estimate_info *info_out);

/**
 * Copies a estimate's maps, row after row without gaps, `capacity` pixels of room in each: `depth` (1 float a pixel, 0
 * where there is none), `normal` (3 floats), `cost` (1 float, the aggregated cost of the search, to a
 * 256th), `validated` (1 byte, 1 where the check validated the solution). Any of them may be NULL.
 */
skep_status skep_estimate_get_maps(const struct skep_estimate *estimate,
                                   float *depth,
                                   float *normal,
                                   float *cost,
                                   uint8_t *validated,
                                   size_t capacity);

/**
 * Saves a estimate as bytes, to keep it or to send it to another machine. `size_out` receives how many there are; with
 * `buffer` NULL nothing else happens.
 *
 * SKEP_ERR_CAPACITY: they do not fit into `capacity`.
 */
skep_status skep_estimate_save(const struct skep_estimate *estimate,
                               uint8_t *buffer,
                               size_t capacity,
                               size_t *size_out);

/**
 * Loads a estimate that was saved by the same version of the library, for stepper of the same scene and options.
 *
 * SKEP_ERR_ARGUMENT: bytes that are no estimate, are cut or too many, or do not fit the stepper.
 */
skep_status skep_estimate_load(const struct skep_stepper *stepper,
                               const uint8_t *bytes,
                               size_t size,
                               struct skep_estimate **estimate_out);

/**
 * The plane with this unit normal through the point at `depth` behind a pixel, which need not be whole.
 *
 * Stateless, like all kernels here: any number of threads, no allocation.
 */
skep_status skep_plane_through(const struct skep_camera *camera,
                               double x,
                               double y,
                               double depth,
                               const double *normal,
                               struct skep_plane *plane_out);

/**
 * The homographies that planes induce from pixels of one camera to pixels of another, H = K' (R - t n^T / D) K^-1
 * (equation 2 of the paper): 9 doubles each, row by row, so that (x', y', 1) ~ H (x, y, 1). `homographies` has room
 * for 9 * count doubles.
 */
skep_status skep_plane_homographies(const struct skep_camera *reference,
                                    const struct skep_camera *source,
                                    const struct skep_plane *planes,
                                    size_t count,
                                    double *homographies);

/**
 * Copies an image into the layout the kernels sample; colors become gray as in skep_scene_add_view.
 */
skep_status skep_packed_image_create(const struct skep_image *image,
                                     struct skep_packed_image **packed_image_out);

/**
 * Destroys samples; NULL is ignored.
 */
void skep_packed_image_destroy(struct skep_packed_image *packed_image);

/**
 * Makes a square window of half side `radius` (1 to 16), sampled every `step` pixels (1 to 8). A sample weighs
 * exp(-r^2 / (2 sigma_spatial^2) - dI^2 / (2 sigma_color^2)), with r its distance from the center in pixels and dI its
 * difference in gray from it, of [0, 1]; INFINITY for both sigmas weighs all samples alike. `min_variance`: weighted
 * variance, of gray in [0, 1], under which a patch has no texture; 1e-5 suits photographs.
 *
 * The instruction set is the one skep_simd_level_name tells when the window is made.
 */
skep_status skep_ncc_window_create(uint32_t radius,
                                   uint32_t step,
                                   double sigma_spatial,
                                   double sigma_color,
                                   double min_variance,
                                   struct skep_ncc_window **ncc_window_out);

/**
 * Destroys a window; NULL is ignored.
 */
void skep_ncc_window_destroy(struct skep_ncc_window *window);

/**
 * Normalized cross-correlations of patches of the reference with their images in a source view: `pixels` holds x, y of
 * each patch's center in the reference (2 * count), `homographies` the way of each from reference to source pixels (9
 * doubles each, row by row), `ncc` has room for count floats. -1 to 1; -1 also where either side has no texture. Samples
 * outside the reference weigh nothing, those outside the source repeat its border. The source is interpolated bilinearly
 * at places in 256ths of a pixel, so an NCC differs from the exact one by some 1e-4.
 *
 * Patches that follow each other at the same pixel share the reference's side: sort them so. Stateless: any number of
 * threads, no allocation.
 */
skep_status skep_patch_ncc(const struct skep_ncc_window *window,
                           const struct skep_packed_image *reference,
                           const struct skep_packed_image *source,
                           const uint32_t *pixels,
                           const double *homographies,
                           size_t count,
                           float *ncc);

/**
 * Reads a scene from a folder with images/ and a COLMAP model in sparse/ or sparse/0/, as `colmap image_undistorter`
 * writes it: text or binary, cameras PINHOLE or SIMPLE_PINHOLE, photographs PNG or JPEG. Paths are in the bytes of the
 * file system. `near` and `far` are the depth range of every view; (0, 0) takes it from the sparse points.
 *
 * SKEP_ERR_FILE: the text names the file, the line where there is one, and what would be right.
 */
skep_status skep_scene_read_colmap(const char *folder,
                                   double near,
                                   double far,
                                   struct skep_scene **scene_out);

/**
 * Writes a scene as a folder that COLMAP and skep_scene_read_colmap read: the photographs as PNG files under their
 * views' names in images/, and a binary model in sparse/.
 *
 * SKEP_ERR_ARGUMENT: a view whose name does not end in .png, or would lead out of the folder.
 */
skep_status skep_scene_write_colmap(const struct skep_scene *scene,
                                    const char *folder);

/**
 * Writes what COLMAP calls a dense folder, less images/ and sparse/ (skep_scene_write_colmap writes those, into the
 * same folder if it is to be a workspace of COLMAP's): for every view of the result depth maps, normal maps and
 * consistency graphs in stereo/, raw ("photometric") and validated ("geometric"), previews in preview/; the lists of
 * images that COLMAP wants in stereo/; and fused.ply with fused.ply.vis when there is a cloud. `scene` is the one the
 * result was made from. Files are whole or not there.
 *
 * SKEP_ERR_ARGUMENT: another scene, or a view whose name would lead out of the folder.
 */
skep_status skep_result_write_workspace(const struct skep_result *result,
                                        const struct skep_scene *scene,
                                        const char *folder);

/**
 * Writes a cloud as binary PLY (x, y, z as floats, normals, colors), and the views of each point beside it in
 * FILE.vis, as COLMAP does.
 */
skep_status skep_cloud_write_ply(const struct skep_cloud *cloud, const char *file);

/**
 * Writes a depth map in COLMAP's layout: width floats a row, `stride_bytes` from row to row.
 */
skep_status skep_write_depth_map(const char *file,
                                 const float *depth,
                                 uint32_t width,
                                 uint32_t height,
                                 size_t stride_bytes);

/**
 * Writes a normal map in COLMAP's layout: x, y, z of each pixel, 3 * width floats a row, `stride_bytes` from row to row.
 */
skep_status skep_write_normal_map(const char *file,
                                  const float *normal,
                                  uint32_t width,
                                  uint32_t height,
                                  size_t stride_bytes);

/**
 * Writes a consistency graph in COLMAP's layout: `counts` holds the number of views of each of the width * height
 * pixels, `views` their numbers, pixel after pixel, `view_total` in all. Pixels without any are left out of the file.
 */
skep_status skep_write_consistency_graph(const char *file,
                                         uint32_t width,
                                         uint32_t height,
                                         const uint32_t *counts,
                                         const uint32_t *views,
                                         size_t view_total);

/**
 * Reads a depth map in COLMAP's layout, row after row without gaps. `width_out` and `height_out` receive its size; with
 * `depth` NULL nothing else happens, else `capacity` is the number of floats it has room for, at least width * height.
 */
skep_status skep_read_depth_map(const char *file,
                                float *depth,
                                size_t capacity,
                                uint32_t *width_out,
                                uint32_t *height_out);

/**
 * Reads a normal map in COLMAP's layout, x, y, z of each pixel, row after row without gaps; see skep_read_depth_map.
 * `capacity` is the number of floats, at least 3 * width * height.
 */
skep_status skep_read_normal_map(const char *file,
                                 float *normal,
                                 size_t capacity,
                                 uint32_t *width_out,
                                 uint32_t *height_out);

/**
 * Reads a consistency graph in COLMAP's layout: the number of views of each pixel into `counts` (room for
 * `count_capacity`, at least width * height) and their numbers, pixel after pixel, into `views` (room for
 * `view_capacity`). `view_total_out` receives the number of those; `counts` and `views` may be NULL to only ask.
 */
skep_status skep_read_consistency_graph(const char *file,
                                        uint32_t *counts,
                                        size_t count_capacity,
                                        uint32_t *views,
                                        size_t view_capacity,
                                        uint32_t *width_out,
                                        uint32_t *height_out,
                                        size_t *view_total_out);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SKEP_H */
