/*
 * The same picture in every format, with gaps between rows, from any address, gives the same bits.
 */
#include "support/check.h"
#include "support/guarded.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const uint32_t LAYOUTS[] = {SKEP_FORMAT_GRAY, SKEP_FORMAT_RGB, SKEP_FORMAT_BGR,
                                   SKEP_FORMAT_RGBA, SKEP_FORMAT_BGRA};
static const uint32_t DEPTHS[] = {0, SKEP_FORMAT_16, SKEP_FORMAT_FLOAT};

static size_t channels_of(uint32_t layout) {
    return layout == SKEP_FORMAT_GRAY ? 1 : layout <= SKEP_FORMAT_BGR ? 3 : 4;
}

static size_t channel_bytes(uint32_t depth) {
    return depth == SKEP_FORMAT_16 ? 2 : depth == SKEP_FORMAT_FLOAT ? 4 : 1;
}

/* The luma of ITU-R BT.601, rounded. */
static uint8_t gray_of(const uint8_t *rgb) {
    return (uint8_t)((299u * rgb[0] + 587u * rgb[1] + 114u * rgb[2] + 500u) / 1000u);
}

/*
 * Writes a channel's value so that it rounds to `value`: `off` is the difference, -0.49 to 0.49.
 */
static void put(uint8_t *place, uint32_t depth, uint8_t value, double off) {
    if (depth == SKEP_FORMAT_16) {
        const double near_it = fmin(fmax(value * 257.0 + off * 257.0, 0), 65535);
        const uint16_t whole = (uint16_t)floor(near_it + 0.5);
        memcpy(place, &whole, sizeof whole);
    } else if (depth == SKEP_FORMAT_FLOAT) {
        const float share = (float)((value + off) / 255.0);
        memcpy(place, &share, sizeof share);
    } else {
        *place = value;
    }
}

/* A view's photograph in another format; what lies between rows is a pattern. */
static skep_image converted(const scene *made, uint32_t view, uint32_t layout, uint32_t depth,
                            double off, guarded *memory) {
    static const int ORDERS[5][4] = {{0}, {0, 1, 2, 0}, {2, 1, 0, 0}, {0, 1, 2, 3}, {2, 1, 0, 3}};
    const size_t channels = channels_of(layout), bytes = channel_bytes(depth);
    const size_t row_bytes = made->width * channels * bytes, stride = row_bytes + 5;
    *memory = guarded_take(rows_size(row_bytes, made->height, stride));
    fill_rows(memory);
    for (size_t pixel = 0; pixel < scene_pixels(made); ++pixel) {
        const uint8_t *rgb = made->photographs[view].rgb + 3 * pixel;
        uint8_t *place =
            memory->bytes + pixel / made->width * stride + pixel % made->width * channels * bytes;
        const double sign = pixel % 3 - 1.0;
        for (size_t channel = 0; channel < channels; ++channel) {
            const int from = ORDERS[layout][channel];
            const uint8_t value = from == 3 ? (uint8_t)(7 * pixel)
                                  : layout  ? rgb[from]
                                            : gray_of(rgb);
            put(place + channel * bytes, depth, value, off * sign);
        }
    }
    return (skep_image){memory->bytes, made->width, made->height, stride, layout + depth};
}

static skep_result *run_converted(const scene *made, const skep_options *options, uint32_t first,
                                  double off) {
    skep_scene *handed_in = NULL;
    REQUIRE(skep_scene_create(&handed_in));
    for (uint32_t view = 0; view < made->views; ++view) {
        const uint32_t which = (first + view) % 15;
        guarded memory;
        const skep_image image =
            converted(made, view, LAYOUTS[which % 5], DEPTHS[which / 5], off, &memory);
        REQUIRE(
            skep_scene_add_view(handed_in, NULL, &image, &made->photographs[view].camera, NULL));
        guarded_free(&memory);
    }
    REQUIRE(skep_scene_add_points(handed_in, made->positions, made->points, made->view_counts,
                                  made->point_views, made->view_total));
    skep_result *result = scene_run(handed_in, options);
    skep_scene_destroy(handed_in);
    return result;
}

/*
 * Values at the ends: floats within 1/255 of 0 and 1 are clamped, 16-bit values are rounded to the nearest.
 */
static void check_ends(void) {
    const float floats[] = {-0.999f / 255, -0.0f,          0, 1e-40f,
                            0.499f / 255,  254.501f / 255, 1, 255.999f / 255};
    const uint8_t expected[] = {0, 0, 0, 0, 0, 255, 255, 255};
    const uint16_t shorts[] = {0, 128, 129, 385, 386, 65535, 65407, 65406};
    const uint8_t rounded[] = {0, 0, 1, 1, 2, 255, 255, 254};
    /* A fused cloud has the stored colors. */
    const skep_camera camera = {1, 1, 0, 0, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    skep_options *options = NULL;
    REQUIRE(skep_options_create(NULL, &options));
    REQUIRE(skep_options_set(options, "fusion.min_agreeing_views", 0));
    for (size_t i = 0; i < sizeof expected + sizeof rounded; ++i) {
        const int is_float = i < sizeof expected;
        const size_t j = is_float ? i : i - sizeof expected;
        const skep_image image = {
            is_float ? (const void *)&floats[j] : (const void *)&shorts[j], 1, 1, 4,
            SKEP_FORMAT_GRAY + (is_float ? SKEP_FORMAT_FLOAT : SKEP_FORMAT_16)};
        const float depth = 2, normal[3] = {0, 0, -1};
        const skep_fusion_view view = {&camera, 1, 1, &depth, 4, normal,
                                       12, &image, NULL, 0, NULL, 0};
        skep_cloud *cloud = NULL;
        REQUIRE(skep_fuse(&view, 1, options, NULL, NULL, &cloud));
        uint8_t color[3] = {9, 9, 9};
        REQUIRE(skep_cloud_get_points(cloud, NULL, NULL, color, 1));
        const uint8_t wanted = is_float ? expected[j] : rounded[j];
        CHECK(color[0] == wanted && color[1] == wanted && color[2] == wanted,
              "value %zu is %u, not %u", i, color[0], wanted);
        skep_cloud_destroy(cloud);
    }
    skep_options_destroy(options);
}

void test_formats(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    skep_result *expected = scene_run(handed_in, options);
    /* Each view in a different format; three runs of five views go through all fifteen. */
    for (uint32_t first = 0; first < (scene_is_small() ? 5 : 15); first += made.views) {
        skep_result *result = run_converted(&made, options, first, first == 0 ? 0 : 0.49);
        for (uint32_t view = 0; view < made.views; ++view) {
            char what[64];
            snprintf(what, sizeof what, "view %u in format %u", (unsigned)view,
                     (unsigned)(first + view) % 15);
            view_maps own = maps_of(result, view), other = maps_of(expected, view);
            check_same_maps(&own, &other, what);
            maps_free(&own);
            maps_free(&other);
        }
        skep_result_destroy(result);
    }
    check_ends();
    skep_result_destroy(expected);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
