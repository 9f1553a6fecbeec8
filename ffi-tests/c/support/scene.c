#include "scene.h"

#include "check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct vec3 {
    double x, y, z;
} vec3;

static vec3 add(vec3 a, vec3 b, double scale) {
    return (vec3){a.x + b.x * scale, a.y + b.y * scale, a.z + b.z * scale};
}

static double dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static vec3 cross(vec3 a, vec3 b) {
    return (vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static vec3 unit(vec3 a) { return add((vec3){0, 0, 0}, a, 1 / sqrt(dot(a, a))); }

/* A rectangle of a plane with two axes on it; `half` is half its size. */
typedef struct panel {
    vec3 center, along_u, along_v, normal;
    double half_u, half_v;
} panel;

static panel make_panel(vec3 center, vec3 normal, double half_u, double half_v) {
    const vec3 facing = unit(normal);
    const vec3 along_u = unit(cross((vec3){0, 1, 0}, facing));
    return (panel){center, along_u, cross(facing, along_u), facing, half_u, half_v};
}

const double SCENE_NEAR = 2.0;
const double SCENE_FAR = 9.0;

static panel wall(void) { return make_panel((vec3){0, 0, 5}, (vec3){0.35, 0.1, -1}, 100, 100); }

static panel board(void) {
    return make_panel((vec3){0.25, -0.1, 3.7}, (vec3){-0.1, 0.15, -1}, 0.65, 0.5);
}

/* A number in [0, 1) that belongs to a cell. */
static double cell(int32_t x, int32_t y, uint32_t seed) {
    uint32_t hash = (uint32_t)x * 0x9E3779B1u ^ (uint32_t)y * 0x85EBCA77u ^ seed * 0xC2B2AE3Du;
    hash = (hash ^ (hash >> 15)) * 0x2C1B3C6Du;
    hash = (hash ^ (hash >> 12)) * 0x297A2D39u;
    return (hash ^ (hash >> 15)) / 4294967296.0;
}

/* Those numbers, smoothly interpolated. */
static double noise(double x, double y, uint32_t seed) {
    const double left = floor(x), top = floor(y);
    double u = x - left, v = y - top;
    const int32_t column = (int32_t)left, row = (int32_t)top;
    u *= u * (3 - 2 * u);
    v *= v * (3 - 2 * v);
    const double upper = cell(column, row, seed) * (1 - u) + cell(column + 1, row, seed) * u;
    const double lower =
        cell(column, row + 1, seed) * (1 - u) + cell(column + 1, row + 1, seed) * u;
    return upper * (1 - v) + lower * v;
}

/* The distance along the ray to the surface, in multiples of `direction`; 0 where it misses. */
static double hit(const panel *at, vec3 from, vec3 direction, double *u, double *v) {
    const double along = dot(at->normal, direction);
    const double way = dot(at->normal, add(at->center, from, -1)) / along;
    const vec3 on_plane = add(add(from, direction, way), at->center, -1);
    *u = dot(on_plane, at->along_u);
    *v = dot(on_plane, at->along_v);
    return fabs(*u) <= at->half_u && fabs(*v) <= at->half_v ? way : 0;
}

typedef struct pose {
    vec3 center, right, down, forward;
} pose;

static vec3 ray(const skep_camera *camera, const pose *from, double x, double y) {
    const vec3 sideways = add(from->forward, from->right, (x - camera->cx) / camera->fx);
    return add(sideways, from->down, (y - camera->cy) / camera->fy);
}

/* The surface that a ray of length 1 in depth meets first: 1 the wall, 2 the board. */
static int cast(vec3 from, vec3 direction, double *depth, panel *met, double color[3]) {
    double u, v;
    int which = 2;
    *met = board();
    *depth = hit(met, from, direction, &u, &v);
    if (*depth == 0) {
        which = 1;
        *met = wall();
        *depth = hit(met, from, direction, &u, &v);
    }
    const uint32_t seed = 10u * (uint32_t)which;
    const double grain =
        0.6 * noise(u / 0.26, v / 0.26, seed) + 0.4 * noise(u / 0.12, v / 0.12, seed + 1);
    for (uint32_t channel = 0; channel < 3; ++channel) {
        color[channel] = 0.8 * grain + 0.2 * noise(u / 0.3, v / 0.3, seed + 2 + channel);
    }
    return which;
}

static void photograph_pixel(const scene *made, photograph *taken, const pose *from, uint32_t x,
                             uint32_t y) {
    const size_t pixel = (size_t)y * made->width + x;
    panel met;
    double depth, color[3], sum[3] = {0, 0, 0};
    const int center = cast(from->center, ray(&taken->camera, from, x, y), &depth, &met, color);
    taken->depth[pixel] = (float)depth;
    taken->normal[3 * pixel] = (float)dot(met.normal, from->right);
    taken->normal[3 * pixel + 1] = (float)dot(met.normal, from->down);
    taken->normal[3 * pixel + 2] = (float)dot(met.normal, from->forward);
    taken->surface[pixel] = (uint8_t)center;
    /* A pixel sees the mean of its area. */
    enum { SIDE = 3 };
    for (int sample = 0; sample < SIDE * SIDE; ++sample) {
        const double dx = (sample % SIDE - SIDE / 2) / (double)SIDE;
        const double dy = (sample / SIDE - SIDE / 2) / (double)SIDE;
        cast(from->center, ray(&taken->camera, from, x + dx, y + dy), &depth, &met, color);
        for (int channel = 0; channel < 3; ++channel) {
            sum[channel] += color[channel] / (SIDE * SIDE);
        }
    }
    /* Windows that cover the board and the wall match neither: they are not checked. */
    const int reach = 4;
    for (int corner = 0; corner < 9; ++corner) {
        const double dx = (corner % 3 - 1) * reach, dy = (corner / 3 - 1) * reach;
        if (cast(from->center, ray(&taken->camera, from, x + dx, y + dy), &depth, &met, color) !=
            center) {
            taken->surface[pixel] = 0;
        }
    }
    for (int channel = 0; channel < 3; ++channel) {
        taken->rgb[3 * pixel + channel] = (uint8_t)(20 + 215 * sum[channel] + 0.5);
    }
}

static void take_photograph(scene *made, uint32_t view) {
    photograph *taken = &made->photographs[view];
    const double step = view - 0.5 * (made->views - 1);
    pose from = {.center = {0.6 * step, view % 2 ? 0.2 : -0.1, 0.05 * step}};
    from.forward = unit(add((vec3){0, 0, 4.6}, from.center, -1));
    from.right = unit(cross((vec3){0, 1, 0}, from.forward));
    from.down = cross(from.forward, from.right);

    skep_camera *camera = &taken->camera;
    camera->fx = camera->fy = 1.1 * made->width;
    camera->cx = 0.5 * (made->width - 1);
    camera->cy = 0.5 * (made->height - 1);
    const vec3 rows[3] = {from.right, from.down, from.forward};
    for (int row = 0; row < 3; ++row) {
        memcpy(camera->rotation + 3 * row, &rows[row], sizeof rows[row]);
        camera->translation[row] = -dot(rows[row], from.center);
    }
    const size_t pixels = scene_pixels(made);
    taken->rgb = take(pixels, 3);
    taken->depth = take(pixels, sizeof *taken->depth);
    taken->normal = take(pixels, 3 * sizeof *taken->normal);
    taken->surface = take(pixels, 1);
    for (uint32_t y = 0; y < made->height; ++y) {
        for (uint32_t x = 0; x < made->width; ++x) {
            photograph_pixel(made, taken, &from, x, y);
        }
    }
}

static vec3 rows_times(const skep_camera *camera, vec3 a) {
    const double *r = camera->rotation;
    return (vec3){r[0] * a.x + r[1] * a.y + r[2] * a.z, r[3] * a.x + r[4] * a.y + r[5] * a.z,
                  r[6] * a.x + r[7] * a.y + r[8] * a.z};
}

static vec3 columns_times(const skep_camera *camera, vec3 a) {
    const double *r = camera->rotation;
    return (vec3){r[0] * a.x + r[3] * a.y + r[6] * a.z, r[1] * a.x + r[4] * a.y + r[7] * a.z,
                  r[2] * a.x + r[5] * a.y + r[8] * a.z};
}

/* Whether a point is visible in a view: inside the image and not occluded. */
static int sees(const scene *made, uint32_t view, vec3 point) {
    const skep_camera *camera = &made->photographs[view].camera;
    const double *t = camera->translation;
    const vec3 own = add(rows_times(camera, point), (vec3){t[0], t[1], t[2]}, 1);
    const double x = floor(camera->fx * own.x / own.z + camera->cx + 0.5);
    const double y = floor(camera->fy * own.y / own.z + camera->cy + 0.5);
    if (x < 0 || y < 0 || x >= made->width || y >= made->height) {
        return 0;
    }
    const float there = made->photographs[view].depth[(size_t)y * made->width + (size_t)x];
    return fabs(there / own.z - 1) < 0.02;
}

static void make_points(scene *made) {
    const uint32_t step = made->width / 9;
    const size_t most = (size_t)made->views * 12 * 12;
    made->positions = take(most, 3 * sizeof(double));
    made->view_counts = take(most, sizeof(uint32_t));
    made->point_views = take(most, made->views * sizeof(uint32_t));
    for (uint32_t view = 0; view < made->views; ++view) {
        const skep_camera *camera = &made->photographs[view].camera;
        const double *t = camera->translation;
        for (uint32_t y = step / 2; y < made->height; y += step) {
            for (uint32_t x = step / 2; x < made->width; x += step) {
                const double depth = made->photographs[view].depth[(size_t)y * made->width + x];
                const vec3 own = {(x - camera->cx) / camera->fx * depth,
                                  (y - camera->cy) / camera->fy * depth, depth};
                const vec3 point = columns_times(camera, add(own, (vec3){t[0], t[1], t[2]}, -1));
                uint32_t seen = 0;
                for (uint32_t other = 0; other < made->views; ++other) {
                    if (sees(made, other, point)) {
                        made->point_views[made->view_total + seen++] = other;
                    }
                }
                if (seen >= 2) {
                    memcpy(made->positions + 3 * made->points, &point, sizeof point);
                    made->view_counts[made->points++] = seen;
                    made->view_total += seen;
                }
            }
        }
    }
}

void scene_make_sized(scene *made, uint32_t views, uint32_t width, uint32_t height) {
    *made = (scene){.width = width, .height = height, .views = views};
    for (uint32_t view = 0; view < views; ++view) {
        take_photograph(made, view);
    }
    make_points(made);
}

int scene_is_small(void) { return getenv("SKEP_TEST_SMALL") != NULL; }

void scene_make(scene *made) {
    if (scene_is_small()) {
        scene_make_sized(made, 4, 24, 18);
    } else {
        scene_make_sized(made, MAX_VIEWS, 72, 54);
    }
}

void scene_free(scene *made) {
    for (uint32_t view = 0; view < made->views; ++view) {
        photograph *taken = &made->photographs[view];
        free(taken->rgb);
        free(taken->depth);
        free(taken->normal);
        free(taken->surface);
    }
    free(made->positions);
    free(made->view_counts);
    free(made->point_views);
}

size_t scene_pixels(const scene *made) { return (size_t)made->width * made->height; }

skep_image scene_image(const scene *made, uint32_t view) {
    return (skep_image){.data = made->photographs[view].rgb,
                        .width = made->width,
                        .height = made->height,
                        .stride_bytes = (size_t)3 * made->width,
                        .format = SKEP_FORMAT_RGB};
}

skep_scene *scene_hand_in(const scene *made) {
    skep_scene *handed_in = NULL;
    REQUIRE(skep_scene_create(&handed_in));
    for (uint32_t view = 0; view < made->views; ++view) {
        const skep_image image = scene_image(made, view);
        REQUIRE(
            skep_scene_add_view(handed_in, NULL, &image, &made->photographs[view].camera, NULL));
    }
    REQUIRE(skep_scene_add_points(handed_in, made->positions, made->points, made->view_counts,
                                  made->point_views, made->view_total));
    return handed_in;
}

skep_options *quick_options(void) {
    skep_options *options = NULL;
    REQUIRE(skep_options_create(NULL, &options));
    REQUIRE(skep_options_set_text(options, "schedule.scales",
                                  "downscale=2 food_sources=4 iterations=5+1x1; "
                                  "downscale=1 food_sources=3 iterations=1+1x1"));
    REQUIRE(skep_options_set(options, "threads", 2));
    REQUIRE(skep_options_set(options, "fusion.min_agreeing_views", 2));
    /* Three views see every point, and small images make a pixel much depth. */
    REQUIRE(skep_options_set(options, "min_agreeing_fraction", 0));
    REQUIRE(skep_options_set(options, "few_views", 0));
    REQUIRE(skep_options_set(options, "check.reprojection_tolerance", 0));
    if (scene_is_small()) {
        /* All of it is edge, and a surface is as small as a speckle. */
        REQUIRE(skep_options_set(options, "fattening_passes", 0));
        REQUIRE(skep_options_set(options, "max_speckle_size", 0));
    }
    return options;
}

skep_result *scene_run(const skep_scene *handed_in, const skep_options *options) {
    skep_result *result = NULL;
    REQUIRE(skep_reconstruct(handed_in, options, NULL, NULL, &result));
    return result;
}
