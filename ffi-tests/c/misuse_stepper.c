/*
 * Errors of steppers: arguments that do not match are refused by name, and the steppers can be used
 * again.
 */
#include "support/check.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdlib.h>

typedef struct stage {
    const scene *made;
    skep_stepper *stepper;
    uint32_t last;
    /* Checked estimates of the coarse scale, searched ones of it, and checked ones of full size. */
    skep_estimate *coarse[MAX_VIEWS];
    skep_estimate *searched[MAX_VIEWS];
    skep_estimate *fine[MAX_VIEWS];
} stage;

typedef const skep_estimate *const *estimate_list;

static void check_stepper(const stage *at, const skep_scene *handed_in) {
    FAILS(skep_stepper_create(NULL, NULL, OUT(skep_stepper *, 0)), SKEP_ERR_NULL, "scene");
    FAILS(skep_stepper_create(handed_in, NULL, NULL), SKEP_ERR_NULL, "stepper_out");
    FAILS(skep_stepper_get_count(NULL, OUT(uint32_t, 0), OUT(uint32_t, 1)), SKEP_ERR_NULL,
          "stepper");
    FAILS(skep_stepper_get_cycle(NULL, 0, OUT(skep_cycle, 0)), SKEP_ERR_NULL, "stepper");
    FAILS(skep_stepper_get_cycle(at->stepper, 0, NULL), SKEP_ERR_NULL, "cycle_out");
    FAILS(skep_stepper_get_cycle(at->stepper, at->last + 1, OUT(skep_cycle, 0)), SKEP_ERR_ARGUMENT,
          "cycle is");
    FAILS(skep_stepper_get_cycle(at->stepper, SKEP_CYCLE_NONE, OUT(skep_cycle, 0)),
          SKEP_ERR_ARGUMENT, "cycle is");
    FAILS(skep_stepper_get_size(NULL, 0, 0, OUT(uint32_t, 0), OUT(uint32_t, 1)), SKEP_ERR_NULL,
          "stepper");
    FAILS(skep_stepper_get_size(at->stepper, 0, 0, NULL, OUT(uint32_t, 1)), SKEP_ERR_NULL,
          "width_out");
    FAILS(skep_stepper_get_size(at->stepper, 0, 0, OUT(uint32_t, 0), NULL), SKEP_ERR_NULL,
          "height_out");
    FAILS(skep_stepper_get_size(at->stepper, 0, 99, OUT(uint32_t, 0), OUT(uint32_t, 1)),
          SKEP_ERR_ARGUMENT, "view is 99");
    FAILS(skep_stepper_get_sources(NULL, 0, OUT(uint32_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "stepper");
    FAILS(skep_stepper_get_sources(at->stepper, 99, OUT(uint32_t, 0), 9, OUT(size_t, 1)),
          SKEP_ERR_ARGUMENT, "view");
    FAILS(skep_stepper_get_sources(at->stepper, 0, OUT(uint32_t, 0), 1, OUT(size_t, 1)),
          SKEP_ERR_CAPACITY, "sources");
    FAILS(skep_stepper_get_sources(at->stepper, 0, OUT(uint32_t, 0), 9, NULL), SKEP_ERR_NULL,
          "count_out");
    skep_stepper_destroy(NULL);
    skep_candidates_destroy(NULL);
    skep_estimate_destroy(NULL);
}

/* Each of these is refused by all calls that take estimates. */
static void check_estimate_list(const stage *at, uint32_t cycle, estimate_list estimates,
                                size_t count, skep_status status, const char *word) {
    const skep_stepper *stepper = at->stepper;
    FAILS(skep_stepper_propagate(stepper, cycle, 0, estimates, count, OUT(skep_candidates *, 0)),
          status, word);
    FAILS(skep_stepper_search(stepper, cycle, 0, estimates, count, NULL, NULL, NULL,
                              OUT(skep_estimate *, 0)),
          status, word);
    FAILS(skep_stepper_check(stepper, cycle, 0, estimates, count, OUT(skep_estimate *, 0)), status,
          word);
    FAILS(skep_stepper_next(stepper, cycle, estimates, count, OUT(uint32_t, 0)), status, word);
    if (cycle == at->last) {
        FAILS(skep_stepper_finish(stepper, 0, estimates, count, NULL, NULL, OUT(skep_result *, 0)),
              status, word);
    }
}

static void check_estimate_lists(const stage *at) {
    const uint32_t views = at->made->views;
    const skep_estimate *swapped[MAX_VIEWS] = {at->fine[1], at->fine[0]};
    check_estimate_list(at, at->last, NULL, views, SKEP_ERR_NULL, "estimates");
    check_estimate_list(at, at->last, (estimate_list)at->fine, views - 1, SKEP_ERR_ARGUMENT,
                        "estimates is");
    check_estimate_list(at, at->last, (estimate_list)at->fine, 1, SKEP_ERR_ARGUMENT,
                        "estimates is 1");
    check_estimate_list(at, at->last, (estimate_list)at->fine, SIZE_MAX, SKEP_ERR_ARGUMENT,
                        "estimates");
    check_estimate_list(at, at->last, swapped, views, SKEP_ERR_ARGUMENT,
                        "estimates[0] is the estimate of view 1");
    check_estimate_list(at, at->last, (estimate_list)at->coarse, views, SKEP_ERR_ARGUMENT,
                        "coarser scale");
    check_estimate_list(at, 0, (estimate_list)at->fine, views, SKEP_ERR_ARGUMENT, "estimates[0]");
    check_estimate_list(at, at->last + 1, (estimate_list)at->fine, views, SKEP_ERR_ARGUMENT,
                        "cycle is");
    check_estimate_list(at, SKEP_CYCLE_NONE, (estimate_list)at->fine, views, SKEP_ERR_ARGUMENT,
                        "cycle is");
}

static void check_order(const stage *at) {
    const skep_stepper *stepper = at->stepper;
    const uint32_t views = at->made->views;
    estimate_list searched = (estimate_list)at->searched, coarse = (estimate_list)at->coarse;
    /* Searched estimates are to be checked first, checked ones are not checked again. */
    FAILS(skep_stepper_propagate(stepper, 1, 0, searched, views, OUT(skep_candidates *, 0)),
          SKEP_ERR_ARGUMENT, "not yet checked");
    FAILS(skep_stepper_search(stepper, 1, 0, searched, views, NULL, NULL, NULL,
                              OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "estimates[0] is searched and not yet checked");
    FAILS(skep_stepper_next(stepper, 0, searched, views, OUT(uint32_t, 0)), SKEP_ERR_ARGUMENT,
          "not yet checked");
    FAILS(skep_stepper_check(stepper, 0, 0, coarse, views, OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "estimates[0] is checked");
    FAILS(skep_stepper_upsample(stepper, at->last, 0, searched[0], OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "estimate is searched");
    /* A check and a finish need the view's own estimate; a finish needs full size. */
    FAILS(skep_stepper_check(stepper, 0, 0, NULL, 0, OUT(skep_estimate *, 0)), SKEP_ERR_ARGUMENT,
          "estimates[0] is none");
    FAILS(skep_stepper_finish(stepper, 0, NULL, 0, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "estimates[0]");
    FAILS(skep_stepper_finish(stepper, 0, coarse, views, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "estimates[0]");
    FAILS(skep_stepper_finish(stepper, 99, coarse, views, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "view is 99");
    /* Estimates are upsampled to the next scale only, and keep their view. */
    FAILS(skep_stepper_upsample(stepper, 1, 0, coarse[0], OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "scale before");
    FAILS(skep_stepper_upsample(stepper, at->last, 1, coarse[0], OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "view 1");
    FAILS(skep_stepper_upsample(stepper, at->last, 0, at->fine[0], OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "scale before");
    FAILS(skep_stepper_upsample(stepper, 99, 0, coarse[0], OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "cycle is 99");
    FAILS(skep_stepper_upsample(stepper, at->last, 99, coarse[0], OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "view is 99");
    /* Candidates are for one view and one cycle. */
    skep_candidates *candidates = NULL;
    REQUIRE(skep_stepper_propagate(stepper, 1, 0, coarse, views, &candidates));
    FAILS(skep_stepper_search(stepper, 1, 1, coarse, views, candidates, NULL, NULL,
                              OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "candidates");
    FAILS(skep_stepper_search(stepper, 0, 0, coarse, views, candidates, NULL, NULL,
                              OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "candidates");
    skep_candidates_destroy(candidates);
}

static void check_null(const stage *at) {
    const skep_stepper *stepper = at->stepper;
    const uint32_t views = at->made->views;
    estimate_list estimates = (estimate_list)at->coarse;
    FAILS(skep_stepper_propagate(NULL, 1, 0, estimates, views, OUT(skep_candidates *, 0)),
          SKEP_ERR_NULL, "stepper");
    FAILS(skep_stepper_propagate(stepper, 1, 0, estimates, views, NULL), SKEP_ERR_NULL,
          "candidates_out");
    FAILS(skep_stepper_search(NULL, 1, 0, estimates, views, NULL, NULL, NULL,
                              OUT(skep_estimate *, 0)),
          SKEP_ERR_NULL, "stepper");
    FAILS(skep_stepper_search(stepper, 1, 0, estimates, views, NULL, NULL, NULL, NULL),
          SKEP_ERR_NULL, "estimate_out");
    FAILS(skep_stepper_search(stepper, 1, 99, estimates, views, NULL, NULL, NULL,
                              OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "view is 99");
    FAILS(skep_stepper_check(NULL, 1, 0, estimates, views, OUT(skep_estimate *, 0)), SKEP_ERR_NULL,
          "stepper");
    FAILS(skep_stepper_check(stepper, 1, 0, estimates, views, NULL), SKEP_ERR_NULL, "estimate_out");
    FAILS(skep_stepper_upsample(NULL, 2, 0, estimates[0], OUT(skep_estimate *, 0)), SKEP_ERR_NULL,
          "stepper");
    FAILS(skep_stepper_upsample(stepper, 2, 0, NULL, OUT(skep_estimate *, 0)), SKEP_ERR_NULL,
          "estimate");
    FAILS(skep_stepper_upsample(stepper, 2, 0, estimates[0], NULL), SKEP_ERR_NULL, "estimate_out");
    FAILS(skep_stepper_next(NULL, 1, estimates, views, OUT(uint32_t, 0)), SKEP_ERR_NULL, "stepper");
    FAILS(skep_stepper_next(stepper, 1, estimates, views, NULL), SKEP_ERR_NULL, "next_out");
    FAILS(skep_stepper_finish(NULL, 0, estimates, views, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_NULL, "stepper");
    FAILS(skep_stepper_finish(stepper, 0, estimates, views, NULL, NULL, NULL), SKEP_ERR_NULL,
          "result_out");
}

/* Estimates of another scene, whose pictures have another size. */
static void check_foreign(const stage *at, const skep_options *options) {
    scene other;
    scene_make_sized(&other, at->made->views, at->made->width - 2, at->made->height);
    skep_scene *handed_in = scene_hand_in(&other);
    skep_stepper *stepper = NULL;
    REQUIRE(skep_stepper_create(handed_in, options, &stepper));
    FAILS(skep_stepper_search(stepper, 1, 0, (estimate_list)at->coarse, other.views, NULL, NULL,
                              NULL, OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "estimates[0]");
    FAILS(skep_stepper_upsample(stepper, at->last, 0, at->coarse[0], OUT(skep_estimate *, 0)),
          SKEP_ERR_ARGUMENT, "estimate");
    skep_stepper_destroy(stepper);
    skep_scene_destroy(handed_in);
    scene_free(&other);
}

static void prepare(stage *at) {
    const uint32_t views = at->made->views;
    for (uint32_t view = 0; view < views; ++view) {
        REQUIRE(skep_stepper_search(at->stepper, 0, view, NULL, 0, NULL, NULL, NULL,
                                    &at->searched[view]));
    }
    for (uint32_t view = 0; view < views; ++view) {
        REQUIRE(skep_stepper_check(at->stepper, 0, view, (estimate_list)at->searched, views,
                                   &at->coarse[view]));
        REQUIRE(
            skep_stepper_upsample(at->stepper, at->last, view, at->coarse[view], &at->fine[view]));
    }
}

void test_misuse_stepper(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    stage at = {.made = &made};
    REQUIRE(skep_stepper_create(handed_in, options, &at.stepper));
    REQUIRE(skep_stepper_get_count(at.stepper, &at.last, NULL));
    at.last -= 1;
    prepare(&at);
    check_stepper(&at, handed_in);
    check_estimate_lists(&at);
    check_order(&at);
    check_null(&at);
    check_foreign(&at, options);
    /* After all the errors, the steppers can be used again. */
    skep_estimate *next = NULL;
    REQUIRE(skep_stepper_search(at.stepper, at.last, 0, (estimate_list)at.fine, made.views, NULL,
                                NULL, NULL, &next));
    skep_estimate_destroy(next);
    for (uint32_t view = 0; view < made.views; ++view) {
        skep_estimate_destroy(at.fine[view]);
        skep_estimate_destroy(at.coarse[view]);
        skep_estimate_destroy(at.searched[view]);
    }
    skep_stepper_destroy(at.stepper);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
