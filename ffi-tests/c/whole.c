/*
 * A whole run gives correct depths, and maps, counts and points that are consistent.
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

static int bits(uint32_t word) {
    int count = 0;
    for (; word; word &= word - 1) {
        ++count;
    }
    return count;
}

static double dot3(const float *a, const float *b) {
    return (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2];
}

/* Depths and normals of validated pixels away from edges are right. */
static void check_accuracy(const photograph *truth, const view_maps *maps) {
    const size_t pixels = (size_t)maps->width * maps->height;
    size_t validated = 0, looked_at = 0, near_enough = 0, upright = 0;
    for (size_t i = 0; i < pixels; ++i) {
        if (maps->depth[SKEP_MAPS_VALIDATED][i] == 0) {
            continue;
        }
        ++validated;
        if (truth->surface[i]) {
            ++looked_at;
            near_enough += fabs(maps->depth[SKEP_MAPS_VALIDATED][i] / truth->depth[i] - 1) < 0.01;
            upright +=
                dot3(maps->normal[SKEP_MAPS_VALIDATED] + 3 * i, truth->normal + 3 * i) > cos(0.5);
        }
    }
    printf("validated %zu of %zu; away from edges %zu, of which within 1 %% %zu, normals within "
           "0.5 rad %zu\n",
           validated, pixels, looked_at, near_enough, upright);
    if (scene_is_small()) {
        return;
    }
    CHECK(validated * 2 > pixels, "%zu of %zu pixels", validated, pixels);
    CHECK(near_enough * 10 > looked_at * 9, "%zu of %zu pixels", near_enough, looked_at);
    CHECK(upright * 10 > looked_at * 8, "%zu of %zu pixels", upright, looked_at);
}

/* The maps of one view say the same of every pixel. */
static void check_agreement(const skep_camera *camera, const view_maps *maps) {
    const size_t pixels = (size_t)maps->width * maps->height;
    uint64_t counts[8] = {0};
    const uint32_t all = (uint32_t)((1ull << maps->source_total) - 1);
    for (size_t i = 0; i < pixels; ++i) {
        const size_t x = i % maps->width, y = i / maps->width;
        const float *raw = maps->normal[SKEP_MAPS_RAW] + 3 * i;
        const float *validated = maps->normal[SKEP_MAPS_VALIDATED] + 3 * i;
        const float ray[3] = {(float)((x - camera->cx) / camera->fx),
                              (float)((y - camera->cy) / camera->fy), 1};
        const float depth = maps->depth[SKEP_MAPS_RAW][i];
        ++counts[maps->status[i] & 7];
        CHECK(maps->status[i] <= SKEP_PIXEL_OUT_OF_RANGE, "%u at %zu, %zu", maps->status[i], x, y);
        /* The search goes on to 4 times the far end of a range that is derived from points. */
        CHECK(depth == 0 || (depth >= (float)SCENE_NEAR / 2 && depth <= (float)SCENE_FAR * 8), "%g",
              depth);
        CHECK(depth == 0 || fabs(dot3(raw, raw) - 1) < 1e-5, "%g", dot3(raw, raw));
        CHECK(depth == 0 || dot3(raw, ray) < 0, "a normal that faces away at %zu, %zu", x, y);
        const int is_validated = maps->status[i] == SKEP_PIXEL_VALIDATED;
        CHECK(maps->depth[SKEP_MAPS_VALIDATED][i] == (is_validated ? depth : 0), "at %zu, %zu", x,
              y);
        const float none[3] = {0, 0, 0};
        CHECK(same_bytes(validated, is_validated ? raw : none, sizeof none), "at %zu, %zu", x, y);
        CHECK(maps->cost[i] >= 0 && maps->cost[i] <= 2, "%g", maps->cost[i]);
        CHECK(bits(maps->source_bits[i]) == maps->source_count[i], "at %zu, %zu", x, y);
        CHECK((maps->source_bits[i] & ~all) == 0, "%x of %zu sources",
              (unsigned)maps->source_bits[i], maps->source_total);
    }
    CHECK(same_bytes(counts, maps->statistics.status_counts, sizeof counts),
          "statuses are counted");
    CHECK(maps->statistics.ncc_evaluations > pixels, "%llu",
          (unsigned long long)maps->statistics.ncc_evaluations);
    CHECK(maps->statistics.bilinear_samples > maps->statistics.ncc_evaluations,
          "patches have several samples");
    CHECK(maps->statistics.early_terminations > 0, "some hypotheses are rejected early");
    CHECK(maps->cycle_total >= 2, "%zu", maps->cycle_total);
    for (size_t i = 0; i < maps->cycle_total; ++i) {
        const skep_cycle_record *cycle = &maps->cycles[i];
        CHECK(cycle->changed <= cycle->pixels && cycle->validated <= cycle->pixels, "cycle %zu", i);
        CHECK(i == 0 || cycle->downscale < cycle[-1].downscale ||
                  (cycle->downscale == cycle[-1].downscale && cycle->cycle == cycle[-1].cycle + 1),
              "cycle %zu", i);
    }
    const skep_cycle_record *last = &maps->cycles[maps->cycle_total - 1];
    /* Gap filling adds validated pixels, and finishing removes none. */
    CHECK(last->downscale == 1 && last->validated <= counts[SKEP_PIXEL_VALIDATED],
          "the last cycle's check found %llu, the map has %llu",
          (unsigned long long)last->validated, (unsigned long long)counts[SKEP_PIXEL_VALIDATED]);
}

/* Every way to get a map gives the same values, and does not write between rows. */
static void check_strides(const skep_result *result, uint32_t view, const view_maps *maps) {
    const size_t width = maps->width, height = maps->height;
    const size_t sizes[] = {4, 12, 4, 1, 2, 4};
    const void *dense[] = {maps->depth[0], maps->normal[0],    maps->cost,
                           maps->status,   maps->source_count, maps->source_bits};
    for (int kind = 0; kind < 6; ++kind) {
        const size_t row = width * sizes[kind], stride = row + 7;
        guarded memory = guarded_take(rows_size(row, height, stride));
        fill_rows(&memory);
        void *out = memory.bytes;
        skep_status status = SKEP_OK;
        switch (kind) {
        case 0:
            status = skep_result_get_depth(result, view, SKEP_MAPS_RAW, out, stride);
            break;
        case 1:
            status = skep_result_get_normal(result, view, SKEP_MAPS_RAW, out, stride);
            break;
        case 2:
            status = skep_result_get_cost(result, view, out, stride);
            break;
        case 3:
            status = skep_result_get_status(result, view, out, stride);
            break;
        case 4:
            status = skep_result_get_source_count(result, view, out, stride);
            break;
        case 5:
            status = skep_result_get_source_bits(result, view, 0, out, stride);
            break;
        }
        REQUIRE(status);
        for (size_t y = 0; y < height; ++y) {
            CHECK(same_bytes(memory.bytes + y * stride, (const char *)dense[kind] + y * row, row),
                  "map %d, row %zu", kind, y);
        }
        CHECK(gaps_are_untouched(&memory, row, height, stride), "map %d", kind);
        guarded_free(&memory);
    }
    const float *depth, *normal, *cost;
    const uint8_t *status;
    REQUIRE(skep_result_borrow_depth(result, view, &depth));
    REQUIRE(skep_result_borrow_normal(result, view, &normal));
    REQUIRE(skep_result_borrow_cost(result, view, &cost));
    REQUIRE(skep_result_borrow_status(result, view, &status));
    CHECK(same_bytes(depth, maps->depth[0], 4 * width * height), "borrowed depths");
    CHECK(same_bytes(normal, maps->normal[0], 12 * width * height), "borrowed normals");
    CHECK(same_bytes(cost, maps->cost, 4 * width * height), "borrowed costs");
    CHECK(same_bytes(status, maps->status, width * height), "borrowed statuses");
}

/*
 * Points lie on the surfaces, their views see them, and their colors are those of the photographs.
 */
static void check_cloud(const scene *made, const skep_result *result) {
    points cloud = points_of_result(result);
    CHECK(scene_is_small() || cloud.count > scene_pixels(made) / 2, "%zu points", cloud.count);
    size_t next = 0, on_surface = 0, right_color = 0;
    for (size_t i = 0; i < cloud.count; ++i) {
        const float *n = cloud.normals + 3 * i;
        CHECK(fabs(dot3(n, n) - 1) < 1e-5, "point %zu has a normal of square %g", i, dot3(n, n));
        CHECK(cloud.view_counts[i] >= 3, "point %zu has %u views", i,
              (unsigned)cloud.view_counts[i]);
        uint32_t seen = 0;
        for (size_t j = 0; j < cloud.view_counts[i]; ++j) {
            CHECK(cloud.views[next + j] < made->views, "point %zu", i);
            CHECK(!(seen >> cloud.views[next + j] & 1), "point %zu has a view twice", i);
            seen |= 1u << cloud.views[next + j];
        }
        const photograph *first = &made->photographs[cloud.views[next]];
        const double *r = first->camera.rotation, *t = first->camera.translation,
                     *p = cloud.positions + 3 * i;
        const double z = r[6] * p[0] + r[7] * p[1] + r[8] * p[2] + t[2];
        const double x = r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + t[0];
        const double y = r[3] * p[0] + r[4] * p[1] + r[5] * p[2] + t[1];
        const double column = floor(first->camera.fx * x / z + first->camera.cx + 0.5);
        const double row = floor(first->camera.fy * y / z + first->camera.cy + 0.5);
        if (column >= 0 && row >= 0 && column < made->width && row < made->height) {
            const size_t pixel = (size_t)row * made->width + (size_t)column;
            on_surface += fabs(z / first->depth[pixel] - 1) < 0.02;
            int most = 0;
            for (int channel = 0; channel < 3; ++channel) {
                const int away =
                    abs(cloud.colors[3 * i + channel] - first->rgb[3 * pixel + channel]);
                most = away > most ? away : most;
            }
            right_color += most < 40;
        }
        next += cloud.view_counts[i];
    }
    printf("%zu points, %zu within 2 %%, %zu of the right color\n", cloud.count, on_surface,
           right_color);
    CHECK(next == cloud.view_total, "%zu of %zu views", next, cloud.view_total);
    CHECK(scene_is_small() || on_surface * 10 > cloud.count * 9, "%zu of %zu points", on_surface,
          cloud.count);
    CHECK(scene_is_small() || right_color * 10 > cloud.count * 9, "%zu of %zu points", right_color,
          cloud.count);
    points_free(&cloud);
}

typedef struct listener {
    int calls;
    int backwards;
    double last;
    uint32_t phases;
    uint32_t views;
} listener;

static int32_t listen(void *user, const skep_progress *progress) {
    listener *heard = user;
    ++heard->calls;
    heard->backwards += progress->done < heard->last - 0.02 || progress->done > 1;
    heard->last = progress->done;
    heard->phases |= 1u << progress->phase;
    heard->views = progress->view_count;
    return 0;
}

void test_whole(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_scene *handed_in = scene_hand_in(&made);
    skep_options *options = quick_options();
    skep_result *result = NULL;
    listener heard = {0};
    REQUIRE(skep_reconstruct(handed_in, options, listen, &heard, &result));
    printf("%d calls of the callback\n", heard.calls);
    CHECK(heard.calls >= 2 && heard.last == 1 && heard.views == made.views, "%d calls",
          heard.calls);
    CHECK(heard.backwards == 0, "%d of %d calls", heard.backwards, heard.calls);
    CHECK(heard.phases >> SKEP_PHASE_SEARCH & heard.phases >> SKEP_PHASE_FUSION & 1, "%x",
          (unsigned)heard.phases);
    char warning[64] = "";
    size_t needed = 99;
    CHECK(skep_result_get_warning(result, 0, warning, sizeof warning, &needed) ==
                  SKEP_ERR_ARGUMENT &&
              needed == 99,
          "there is nothing to warn of, but \"%s\"", warning);

    for (uint32_t view = 0; view < made.views; ++view) {
        view_maps maps = maps_of(result, view);
        CHECK(maps.width == made.width && maps.height == made.height, "view %u", (unsigned)view);
        check_accuracy(&made.photographs[view], &maps);
        check_agreement(&made.photographs[view].camera, &maps);
        check_strides(result, view, &maps);
        uint32_t expected[MAX_VIEWS];
        size_t count = 0;
        REQUIRE(skep_scene_get_sources(handed_in, options, view, expected, MAX_VIEWS, &count));
        CHECK(count == maps.source_total && same_bytes(expected, maps.sources, 4 * count),
              "view %u", (unsigned)view);
        maps_free(&maps);
    }
    check_cloud(&made, result);

    /* A cloud outlives its result, and a result its scene and options. */
    skep_cloud *cloud = NULL;
    REQUIRE(skep_result_get_cloud(result, &cloud));
    const points before = points_of_result(result);
    REQUIRE(skep_options_set(options, "threads", 1));
    skep_result *again = scene_run(handed_in, options);
    check_same_results(result, again, made.views, "one thread and two");
    skep_options_destroy(options);
    skep_scene_destroy(handed_in);
    skep_result_destroy(again);
    skep_result_destroy(result);
    points after = points_of(cloud);
    check_same_points(&before, &after, "a cloud without its result");
    points_free(&after);
    points_free((points *)&before);
    skep_cloud_destroy(cloud);
    scene_free(&made);
}
