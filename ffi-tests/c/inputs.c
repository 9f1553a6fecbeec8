/*
 * Masks, depth ranges, source views, sparse points and options are honored, and can be asked for.
 */
#include "support/check.h"
#include "support/guarded.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check_what_was_handed_in(const scene *made, const skep_scene *handed_in) {
    uint32_t count = 0;
    REQUIRE(skep_scene_get_view_count(handed_in, &count));
    CHECK(count == made->views, "%u views", (unsigned)count);
    for (uint32_t view = 0; view < made->views; ++view) {
        uint32_t width = 0, height = 0;
        skep_camera camera;
        REQUIRE(skep_scene_get_view(handed_in, view, &width, &height, &camera));
        CHECK(width == made->width && height == made->height, "view %u", (unsigned)view);
        CHECK(same_bytes(&camera, &made->photographs[view].camera, sizeof camera), "view %u",
              (unsigned)view);
        REQUIRE(skep_scene_get_view(handed_in, view, NULL, NULL, NULL));
        char name[16] = "", expected[24];
        size_t needed = 0;
        snprintf(expected, sizeof expected, "view%04u.png", (unsigned)view);
        REQUIRE(skep_scene_get_name(handed_in, view, name, sizeof name, &needed));
        CHECK(strcmp(name, expected) == 0 && needed == strlen(expected) + 1, "%s", name);
        REQUIRE(skep_scene_get_name(handed_in, view, name, 5, &needed));
        CHECK(strcmp(name, "view") == 0 && needed == strlen(expected) + 1, "%s", name);
        REQUIRE(skep_scene_get_name(handed_in, view, NULL, 0, &needed));
        double near_by = 0, far_away = 0;
        REQUIRE(skep_scene_get_depth_range(handed_in, view, &near_by, &far_away));
        CHECK(near_by > 1 && near_by < 3.7 && far_away > 5 && far_away < 20, "%g to %g", near_by,
              far_away);
        uint32_t overlap[MAX_VIEWS];
        size_t others = 0;
        REQUIRE(skep_scene_get_overlap(handed_in, view, NULL, 0, &others));
        CHECK(others == made->views - 1, "view %u overlaps %zu", (unsigned)view, others);
        REQUIRE(skep_scene_get_overlap(handed_in, view, overlap, MAX_VIEWS, &others));
        for (size_t i = 0; i < others; ++i) {
            double degrees = 0;
            REQUIRE(skep_scene_get_triangulation_angle(handed_in, view, overlap[i], &degrees));
            CHECK(degrees > 2 && degrees < 45, "%g degrees", degrees);
        }
    }
}

/* A mask with gaps between its rows leaves pixels out, and taking it away brings them back. */
static void check_mask(const scene *made, skep_scene *handed_in, const skep_options *options) {
    skep_result *whole = scene_run(handed_in, options);
    guarded memory = guarded_take(rows_size(made->width, made->height, made->width + 3));
    memset(memory.bytes, 1, memory.size);
    for (size_t y = 0; y < made->height; ++y) {
        for (size_t x = 0; x < made->width; ++x) {
            memory.bytes[y * (made->width + 3) + x] = x < made->width / 3 ? 0 : (uint8_t)(1 + x);
        }
    }
    REQUIRE(skep_scene_set_mask(handed_in, 1, memory.bytes, made->width + 3));
    guarded_free(&memory);
    skep_result *masked = scene_run(handed_in, options);
    view_maps maps = maps_of(masked, 1);
    for (size_t i = 0; i < scene_pixels(made); ++i) {
        const int is_masked = i % made->width < made->width / 3;
        CHECK((maps.status[i] == SKEP_PIXEL_MASKED) == is_masked, "pixel %zu", i);
        CHECK(!is_masked || (maps.depth[0][i] == 0 && maps.source_count[i] == 0), "pixel %zu", i);
    }
    maps_free(&maps);
    maps = maps_of(masked, 0);
    CHECK(maps.statistics.status_counts[SKEP_PIXEL_MASKED] == 0, "another view has no mask");
    maps_free(&maps);
    skep_result_destroy(masked);
    REQUIRE(skep_scene_set_mask(handed_in, 1, NULL, 0));
    skep_result *again = scene_run(handed_in, options);
    check_same_results(whole, again, made->views, "the mask taken away");
    skep_result_destroy(again);
    skep_result_destroy(whole);
}

/* Views that are masked completely are empty, and the run succeeds. */
static void check_all_masked(const scene *made, const skep_options *options) {
    skep_scene *handed_in = scene_hand_in(made);
    uint8_t *nothing = take(scene_pixels(made), 1);
    for (uint32_t view = 0; view < made->views; ++view) {
        REQUIRE(skep_scene_set_mask(handed_in, view, nothing, made->width));
    }
    skep_result *result = scene_run(handed_in, options);
    view_maps maps = maps_of(result, 0);
    CHECK(maps.statistics.status_counts[SKEP_PIXEL_MASKED] == scene_pixels(made), "all pixels");
    points cloud = points_of_result(result);
    CHECK(cloud.count == 0 && cloud.view_total == 0, "%zu points", cloud.count);
    points_free(&cloud);
    maps_free(&maps);
    skep_result_destroy(result);
    free(nothing);
    skep_scene_destroy(handed_in);
}

/* A range in front of all surfaces gives no correct depth; no depth is outside of it. */
static void check_range(const scene *made, skep_scene *handed_in, const skep_options *options) {
    REQUIRE(skep_scene_set_depth_range(handed_in, 0, 2, 2.5));
    double near_by = 0, far_away = 0;
    REQUIRE(skep_scene_get_depth_range(handed_in, 0, &near_by, &far_away));
    CHECK(near_by == 2 && far_away == 2.5, "%g to %g", near_by, far_away);
    skep_result *result = scene_run(handed_in, options);
    view_maps maps = maps_of(result, 0);
    for (size_t i = 0; i < scene_pixels(made); ++i) {
        CHECK(maps.depth[0][i] >= 2 && maps.depth[0][i] <= 2.5f, "%g", maps.depth[0][i]);
    }
    CHECK(maps.statistics.status_counts[SKEP_PIXEL_VALIDATED] * 10 < scene_pixels(made),
          "%llu validated",
          (unsigned long long)maps.statistics.status_counts[SKEP_PIXEL_VALIDATED]);
    maps_free(&maps);
    skep_result_destroy(result);
    REQUIRE(skep_scene_set_depth_range(handed_in, 0, 0, 0));
    REQUIRE(skep_scene_get_depth_range(handed_in, 0, &near_by, &far_away));
    CHECK(far_away > 5, "the points' range again, %g to %g", near_by, far_away);
}

static void check_sources(const scene *made, skep_scene *handed_in, const skep_options *options) {
    const uint32_t by_hand[] = {3, 0};
    uint32_t sources[MAX_VIEWS] = {0};
    size_t count = 0, chosen = 0;
    REQUIRE(skep_scene_get_sources(handed_in, options, 2, NULL, 0, &chosen));
    REQUIRE(skep_scene_set_sources(handed_in, 2, by_hand, 2));
    REQUIRE(skep_scene_get_sources(handed_in, options, 2, sources, MAX_VIEWS, &count));
    CHECK(count == 2 && sources[0] == 3 && sources[1] == 0, "%zu sources", count);
    skep_result *result = scene_run(handed_in, options);
    view_maps maps = maps_of(result, 2);
    CHECK(maps.source_total == 2 && same_bytes(maps.sources, by_hand, sizeof by_hand),
          "in their order");
    for (size_t i = 0; i < scene_pixels(made); ++i) {
        CHECK(maps.source_count[i] <= 2, "pixel %zu has %u sources", i, maps.source_count[i]);
    }
    maps_free(&maps);
    skep_result_destroy(result);
    REQUIRE(skep_scene_set_sources(handed_in, 2, NULL, 0));
    REQUIRE(skep_scene_get_sources(handed_in, options, 2, sources, MAX_VIEWS, &count));
    CHECK(count == chosen, "chosen again: %zu, not %zu", count, chosen);
}

static void check_options(void) {
    skep_options *options = NULL, *paper = NULL;
    REQUIRE(skep_options_create(NULL, &options));
    REQUIRE(skep_options_create("paper", &paper));
    size_t count = 0, different = 0;
    for (const char *name; (name = skep_option_name(count)) != NULL; ++count) {
        char value[256], of_paper[256], after[256];
        size_t needed = 0;
        REQUIRE(skep_options_get_text(options, name, value, sizeof value, NULL));
        REQUIRE(skep_options_get_text(paper, name, of_paper, sizeof of_paper, &needed));
        CHECK(needed == strlen(of_paper) + 1, "%s", name);
        different += strcmp(value, of_paper) != 0;
        REQUIRE(skep_options_set_text(options, name, of_paper));
        REQUIRE(skep_options_get_text(options, name, after, sizeof after, NULL));
        CHECK(strcmp(after, of_paper) == 0, "%s is %s, not %s", name, after, of_paper);
    }
    CHECK(count > 20 && different > 5, "%zu options, %zu different", count, different);
    CHECK(skep_option_name(SIZE_MAX) == NULL, "no such option");
    /* As numbers, under their names with and without the group. */
    double value = -1;
    REQUIRE(skep_options_set(options, "check.depth_tolerance", 0.25));
    REQUIRE(skep_options_get(options, "check.depth_tolerance", &value));
    CHECK(value == 0.25, "%g", value);
    REQUIRE(skep_options_set(options, "view_propagation", 0));
    REQUIRE(skep_options_get(options, "search.view_propagation", &value));
    CHECK(value == 0, "%g", value);
    REQUIRE(skep_options_set_text(options, "view_propagation", "true"));
    REQUIRE(skep_options_get(options, "view_propagation", &value));
    CHECK(value == 1, "%g", value);
    skep_options_destroy(paper);
    skep_options_destroy(options);
}

/* Seeds change results; instruction sets do not. */
static void check_seed_and_simd(const scene *made, const skep_scene *handed_in,
                                skep_options *options) {
    skep_result *first = scene_run(handed_in, options);
    static const char *const LEVELS[] = {"scalar", "baseline", "v3"};
    for (size_t i = 0; i < (scene_is_small() ? 1 : 3); ++i) {
        REQUIRE(skep_options_set_text(options, "simd", LEVELS[i]));
        skep_result *same = scene_run(handed_in, options);
        check_same_results(first, same, made->views, LEVELS[i]);
        skep_result_destroy(same);
    }
    REQUIRE(skep_options_set_text(options, "simd", "best"));
    REQUIRE(skep_options_set(options, "seed", 7));
    double seed = 0;
    REQUIRE(skep_options_get(options, "seed", &seed));
    CHECK(seed == 7, "the seed is read back");
    skep_result *other = scene_run(handed_in, options);
    view_maps a = maps_of(first, 0), b = maps_of(other, 0);
    CHECK(!same_bytes(a.depth[0], b.depth[0], 4 * scene_pixels(made)), "another seed");
    maps_free(&a);
    maps_free(&b);
    skep_result_destroy(other);
    skep_result_destroy(first);
}

/* The smallest pictures, views without a picture in common, and a warning that says so. */
static void check_extremes(const skep_options *options) {
    const skep_camera left = {1, 1, 0, 0, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    skep_camera right = left;
    for (uint32_t width = 1; width <= 3; ++width) {
        const uint8_t pixels[3] = {10, 200, 30};
        const skep_image image = {pixels, width, 1, 3, SKEP_FORMAT_GRAY};
        right.translation[0] = width == 3 ? 1e9 : -0.1;
        skep_scene *tiny = NULL;
        REQUIRE(skep_scene_create(&tiny));
        uint32_t view = 9;
        REQUIRE(skep_scene_add_view(tiny, "left", &image, &left, NULL));
        REQUIRE(skep_scene_add_view(tiny, "right", &image, &right, &view));
        CHECK(view == 1, "%u", (unsigned)view);
        REQUIRE(skep_scene_set_depth_range(tiny, 0, 1, 2));
        REQUIRE(skep_scene_set_depth_range(tiny, 1, 1, 2));
        REQUIRE(skep_scene_validate(tiny));
        skep_result *result = scene_run(tiny, options);
        view_maps maps = maps_of(result, 0);
        CHECK(maps.statistics.status_counts[SKEP_PIXEL_VALIDATED] == 0, "%u pixels",
              (unsigned)width);
        CHECK(maps.status[0] == SKEP_PIXEL_NO_SOURCES, "%u", maps.status[0]);
        maps_free(&maps);
        char warning[256] = "";
        size_t needed = 0;
        REQUIRE(skep_result_get_warning(result, 0, warning, sizeof warning, &needed));
        CHECK(strstr(warning, "left") && needed == strlen(warning) + 1, "%s", warning);
        double degrees = 0;
        REQUIRE(skep_scene_get_triangulation_angle(tiny, 0, 1, &degrees));
        CHECK((degrees == -1) == (width == 3), "%g", degrees);
        skep_result_destroy(result);
        skep_scene_destroy(tiny);
    }
}

/* A copy changes by itself; it warns of a range that no point supports. View 4 has no points. */
static void check_copy_and_warnings(const skep_scene *original) {
    skep_scene *copy = NULL;
    char warning[256] = "";
    size_t needed = 0;
    double near_by = 0, far_away = 0;
    REQUIRE(skep_scene_copy(original, &copy));
    REQUIRE(skep_scene_set_depth_range(copy, 4, 0, 0));
    REQUIRE(skep_scene_get_warning(copy, 0, warning, sizeof warning, &needed));
    CHECK(strstr(warning, "view0004.png saw no sparse point") && needed == strlen(warning) + 1,
          "%s", warning);
    FAILS(skep_scene_get_warning(copy, 1, warning, sizeof warning, NULL), SKEP_ERR_ARGUMENT,
          "number of warnings, 1");
    FAILS(skep_scene_get_warning(original, 0, warning, sizeof warning, NULL), SKEP_ERR_ARGUMENT,
          "number of warnings, 0");
    REQUIRE(skep_scene_get_depth_range(original, 4, &near_by, &far_away));
    CHECK(near_by == 1 && far_away == 4, "%g to %g", near_by, far_away);
    skep_scene_destroy(copy);
}

/* What was asked for before a change is derived anew after it. */
static void check_queries_after_changes(void) {
    static const uint8_t PIXELS[3] = {10, 200, 30};
    const skep_image image = {PIXELS, 3, 1, 3, SKEP_FORMAT_GRAY};
    skep_camera camera = {3, 3, 1, 0, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    skep_scene *changing = NULL;
    REQUIRE(skep_scene_create(&changing));
    for (uint32_t view = 0; view < 5; ++view) {
        camera.translation[0] = -0.2 * view;
        REQUIRE(skep_scene_add_view(changing, NULL, &image, &camera, NULL));
        REQUIRE(skep_scene_set_depth_range(changing, view, 1, 4));
        if (view < 3) {
            continue;
        }
        uint32_t others[5] = {9, 9, 9, 9, 9};
        size_t count = 0;
        double degrees = 0, same = 0;
        REQUIRE(skep_scene_get_overlap(changing, 0, others, 5, &count));
        REQUIRE(skep_scene_get_triangulation_angle(changing, 0, 1, &degrees));
        if (view == 4) {
            CHECK(count == 2 && others[0] == 1 && others[1] == 4, "the view without points too");
            break;
        }
        CHECK(count == 3, "%zu views overlap without points", count);
        const double positions[18] = {0, 0, 9, 0, 0, 9, 0, 0, 9, 0.5, 0, 2, 0.5, 0, 2, 0.5, 0, 2};
        const uint32_t counts[6] = {2, 2, 2, 2, 2, 2};
        const uint32_t seen_by[12] = {0, 1, 0, 1, 0, 1, 2, 3, 2, 3, 2, 3};
        REQUIRE(skep_scene_add_points(changing, positions, 6, counts, seen_by, 12));
        REQUIRE(skep_scene_get_overlap(changing, 0, others, 5, &count));
        CHECK(count == 1 && others[0] == 1, "%zu views share points", count);
        REQUIRE(skep_scene_get_triangulation_angle(changing, 0, 1, &same));
        CHECK(same < degrees, "%g degrees at the points, %g in the middle", same, degrees);
    }
    check_copy_and_warnings(changing);
    skep_scene_destroy(changing);
}

void test_inputs(const char *folder) {
    (void)folder;
    scene made;
    scene_make_sized(&made, 4, scene_is_small() ? 20 : 36, scene_is_small() ? 15 : 27);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    check_what_was_handed_in(&made, handed_in);
    check_options();
    check_mask(&made, handed_in, options);
    check_all_masked(&made, options);
    check_range(&made, handed_in, options);
    check_sources(&made, handed_in, options);
    check_seed_and_simd(&made, handed_in, options);
    check_extremes(options);
    check_queries_after_changes();
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
