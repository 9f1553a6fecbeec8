/*
 * A run in a folder: within a budget of memory, cancelled, gone on with by another process, task
 * by task; the same bits as a run in memory. What cannot be is refused.
 */
#define _POSIX_C_SOURCE 200809L
#include "support/check.h"
#include "support/disk.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* The scene as a folder, and the cloud of a run in memory. */
static skep_cloud *prepare(const char *place, const skep_options *options) {
    scene made;
    scene_make(&made);
    skep_scene *handed_in = scene_hand_in(&made), *read = NULL;
    REQUIRE(skep_scene_write_colmap(handed_in, place));
    REQUIRE(skep_scene_read(place, NULL, 0, 0, NULL, NULL, &read));
    skep_result *result = scene_run(read, options);
    skep_cloud *cloud = NULL;
    REQUIRE(skep_result_get_cloud(result, &cloud));
    skep_result_destroy(result);
    skep_scene_destroy(read);
    skep_scene_destroy(handed_in);
    scene_free(&made);
    return cloud;
}

static void check_same_file(const char *first, const char *second) {
    size_t sizes[2];
    uint8_t *bytes[2] = {read_file(first, &sizes[0]), read_file(second, &sizes[1])};
    CHECK(sizes[0] == sizes[1] && memcmp(bytes[0], bytes[1], sizes[0]) == 0, "%s", second);
    free(bytes[0]);
    free(bytes[1]);
}

static int32_t stop_early(void *user, const skep_progress *progress) {
    *(double *)user = progress->done;
    return progress->done > 0.3;
}

/* What a second process does: it goes on with the run that the first one cancelled. */
static int go_on(const char *place, const char *folder, const skep_options *options) {
    skep_job *job = NULL;
    uint64_t count = 0;
    const int done = skep_job_plan(place, 0, 0, options, folder, 0, NULL, NULL, &job) == SKEP_OK &&
                     skep_job_run(job, NULL, NULL, &count) == SKEP_OK;
    skep_job_destroy(job);
    return done && count > 0 ? 0 : 1;
}

static void check_resumption(const char *place, const char *folder, skep_options *options) {
    skep_job *job = NULL;
    skep_job_needs needs;
    REQUIRE(skep_job_plan(place, 0, 0, options, folder, 1, NULL, NULL, &job));
    REQUIRE(skep_job_get_needs(job, &needs));
    CHECK(needs.least_memory > 0 && needs.memory >= needs.least_memory && needs.disk > 0 &&
              needs.cpu_seconds > 0,
          "%llu", (unsigned long long)needs.least_memory);
    skep_job_destroy(job);

    REQUIRE(skep_options_set(options, "memory", 1e6));
    FAILS(skep_job_plan(place, 0, 0, options, folder, 0, NULL, NULL, OUT(skep_job *, 0)), SKEP_ERR_ARGUMENT,
          "options.memory is");
    REQUIRE(skep_options_set(options, "memory", (double)needs.least_memory));
    REQUIRE(skep_job_plan(place, 0, 0, options, folder, 0, NULL, NULL, &job));
    FAILS(skep_job_plan(place, 0, 0, options, folder, 0, NULL, NULL, OUT(skep_job *, 0)), SKEP_ERR_FILE,
          "another process works on the run");
    double done = 0;
    FAILS(skep_job_run(job, stop_early, &done, OUT(uint64_t, 0)), SKEP_ERR_CANCELLED, "cancelled");
    CHECK(done > 0.3 && done < 1, "%g", done);
    skep_job_destroy(job);

    const pid_t process = fork();
    if (process == 0) {
        _exit(go_on(place, folder, options));
    }
    int status = -1;
    CHECK(process > 0 && waitpid(process, &status, 0) == process && WIFEXITED(status) &&
              WEXITSTATUS(status) == 0,
          "status %d", status);
}

/* All tasks one by one, each twice. */
static void check_tasks(const char *place, const char *folder, const skep_options *options) {
    skep_job *job = NULL;
    uint32_t cycles = 0, views = 0, read[MAX_VIEWS];
    size_t count = 0;
    REQUIRE(skep_job_plan(place, 0, 0, options, folder, 1, NULL, NULL, &job));
    REQUIRE(skep_job_get_count(job, &cycles, &views));
    REQUIRE(skep_job_get_views_read(job, 0, read, MAX_VIEWS, &count));
    CHECK(cycles > 1 && count > 1 && count <= views && read[0] == 0, "%zu", count);
    skep_job_destroy(job);
    REQUIRE(skep_job_open(folder, NULL, &job));
    FAILS(skep_job_run_task(job, SKEP_TASK_CHECK, 0, 0, NULL, NULL), SKEP_ERR_ARGUMENT,
          "before the search");
    for (uint32_t cycle = 0; cycle < cycles; ++cycle) {
        for (uint32_t turn = 0; turn < 2 * views; ++turn) {
            REQUIRE(skep_job_run_task(job, SKEP_TASK_SEARCH, cycle, turn / 2, NULL, NULL));
        }
        for (uint32_t turn = 0; turn < 2 * views; ++turn) {
            REQUIRE(skep_job_run_task(job, SKEP_TASK_CHECK, cycle, turn / 2, NULL, NULL));
        }
        REQUIRE(skep_job_run_task(job, SKEP_TASK_NEXT, cycle, 0, NULL, NULL));
    }
    int32_t done = -1;
    REQUIRE(skep_job_is_done(job, SKEP_TASK_FINISH, 0, 0, &done));
    CHECK(done == 0, "%d", (int)done);
    for (uint32_t view = 0; view < views; ++view) {
        REQUIRE(skep_job_run_task(job, SKEP_TASK_FINISH, 0, view, NULL, NULL));
    }
    REQUIRE(skep_job_run_task(job, SKEP_TASK_FUSE, 0, 0, NULL, NULL));
    REQUIRE(skep_job_is_done(job, SKEP_TASK_FUSE, 0, 0, &done));
    CHECK(done == 1, "%d", (int)done);
    FAILS(skep_job_run_task(job, 5, 0, 0, NULL, NULL), SKEP_ERR_ARGUMENT, "task is 5");
    FAILS(skep_job_run_task(job, SKEP_TASK_SEARCH, cycles, 0, NULL, NULL), SKEP_ERR_ARGUMENT,
          "below their number");
    FAILS(skep_job_run_task(job, SKEP_TASK_FINISH, 0, views, NULL, NULL), SKEP_ERR_ARGUMENT,
          "below their number");
    FAILS(skep_job_get_views_read(job, views, NULL, 0, &count), SKEP_ERR_ARGUMENT, "view is");
    FAILS(skep_job_get_notice(job, 1000, NULL, 0, NULL), SKEP_ERR_ARGUMENT, "index is 1000");
    skep_job_destroy(job);
}

static void check_misuse(const char *place, const char *folder) {
    skep_job *job = NULL;
    FAILS(skep_job_plan(NULL, 0, 0, NULL, folder, 0, NULL, NULL, &job), SKEP_ERR_NULL, "scene");
    FAILS(skep_job_plan(place, 0, 0, NULL, NULL, 0, NULL, NULL, &job), SKEP_ERR_NULL, "folder");
    FAILS(skep_job_plan(place, 0, 0, NULL, folder, 0, NULL, NULL, NULL), SKEP_ERR_NULL, "job_out");
    FAILS(skep_job_plan(place, 2, 1, NULL, folder, 0, NULL, NULL, &job), SKEP_ERR_ARGUMENT, "depth range");
    FAILS(skep_job_open(place, NULL, &job), SKEP_ERR_FILE, "manifest.json");
    FAILS(skep_job_open(NULL, NULL, &job), SKEP_ERR_NULL, "folder");
    FAILS(skep_job_run(NULL, NULL, NULL, NULL), SKEP_ERR_NULL, "job");
    FAILS(skep_job_run_task(NULL, 0, 0, 0, NULL, NULL), SKEP_ERR_NULL, "job");
    FAILS(skep_job_get_count(NULL, NULL, NULL), SKEP_ERR_NULL, "job");
    FAILS(skep_job_get_needs(NULL, NULL), SKEP_ERR_NULL, "job");
    FAILS(skep_job_get_notice(NULL, 0, NULL, 0, NULL), SKEP_ERR_NULL, "job");
    FAILS(skep_job_get_views_read(NULL, 0, NULL, 0, NULL), SKEP_ERR_NULL, "job");
    FAILS(skep_job_is_done(NULL, 0, 0, 0, NULL), SKEP_ERR_NULL, "job");
    CHECK(job == NULL, "a call that fails writes nothing");
    skep_job_destroy(NULL);
}

void test_job(const char *folder) {
    char place[MAX_PATH], run[MAX_PATH], cloud_file[MAX_PATH], fused[MAX_PATH];
    path_in(place, folder, "job-scene");
    path_in(run, folder, "job-run");
    path_in(cloud_file, folder, "job-cloud.ply");
    path_in(fused, run, "fused.ply");
    skep_options *options = quick_options();
    skep_cloud *cloud = prepare(place, options);
    REQUIRE(skep_cloud_write_ply(cloud, cloud_file));
    skep_cloud_destroy(cloud);
    check_resumption(place, run, options);
    check_same_file(cloud_file, fused);
    check_tasks(place, run, options);
    check_same_file(cloud_file, fused);
    check_misuse(place, run);
    skep_options_destroy(options);
}
