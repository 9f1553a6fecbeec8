/*
 * Estimates from a host's maps: searches start from them, checks compare with them, and they can be
 * finished unchanged.
 */
#include "support/check.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static skep_estimate *true_estimate(const scene *made, const skep_stepper *stepper, uint32_t cycle,
                                    uint32_t view) {
    const photograph *truth = &made->photographs[view];
    skep_estimate *estimate = NULL;
    REQUIRE(skep_estimate_from_maps(stepper, cycle, view, truth->depth, 4 * made->width,
                                    truth->normal, 12 * made->width, NULL, 0, NULL, 0, &estimate));
    return estimate;
}

/* Maps are returned unchanged, with validity masks, costs, and gaps between rows. */
static void check_round_trip(const scene *made, const skep_stepper *stepper, uint32_t cycle) {
    const size_t pixels = scene_pixels(made), width = made->width, stride = width + 2;
    const photograph *truth = &made->photographs[2];
    float *depth = take(stride * made->height, sizeof *depth);
    float *cost = take(pixels, sizeof *cost);
    uint8_t *validated = take(pixels, 1);
    size_t valid = 0;
    for (size_t i = 0; i < pixels; ++i) {
        depth[i / width * stride + i % width] = i % 5 ? truth->depth[i] : 0;
        cost[i] = (float)(i % 7);
        validated[i] = i % 3 ? 0 : (uint8_t)(i % 255 + 1);
        valid += i % 5 && validated[i];
    }
    skep_estimate *estimate = NULL;
    REQUIRE(skep_estimate_from_maps(stepper, cycle, 2, depth, 4 * stride, truth->normal, 12 * width,
                                    validated, width, cost, 4 * width, &estimate));
    skep_estimate_info info;
    REQUIRE(skep_estimate_get_info(estimate, &info));
    CHECK(info.view == 2 && info.cycle == cycle && info.is_checked == 1 && info.reserved == 0,
          "what it is");
    CHECK(info.pixels == pixels && info.validated == valid, "%llu validated",
          (unsigned long long)info.validated);
    CHECK(info.ncc_evaluations == 0 && info.changed == 0, "nothing was searched");
    float *depth_back = take(pixels, sizeof *depth_back),
          *normal_back = take(pixels, 3 * sizeof(float));
    float *cost_back = take(pixels, sizeof *cost_back);
    uint8_t *validated_back = take(pixels, 1);
    REQUIRE(skep_estimate_get_maps(estimate, depth_back, normal_back, cost_back, validated_back,
                                   pixels));
    REQUIRE(skep_estimate_get_maps(estimate, NULL, NULL, NULL, NULL, 0));
    for (size_t i = 0; i < pixels; ++i) {
        const int is_there = i % 5 != 0;
        CHECK(depth_back[i] == (is_there ? truth->depth[i] : 0), "pixel %zu", i);
        CHECK(validated_back[i] == (is_there && validated[i]), "pixel %zu", i);
        CHECK(cost_back[i] == cost[i], "pixel %zu", i);
        for (int axis = 0; is_there && axis < 3; ++axis) {
            CHECK(fabsf(normal_back[3 * i + axis] - truth->normal[3 * i + axis]) < 1e-6f,
                  "pixel %zu", i);
        }
    }
    skep_estimate_destroy(estimate);
    free(validated_back);
    free(cost_back);
    free(normal_back);
    free(depth_back);
    free(validated);
    free(cost);
    free(depth);
}

/* Pixels away from edges whose depth is right. */
static size_t right(const photograph *truth, const float *depth, size_t pixels) {
    size_t count = 0;
    for (size_t i = 0; i < pixels; ++i) {
        count += truth->surface[i] && fabsf(depth[i] / truth->depth[i] - 1) < 0.01f;
    }
    return count;
}

/* A view without planes of its own gets those transferred from the others' true maps. */
static void check_guidance(const scene *made, const skep_stepper *stepper, uint32_t cycle,
                           skep_estimate **estimates) {
    const size_t pixels = scene_pixels(made);
    const photograph *truth = &made->photographs[0];
    float *nothing = take(pixels, sizeof *nothing), *depth = take(pixels, sizeof *depth);
    skep_estimate *true_own = estimates[0];
    estimates[0] = NULL;
    REQUIRE(skep_estimate_from_maps(stepper, cycle, 0, nothing, 4 * made->width, truth->normal,
                                    12 * made->width, NULL, 0, NULL, 0, &estimates[0]));
    size_t found[2];
    for (int is_given = 0; is_given < 2; ++is_given) {
        skep_candidates *candidates = NULL;
        skep_estimate *searched = NULL;
        REQUIRE(skep_stepper_propagate(stepper, cycle, 0, (const skep_estimate *const *)estimates,
                                       made->views, &candidates));
        REQUIRE(skep_stepper_search(stepper, cycle, 0, (const skep_estimate *const *)estimates,
                                    made->views, is_given ? candidates : NULL, NULL, NULL,
                                    &searched));
        REQUIRE(skep_estimate_get_maps(searched, depth, NULL, NULL, NULL, pixels));
        found[is_given] = right(truth, depth, pixels);
        skep_estimate_info info;
        REQUIRE(skep_estimate_get_info(searched, &info));
        CHECK(info.is_checked == 0 && info.validated == 0 && info.ncc_evaluations > pixels,
              "searched");
        skep_estimate_destroy(searched);
        skep_candidates_destroy(candidates);
    }
    size_t away_from_edges = 0;
    for (size_t i = 0; i < pixels; ++i) {
        away_from_edges += truth->surface[i] != 0;
    }
    printf("right of %zu: %zu without candidates, %zu with\n", away_from_edges, found[0], found[1]);
    CHECK(found[1] > found[0], "%zu with candidates, %zu without", found[1], found[0]);
    CHECK(found[1] * 10 > away_from_edges * 7, "%zu of %zu pixels", found[1], away_from_edges);
    skep_estimate_destroy(estimates[0]);
    estimates[0] = true_own;
    free(depth);
    free(nothing);
}

/* Finished unchanged, true maps have low costs and are all validated. */
static void check_finished(const scene *made, const skep_stepper *stepper,
                           skep_estimate **estimates) {
    const size_t pixels = scene_pixels(made);
    skep_result *result = NULL;
    REQUIRE(skep_stepper_finish(stepper, 1, (const skep_estimate *const *)estimates, made->views,
                                NULL, NULL, &result));
    view_maps maps = maps_of(result, 1);
    CHECK(same_bytes(maps.depth[0], made->photographs[1].depth, 4 * pixels), "the maps given");
    CHECK(maps.statistics.status_counts[SKEP_PIXEL_VALIDATED] == pixels, "all are validated");
    double sum = 0;
    for (size_t i = 0; i < pixels; ++i) {
        sum += maps.cost[i];
    }
    printf("mean cost of the true maps: %.3f\n", sum / pixels);
    CHECK(scene_is_small() || sum < 0.25 * pixels, "%g", sum / pixels);
    maps_free(&maps);
    skep_result_destroy(result);
}

/* Averaged between views, true maps stay true: the views agree. */
static void check_averaged(const scene *made, const skep_scene *handed_in, skep_options *options) {
    REQUIRE(skep_options_set(options, "cross_view_averaging", 1));
    skep_stepper *stepper = NULL;
    uint32_t count = 0;
    REQUIRE(skep_stepper_create(handed_in, options, &stepper));
    REQUIRE(skep_stepper_get_count(stepper, &count, NULL));
    skep_estimate *estimates[MAX_VIEWS] = {NULL};
    for (uint32_t view = 0; view < made->views; ++view) {
        estimates[view] = true_estimate(made, stepper, count - 1, view);
    }
    skep_result *result = NULL;
    REQUIRE(skep_stepper_finish(stepper, 1, (const skep_estimate *const *)estimates, made->views,
                                NULL, NULL, &result));
    view_maps maps = maps_of(result, 1);
    const photograph *truth = &made->photographs[1];
    size_t moved = 0;
    for (size_t i = 0; i < scene_pixels(made); ++i) {
        moved += maps.depth[0][i] != truth->depth[i];
        CHECK(!truth->surface[i] || fabsf(maps.depth[0][i] / truth->depth[i] - 1) < 1e-3f,
              "pixel %zu at %g, truly %g", i, maps.depth[0][i], truth->depth[i]);
    }
    CHECK(moved > 0, "something is averaged");
    maps_free(&maps);
    skep_result_destroy(result);
    for (uint32_t view = 0; view < made->views; ++view) {
        skep_estimate_destroy(estimates[view]);
    }
    skep_stepper_destroy(stepper);
}

void test_own_maps(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    REQUIRE(skep_options_set(options, "cross_view_averaging", 0));
    skep_scene *handed_in = scene_hand_in(&made);
    skep_stepper *stepper = NULL;
    uint32_t count = 0;
    REQUIRE(skep_stepper_create(handed_in, options, &stepper));
    REQUIRE(skep_stepper_get_count(stepper, &count, NULL));
    check_averaged(&made, handed_in, options);
    /* Steppers need neither scene nor options any more. */
    skep_options_destroy(options);
    skep_scene_destroy(handed_in);
    const uint32_t last = count - 1;
    check_round_trip(&made, stepper, last);

    skep_estimate *estimates[MAX_VIEWS] = {NULL};
    for (uint32_t view = 0; view < made.views; ++view) {
        estimates[view] = true_estimate(&made, stepper, last, view);
    }
    check_guidance(&made, stepper, last, estimates);
    check_finished(&made, stepper, estimates);
    skep_stepper_destroy(stepper);
    for (uint32_t view = 0; view < made.views; ++view) {
        skep_estimate_destroy(estimates[view]);
    }
    scene_free(&made);
}
