/*
 * The callback cancels any call at any time; then no output is written, and the same objects can be
 * used again.
 */
#define _POSIX_C_SOURCE 200809L
#include "support/check.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <stdatomic.h>
#include <stdio.h>
#include <time.h>

typedef struct host {
    /* Stops once this share is done; above 1 never. */
    double stop_at;
    /*
     * Plain numbers: that the callback is never called twice at the same time is what keeps them
     * right.
     */
    int calls;
    int calls_after_stop;
    int stopped;
    struct timespec stopped_at;
    atomic_int inside;
    atomic_int at_the_same_time;
} host;

static int32_t callback(void *user, const skep_progress *progress) {
    host *self = user;
    if (atomic_fetch_add(&self->inside, 1) != 0) {
        atomic_fetch_add(&self->at_the_same_time, 1);
    }
    ++self->calls;
    self->calls_after_stop += self->stopped;
    /* Long enough for a concurrent call to be noticed. */
    nanosleep(&(struct timespec){0, 200000}, NULL);
    if (!self->stopped && progress->done >= self->stop_at) {
        self->stopped = 1;
        clock_gettime(CLOCK_MONOTONIC, &self->stopped_at);
    }
    atomic_fetch_sub(&self->inside, 1);
    return self->stopped ? 17 : 0;
}

static double milliseconds_since(const struct timespec *from) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (now.tv_sec - from->tv_sec) * 1e3 + (now.tv_nsec - from->tv_nsec) / 1e6;
}

/* Checks that hold for every cancelled call. */
static void check_stopped(const host *self, skep_status status, const char *what) {
    const double latency = self->stopped ? milliseconds_since(&self->stopped_at) : 0;
    printf("%s stopped at %g: %d calls, back after %.2f ms\n", what, self->stop_at, self->calls,
           latency);
    FAILS(status, SKEP_ERR_CANCELLED, "cancelled");
    CHECK(self->stopped == 1 && self->calls_after_stop == 0, "%s: %d calls after the stop", what,
          self->calls_after_stop);
    CHECK(atomic_load(&self->at_the_same_time) == 0, "%s", what);
    /* Far above the documented 100 ms, which a busy machine may exceed. */
    CHECK(latency < 10000, "%s: %g ms", what, latency);
}

static void check_runs(const scene *made, const skep_scene *handed_in,
                       const skep_options *options) {
    static const double MOMENTS[] = {0, 0.2, 0.5, 0.8, 0.98, 1};
    skep_result *expected = scene_run(handed_in, options);
    for (size_t i = 0; i < sizeof MOMENTS / sizeof MOMENTS[0]; ++i) {
        if (scene_is_small() && i % 5) {
            continue;
        }
        host self = {.stop_at = MOMENTS[i]};
        const skep_status status =
            skep_reconstruct(handed_in, options, callback, &self, OUT(skep_result *, 0));
        check_stopped(&self, status, "skep_reconstruct");
    }
    host self = {.stop_at = 2};
    skep_result *again = NULL;
    REQUIRE(skep_reconstruct(handed_in, options, callback, &self, &again));
    CHECK(atomic_load(&self.at_the_same_time) == 0, "%d calls", self.calls);
    check_same_results(expected, again, made->views, "after runs that were stopped");
    skep_result_destroy(again);
    skep_result_destroy(expected);
}

static void check_stepper(const scene *made, const skep_scene *handed_in,
                          const skep_options *options) {
    skep_stepper *stepper = NULL;
    REQUIRE(skep_stepper_create(handed_in, options, &stepper));
    host self = {.stop_at = 0};
    skep_status status =
        skep_stepper_search(stepper, 2, 0, NULL, 0, NULL, callback, &self, OUT(skep_estimate *, 0));
    check_stopped(&self, status, "skep_stepper_search");
    self = (host){.stop_at = 2};
    skep_estimate *estimates[MAX_VIEWS] = {NULL}, *searched = NULL;
    REQUIRE(skep_stepper_search(stepper, 2, 0, NULL, 0, NULL, callback, &self, &searched));
    estimates[0] = searched;
    REQUIRE(skep_stepper_check(stepper, 2, 0, (const skep_estimate *const *)estimates, made->views,
                               &estimates[0]));
    skep_estimate_destroy(searched);
    self = (host){.stop_at = 0};
    status = skep_stepper_finish(stepper, 0, (const skep_estimate *const *)estimates, made->views,
                                 callback, &self, OUT(skep_result *, 0));
    check_stopped(&self, status, "skep_stepper_finish");
    skep_result *result = NULL;
    REQUIRE(skep_stepper_finish(stepper, 0, (const skep_estimate *const *)estimates, made->views,
                                NULL, NULL, &result));
    skep_result_destroy(result);
    skep_estimate_destroy(estimates[0]);
    skep_stepper_destroy(stepper);
}

static void check_fusion(const scene *made) {
    static const uint32_t OTHER[] = {1, 0};
    skep_fusion_view views[2];
    for (uint32_t view = 0; view < 2; ++view) {
        const photograph *truth = &made->photographs[view];
        views[view] = (skep_fusion_view){&truth->camera,
                                         made->width,
                                         made->height,
                                         truth->depth,
                                         4 * (size_t)made->width,
                                         truth->normal,
                                         12 * (size_t)made->width,
                                         NULL,
                                         &OTHER[view],
                                         1,
                                         NULL,
                                         0};
    }
    skep_options *options = quick_options();
    REQUIRE(skep_options_set(options, "fusion.min_agreeing_views", 1));
    for (int moment = 0; moment < 2; ++moment) {
        host self = {.stop_at = moment};
        const skep_status status =
            skep_fuse(views, 2, options, callback, &self, OUT(skep_cloud *, 0));
        check_stopped(&self, status, "skep_fuse");
    }
    skep_cloud *cloud = NULL;
    REQUIRE(skep_fuse(views, 2, options, NULL, NULL, &cloud));
    size_t count = 0;
    REQUIRE(skep_cloud_get_count(cloud, &count, NULL));
    CHECK(count > scene_pixels(made) / 4, "%zu points", count);
    skep_cloud_destroy(cloud);
    skep_options_destroy(options);
}

void test_cancel(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    REQUIRE(skep_options_set(options, "threads", 4));
    check_runs(&made, handed_in, options);
    check_stepper(&made, handed_in, options);
    check_fusion(&made);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
