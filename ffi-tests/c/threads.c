/*
 * Several threads at once: with objects of their own and with shared ones, with failing calls in
 * between.
 */
#define _POSIX_C_SOURCE 200809L
#include "support/check.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct shared {
    const scene *made;
    skep_scene *handed_in;
    skep_options *options;
    skep_stepper *stepper;
    skep_result *expected;
} shared;

typedef struct worker {
    const shared *all;
    int number;
    pthread_t thread;
} worker;

/* A text that another thread's failures do not overwrite. */
static void fail_on_purpose(int number) {
    skep_options *options = NULL;
    char name[32], text[1024];
    snprintf(name, sizeof name, "no_option_%d", number);
    REQUIRE(skep_options_create(NULL, &options));
    for (int round = 0; round < 20; ++round) {
        CHECK(skep_options_set(options, name, 1) == SKEP_ERR_ARGUMENT, "%s", name);
        skep_last_error(text, sizeof text);
        CHECK(strstr(text, name) != NULL, "%s", text);
    }
    skep_options_destroy(options);
}

static void *run_own(void *argument) {
    const worker *self = argument;
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(self->all->made);
    REQUIRE(skep_options_set(options, "threads", self->number));
    skep_result *result = scene_run(handed_in, options);
    fail_on_purpose(self->number);
    check_same_results(result, self->all->expected, self->all->made->views, "objects of its own");
    skep_result_destroy(result);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    return NULL;
}

static void *run_shared(void *argument) {
    const worker *self = argument;
    skep_result *result = scene_run(self->all->handed_in, self->all->options);
    check_same_results(result, self->all->expected, self->all->made->views, "shared objects");
    skep_result_destroy(result);
    return NULL;
}

/* Views of the same stepper are searched at the same time. */
static void *search_shared(void *argument) {
    const worker *self = argument;
    skep_estimate *first = NULL, *second = NULL;
    REQUIRE(skep_stepper_search(self->all->stepper, 0, 0, NULL, 0, NULL, NULL, NULL, &first));
    REQUIRE(skep_stepper_search(self->all->stepper, 0, 0, NULL, 0, NULL, NULL, NULL, &second));
    skep_estimate_info info;
    REQUIRE(skep_estimate_get_info(first, &info));
    const size_t pixels = (size_t)info.pixels;
    float *a = take(pixels, sizeof *a), *b = take(pixels, sizeof *b);
    REQUIRE(skep_estimate_get_maps(first, a, NULL, NULL, NULL, pixels));
    REQUIRE(skep_estimate_get_maps(second, b, NULL, NULL, NULL, pixels));
    CHECK(same_bytes(a, b, pixels * sizeof *a), "thread %d", self->number);
    free(b);
    free(a);
    skep_estimate_destroy(second);
    skep_estimate_destroy(first);
    return NULL;
}

/* Changes options back and forth while others run with them: a run keeps what it started with. */
static void *change_shared(void *argument) {
    const worker *self = argument;
    for (int round = 0; round < 200; ++round) {
        REQUIRE(skep_options_set(self->all->options, "threads", 1 + round % 3));
        REQUIRE(skep_scene_set_depth_range(self->all->handed_in, 0, 0, 0));
        double value = 0;
        REQUIRE(skep_options_get(self->all->options, "threads", &value));
        CHECK(value >= 1 && value <= 3, "%g", value);
    }
    return NULL;
}

static void run_together(const shared *all, void *(*const *kinds)(void *), int count) {
    worker workers[8];
    for (int i = 0; i < count; ++i) {
        workers[i] = (worker){.all = all, .number = i + 1};
        CHECK(pthread_create(&workers[i].thread, NULL, kinds[i], &workers[i]) == 0, "thread %d", i);
    }
    for (int i = 0; i < count; ++i) {
        pthread_join(workers[i].thread, NULL);
    }
}

void test_threads(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    shared all = {.made = &made, .handed_in = scene_hand_in(&made), .options = quick_options()};
    all.expected = scene_run(all.handed_in, all.options);
    REQUIRE(skep_stepper_create(all.handed_in, all.options, &all.stepper));
    static void *(*const KINDS[])(void *) = {run_own,       run_own,      run_own,
                                             run_shared,    run_shared,   search_shared,
                                             search_shared, change_shared};
    run_together(&all, KINDS, scene_is_small() ? 2 : 8);
    skep_stepper_destroy(all.stepper);
    skep_result_destroy(all.expected);
    skep_options_destroy(all.options);
    skep_scene_destroy(all.handed_in);
    scene_free(&made);
}
