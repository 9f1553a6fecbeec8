/*
 * A stepwise run gives the same bits as a whole one, in any order of the views, and across saved
 * estimates.
 */
#include "support/check.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <stdlib.h>

typedef struct by_hand {
    const skep_stepper *stepper;
    uint32_t views;
    int is_reversed;
    int is_saved;
    skep_estimate *estimates[MAX_VIEWS];
} by_hand;

static void replace(skep_estimate **old, skep_estimate *estimate) {
    skep_estimate_destroy(*old);
    *old = estimate;
}

static void save_and_load(const skep_stepper *stepper, skep_estimate **estimate) {
    size_t size = 0, written = 0;
    REQUIRE(skep_estimate_save(*estimate, NULL, 0, &size));
    uint8_t *bytes = take(size, 1), *again = take(size, 1);
    REQUIRE(skep_estimate_save(*estimate, bytes, size, &written));
    CHECK(written == size, "%zu of %zu bytes", written, size);
    skep_estimate *loaded = NULL;
    REQUIRE(skep_estimate_load(stepper, bytes, size, &loaded));
    replace(estimate, loaded);
    REQUIRE(skep_estimate_save(*estimate, again, size, &written));
    CHECK(written == size && same_bytes(bytes, again, size),
          "an estimate that was loaded is saved the same");
    free(again);
    free(bytes);
}

/* The n-th view to be taken. */
static uint32_t nth(const by_hand *run, uint32_t n) {
    return run->is_reversed ? run->views - 1 - n : n;
}

static void run_cycle(by_hand *run, uint32_t cycle) {
    const skep_estimate *const *estimates = (const skep_estimate *const *)run->estimates;
    skep_estimate *searched[MAX_VIEWS] = {NULL};
    skep_cycle now;
    REQUIRE(skep_stepper_get_cycle(run->stepper, cycle, &now));
    for (uint32_t view = 0; view < run->views; ++view) {
        skep_cycle before;
        skep_estimate_info info;
        if (!run->estimates[view]) {
            continue;
        }
        REQUIRE(skep_estimate_get_info(run->estimates[view], &info));
        REQUIRE(skep_stepper_get_cycle(run->stepper, info.cycle, &before));
        CHECK(info.is_checked == 1 && info.view == view && info.reserved == 0, "view %u",
              (unsigned)view);
        if (before.downscale != now.downscale) {
            skep_estimate *finer = NULL;
            REQUIRE(skep_stepper_upsample(run->stepper, cycle, view, run->estimates[view], &finer));
            replace(&run->estimates[view], finer);
        }
    }
    for (uint32_t n = 0; n < run->views; ++n) {
        const uint32_t view = nth(run, n);
        skep_candidates *candidates = NULL;
        REQUIRE(
            skep_stepper_propagate(run->stepper, cycle, view, estimates, run->views, &candidates));
        REQUIRE(skep_stepper_search(run->stepper, cycle, view, estimates, run->views, candidates,
                                    NULL, NULL, &searched[view]));
        skep_candidates_destroy(candidates);
        if (run->is_saved) {
            save_and_load(run->stepper, &searched[view]);
        }
    }
    for (uint32_t n = 0; n < run->views; ++n) {
        const uint32_t view = nth(run, n);
        skep_estimate *checked = NULL;
        REQUIRE(skep_stepper_check(run->stepper, cycle, view,
                                   (const skep_estimate *const *)searched, run->views, &checked));
        if (run->is_saved) {
            save_and_load(run->stepper, &checked);
        }
        replace(&run->estimates[view], checked);
    }
    for (uint32_t view = 0; view < run->views; ++view) {
        skep_estimate_destroy(searched[view]);
    }
}

/* The validated maps of all views as skep_fuse takes them. */
static skep_cloud *fuse(const scene *made, const skep_scene *handed_in, const skep_options *options,
                        const view_maps *maps) {
    skep_fusion_view views[MAX_VIEWS];
    skep_image images[MAX_VIEWS];
    uint32_t overlaps[MAX_VIEWS][MAX_VIEWS];
    for (uint32_t view = 0; view < made->views; ++view) {
        size_t count = 0;
        images[view] = scene_image(made, view);
        REQUIRE(skep_scene_get_overlap(handed_in, view, overlaps[view], MAX_VIEWS, &count));
        views[view] = (skep_fusion_view){.camera = &made->photographs[view].camera,
                                         .width = made->width,
                                         .height = made->height,
                                         .depth = maps[view].depth[SKEP_MAPS_VALIDATED],
                                         .depth_stride_bytes = 4 * (size_t)made->width,
                                         .normal = maps[view].normal[SKEP_MAPS_VALIDATED],
                                         .normal_stride_bytes = 12 * (size_t)made->width,
                                         .image_or_null = &images[view],
                                         .overlap = overlaps[view],
                                         .overlap_count = count,
                                         .confidence_or_null = maps[view].confidence,
                                         .confidence_stride_bytes = 4 * (size_t)made->width};
    }
    skep_cloud *cloud = NULL;
    REQUIRE(skep_fuse(views, made->views, options, NULL, NULL, &cloud));
    return cloud;
}

static void check_by_hand(const scene *made, const skep_scene *handed_in,
                          const skep_options *options, const skep_stepper *stepper,
                          const skep_result *whole, int variant) {
    static const char *const NAMES[] = {"in order", "in reverse", "saved", "in reverse and saved"};
    by_hand run = {.stepper = stepper,
                   .views = made->views,
                   .is_reversed = variant & 1,
                   .is_saved = variant >> 1};
    for (uint32_t cycle = 0; cycle != SKEP_CYCLE_NONE;) {
        run_cycle(&run, cycle);
        REQUIRE(skep_stepper_next(stepper, cycle, (const skep_estimate *const *)run.estimates,
                                  run.views, &cycle));
    }
    view_maps maps[MAX_VIEWS];
    for (uint32_t n = 0; n < run.views; ++n) {
        const uint32_t view = nth(&run, n);
        skep_result *finished = NULL;
        REQUIRE(skep_stepper_finish(stepper, view, (const skep_estimate *const *)run.estimates,
                                    run.views, NULL, NULL, &finished));
        maps[view] = maps_of(finished, view);
        view_maps expected = maps_of(whole, view);
        check_same_maps(&maps[view], &expected, NAMES[variant]);
        maps_free(&expected);
        FAILS(skep_result_get_cloud(finished, OUT(skep_cloud *, 0)), SKEP_ERR_ARGUMENT, "result");
        FAILS(skep_result_get_size(finished, (view + 1) % run.views, OUT(uint32_t, 0),
                                   OUT(uint32_t, 1)),
              SKEP_ERR_ARGUMENT, "view");
        skep_result_destroy(finished);
    }
    skep_cloud *cloud = fuse(made, handed_in, options, maps);
    points own = points_of(cloud), expected = points_of_result(whole);
    check_same_points(&own, &expected, NAMES[variant]);
    points_free(&own);
    points_free(&expected);
    skep_cloud_destroy(cloud);
    for (uint32_t view = 0; view < run.views; ++view) {
        skep_estimate_destroy(run.estimates[view]);
        maps_free(&maps[view]);
    }
}

static void check_stepper_themselves(const scene *made, const skep_scene *handed_in,
                                     const skep_options *options, const skep_stepper *stepper) {
    uint32_t count = 0, views = 0;
    REQUIRE(skep_stepper_get_count(stepper, &count, &views));
    CHECK(count == 4 && views == made->views, "%u cycles of %u views", (unsigned)count,
          (unsigned)views);
    REQUIRE(skep_stepper_get_count(stepper, NULL, NULL));
    for (uint32_t cycle = 0; cycle < count; ++cycle) {
        skep_cycle found;
        uint32_t width = 0, height = 0;
        REQUIRE(skep_stepper_get_cycle(stepper, cycle, &found));
        CHECK(found.downscale == (cycle < 2 ? 2 : 1) && found.cycle_on_scale == cycle % 2,
              "cycle %u", (unsigned)cycle);
        CHECK(found.food_sources == (cycle < 2 ? 4 : 3), "cycle %u", (unsigned)cycle);
        CHECK(found.iterations == (cycle == 0 ? 5 : 1), "cycle %u", (unsigned)cycle);
        REQUIRE(skep_stepper_get_size(stepper, cycle, 1, &width, &height));
        CHECK(width == (made->width + found.downscale - 1) / found.downscale, "%u",
              (unsigned)width);
        CHECK(height == (made->height + found.downscale - 1) / found.downscale, "%u",
              (unsigned)height);
    }
    uint32_t sources[MAX_VIEWS], expected[MAX_VIEWS];
    size_t source_count = 0, expected_count = 0;
    REQUIRE(skep_stepper_get_sources(stepper, 1, sources, MAX_VIEWS, &source_count));
    REQUIRE(skep_scene_get_sources(handed_in, options, 1, expected, MAX_VIEWS, &expected_count));
    CHECK(source_count == expected_count && same_bytes(sources, expected, 4 * source_count),
          "of view 1");
}

void test_stepper(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    skep_result *whole = scene_run(handed_in, options);
    skep_stepper *stepper = NULL;
    REQUIRE(skep_stepper_create(handed_in, options, &stepper));
    check_stepper_themselves(&made, handed_in, options, stepper);
    for (int variant = scene_is_small() ? 3 : 0; variant < 4; ++variant) {
        check_by_hand(&made, handed_in, options, stepper, whole, variant);
    }
    skep_stepper_destroy(stepper);
    skep_result_destroy(whole);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
