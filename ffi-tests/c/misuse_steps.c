/*
 * Errors of steps: what does not belong together is refused by name, and the steps go on working. /
 */
#include "support/check.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdlib.h>

typedef struct stage {
    const scene *made;
    skep_steps *steps;
    uint32_t last;
    /* Checked states of the coarse scale, searched ones of it, and checked ones of full size. */
    skep_state *coarse[MAX_VIEWS];
    skep_state *searched[MAX_VIEWS];
    skep_state *fine[MAX_VIEWS];
} stage;

typedef const skep_state *const *state_list;

static void check_steps(const stage *at, const skep_scene *handed_in) {
    FAILS(skep_steps_create(NULL, NULL, OUT(skep_steps *, 0)), SKEP_ERR_NULL, "scene");
    FAILS(skep_steps_create(handed_in, NULL, NULL), SKEP_ERR_NULL, "steps_out");
    FAILS(skep_steps_get_count(NULL, OUT(uint32_t, 0), OUT(uint32_t, 1)), SKEP_ERR_NULL, "steps");
    FAILS(skep_steps_get_step(NULL, 0, OUT(skep_step, 0)), SKEP_ERR_NULL, "steps");
    FAILS(skep_steps_get_step(at->steps, 0, NULL), SKEP_ERR_NULL, "step_out");
    FAILS(skep_steps_get_step(at->steps, at->last + 1, OUT(skep_step, 0)), SKEP_ERR_ARGUMENT,
          "step is");
    FAILS(skep_steps_get_step(at->steps, SKEP_STEP_NONE, OUT(skep_step, 0)), SKEP_ERR_ARGUMENT,
          "step is");
    FAILS(skep_steps_get_size(NULL, 0, 0, OUT(uint32_t, 0), OUT(uint32_t, 1)), SKEP_ERR_NULL,
          "steps");
    FAILS(skep_steps_get_size(at->steps, 0, 0, NULL, OUT(uint32_t, 1)), SKEP_ERR_NULL, "width_out");
    FAILS(skep_steps_get_size(at->steps, 0, 0, OUT(uint32_t, 0), NULL), SKEP_ERR_NULL,
          "height_out");
    FAILS(skep_steps_get_size(at->steps, 0, 99, OUT(uint32_t, 0), OUT(uint32_t, 1)),
          SKEP_ERR_ARGUMENT, "view is 99");
    FAILS(skep_steps_get_sources(NULL, 0, OUT(uint32_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "steps");
    FAILS(skep_steps_get_sources(at->steps, 99, OUT(uint32_t, 0), 9, OUT(size_t, 1)),
          SKEP_ERR_ARGUMENT, "view");
    FAILS(skep_steps_get_sources(at->steps, 0, OUT(uint32_t, 0), 1, OUT(size_t, 1)),
          SKEP_ERR_CAPACITY, "sources");
    FAILS(skep_steps_get_sources(at->steps, 0, OUT(uint32_t, 0), 9, NULL), SKEP_ERR_NULL,
          "count_out");
    skep_steps_destroy(NULL);
    skep_offers_destroy(NULL);
    skep_state_destroy(NULL);
}

/* Each of these is refused by all calls that take states. */
static void check_state_list(const stage *at, uint32_t step, state_list states, size_t count,
                             skep_status status, const char *word) {
    const skep_steps *steps = at->steps;
    FAILS(skep_steps_propagate(steps, step, 0, states, count, OUT(skep_offers *, 0)), status, word);
    FAILS(skep_steps_search(steps, step, 0, states, count, NULL, NULL, NULL, OUT(skep_state *, 0)),
          status, word);
    FAILS(skep_steps_check(steps, step, 0, states, count, OUT(skep_state *, 0)), status, word);
    FAILS(skep_steps_next(steps, step, states, count, OUT(uint32_t, 0)), status, word);
    if (step == at->last) {
        FAILS(skep_steps_finish(steps, 0, states, count, NULL, NULL, OUT(skep_result *, 0)), status,
              word);
    }
}

static void check_state_lists(const stage *at) {
    const uint32_t views = at->made->views;
    const skep_state *swapped[MAX_VIEWS] = {at->fine[1], at->fine[0]};
    check_state_list(at, at->last, NULL, views, SKEP_ERR_NULL, "states");
    check_state_list(at, at->last, (state_list)at->fine, views - 1, SKEP_ERR_ARGUMENT, "states is");
    check_state_list(at, at->last, (state_list)at->fine, 1, SKEP_ERR_ARGUMENT, "states is 1");
    check_state_list(at, at->last, (state_list)at->fine, SIZE_MAX, SKEP_ERR_ARGUMENT, "states");
    check_state_list(at, at->last, swapped, views, SKEP_ERR_ARGUMENT,
                     "states[0] is the state of view 1");
    check_state_list(at, at->last, (state_list)at->coarse, views, SKEP_ERR_ARGUMENT, "handed up");
    check_state_list(at, 0, (state_list)at->fine, views, SKEP_ERR_ARGUMENT, "states[0]");
    check_state_list(at, at->last + 1, (state_list)at->fine, views, SKEP_ERR_ARGUMENT, "step is");
    check_state_list(at, SKEP_STEP_NONE, (state_list)at->fine, views, SKEP_ERR_ARGUMENT, "step is");
}

static void check_order(const stage *at) {
    const skep_steps *steps = at->steps;
    const uint32_t views = at->made->views;
    state_list searched = (state_list)at->searched, coarse = (state_list)at->coarse;
    /* Searched states are to be checked first, checked ones are not checked again. */
    FAILS(skep_steps_propagate(steps, 1, 0, searched, views, OUT(skep_offers *, 0)),
          SKEP_ERR_ARGUMENT, "not yet checked");
    FAILS(skep_steps_search(steps, 1, 0, searched, views, NULL, NULL, NULL, OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "states[0] is searched and not yet checked");
    FAILS(skep_steps_next(steps, 0, searched, views, OUT(uint32_t, 0)), SKEP_ERR_ARGUMENT,
          "not yet checked");
    FAILS(skep_steps_check(steps, 0, 0, coarse, views, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
          "states[0] is checked");
    FAILS(skep_steps_hand_up(steps, at->last, 0, searched[0], OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "state is searched");
    /* A check and an end need the view's own state, and full size. */
    FAILS(skep_steps_check(steps, 0, 0, NULL, 0, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
          "states[0] is none");
    FAILS(skep_steps_finish(steps, 0, NULL, 0, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "states[0]");
    FAILS(skep_steps_finish(steps, 0, coarse, views, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "states[0]");
    FAILS(skep_steps_finish(steps, 99, coarse, views, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "view is 99");
    /* States are handed up to the next scale only, and keep their view. */
    FAILS(skep_steps_hand_up(steps, 1, 0, coarse[0], OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
          "scale before");
    FAILS(skep_steps_hand_up(steps, at->last, 1, coarse[0], OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "view 1");
    FAILS(skep_steps_hand_up(steps, at->last, 0, at->fine[0], OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "scale before");
    FAILS(skep_steps_hand_up(steps, 99, 0, coarse[0], OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
          "step is 99");
    FAILS(skep_steps_hand_up(steps, at->last, 99, coarse[0], OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "view is 99");
    /* Offers are to one view, for one step. */
    skep_offers *offers = NULL;
    REQUIRE(skep_steps_propagate(steps, 1, 0, coarse, views, &offers));
    FAILS(skep_steps_search(steps, 1, 1, coarse, views, offers, NULL, NULL, OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "offers");
    FAILS(skep_steps_search(steps, 0, 0, coarse, views, offers, NULL, NULL, OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "offers");
    skep_offers_destroy(offers);
}

static void check_null(const stage *at) {
    const skep_steps *steps = at->steps;
    const uint32_t views = at->made->views;
    state_list states = (state_list)at->coarse;
    FAILS(skep_steps_propagate(NULL, 1, 0, states, views, OUT(skep_offers *, 0)), SKEP_ERR_NULL,
          "steps");
    FAILS(skep_steps_propagate(steps, 1, 0, states, views, NULL), SKEP_ERR_NULL, "offers_out");
    FAILS(skep_steps_search(NULL, 1, 0, states, views, NULL, NULL, NULL, OUT(skep_state *, 0)),
          SKEP_ERR_NULL, "steps");
    FAILS(skep_steps_search(steps, 1, 0, states, views, NULL, NULL, NULL, NULL), SKEP_ERR_NULL,
          "state_out");
    FAILS(skep_steps_search(steps, 1, 99, states, views, NULL, NULL, NULL, OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "view is 99");
    FAILS(skep_steps_check(NULL, 1, 0, states, views, OUT(skep_state *, 0)), SKEP_ERR_NULL,
          "steps");
    FAILS(skep_steps_check(steps, 1, 0, states, views, NULL), SKEP_ERR_NULL, "state_out");
    FAILS(skep_steps_hand_up(NULL, 2, 0, states[0], OUT(skep_state *, 0)), SKEP_ERR_NULL, "steps");
    FAILS(skep_steps_hand_up(steps, 2, 0, NULL, OUT(skep_state *, 0)), SKEP_ERR_NULL, "state");
    FAILS(skep_steps_hand_up(steps, 2, 0, states[0], NULL), SKEP_ERR_NULL, "state_out");
    FAILS(skep_steps_next(NULL, 1, states, views, OUT(uint32_t, 0)), SKEP_ERR_NULL, "steps");
    FAILS(skep_steps_next(steps, 1, states, views, NULL), SKEP_ERR_NULL, "next_out");
    FAILS(skep_steps_finish(NULL, 0, states, views, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_NULL, "steps");
    FAILS(skep_steps_finish(steps, 0, states, views, NULL, NULL, NULL), SKEP_ERR_NULL,
          "result_out");
}

/* States of another scene, whose pictures have another size. */
static void check_foreign(const stage *at, const skep_options *options) {
    scene other;
    scene_make_sized(&other, at->made->views, at->made->width - 2, at->made->height);
    skep_scene *handed_in = scene_hand_in(&other);
    skep_steps *steps = NULL;
    REQUIRE(skep_steps_create(handed_in, options, &steps));
    FAILS(skep_steps_search(steps, 1, 0, (state_list)at->coarse, other.views, NULL, NULL, NULL,
                            OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "states[0]");
    FAILS(skep_steps_hand_up(steps, at->last, 0, at->coarse[0], OUT(skep_state *, 0)),
          SKEP_ERR_ARGUMENT, "state");
    skep_steps_destroy(steps);
    skep_scene_destroy(handed_in);
    scene_free(&other);
}

static void prepare(stage *at) {
    const uint32_t views = at->made->views;
    for (uint32_t view = 0; view < views; ++view) {
        REQUIRE(
            skep_steps_search(at->steps, 0, view, NULL, 0, NULL, NULL, NULL, &at->searched[view]));
    }
    for (uint32_t view = 0; view < views; ++view) {
        REQUIRE(skep_steps_check(at->steps, 0, view, (state_list)at->searched, views,
                                 &at->coarse[view]));
        REQUIRE(skep_steps_hand_up(at->steps, at->last, view, at->coarse[view], &at->fine[view]));
    }
}

void test_misuse_steps(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    stage at = {.made = &made};
    REQUIRE(skep_steps_create(handed_in, options, &at.steps));
    REQUIRE(skep_steps_get_count(at.steps, &at.last, NULL));
    at.last -= 1;
    prepare(&at);
    check_steps(&at, handed_in);
    check_state_lists(&at);
    check_order(&at);
    check_null(&at);
    check_foreign(&at, options);
    /* After all that was refused, the steps go on. */
    skep_state *next = NULL;
    REQUIRE(skep_steps_search(at.steps, at.last, 0, (state_list)at.fine, made.views, NULL, NULL,
                              NULL, &next));
    skep_state_destroy(next);
    for (uint32_t view = 0; view < made.views; ++view) {
        skep_state_destroy(at.fine[view]);
        skep_state_destroy(at.coarse[view]);
        skep_state_destroy(at.searched[view]);
    }
    skep_steps_destroy(at.steps);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
