/*
 * Homographies and patch correlations are right, the same alone and in batches, and from several
 * threads at once.
 */
#define _POSIX_C_SOURCE 200809L
#include "support/check.h"
#include "support/patches.h"
#include "tests.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 400 };

typedef struct batch {
    const scene *made;
    skep_ncc_window *window;
    skep_packed_image *reference;
    skep_packed_image *source;
    skep_plane planes[MOST];
    uint32_t pixels[2 * MOST];
    double homographies[9 * MOST];
    float ncc[MOST];
    size_t count;
} batch;

/* The homography maps a pixel to the projection of its plane point. */
static void check_homographies(const batch *work) {
    const skep_camera *from = &work->made->photographs[0].camera,
                      *to = &work->made->photographs[1].camera;
    for (size_t i = 0; i < work->count; ++i) {
        const double *h = work->homographies + 9 * i;
        const double x = work->pixels[2 * i], y = work->pixels[2 * i + 1];
        const double z = h[6] * x + h[7] * y + h[8];
        const double ray[3] = {(x - from->cx) / from->fx, (y - from->cy) / from->fy, 1};
        const double *n = work->planes[i].normal;
        const double depth =
            -work->planes[i].distance / (n[0] * ray[0] + n[1] * ray[1] + n[2] * ray[2]);
        double world[3] = {0, 0, 0}, there[3];
        for (int row = 0; row < 3; ++row) {
            for (int axis = 0; axis < 3; ++axis) {
                world[axis] +=
                    from->rotation[3 * row + axis] * (ray[row] * depth - from->translation[row]);
            }
        }
        for (int row = 0; row < 3; ++row) {
            const double *r = to->rotation + 3 * row;
            there[row] = r[0] * world[0] + r[1] * world[1] + r[2] * world[2] + to->translation[row];
        }
        const double column = to->fx * there[0] / there[2] + to->cx;
        const double line = to->fy * there[1] / there[2] + to->cy;
        CHECK(fabs((h[0] * x + h[1] * y + h[2]) / z - column) < 1e-9, "patch %zu", i);
        CHECK(fabs((h[3] * x + h[4] * y + h[5]) / z - line) < 1e-9, "patch %zu", i);

        double alone[9];
        REQUIRE(skep_plane_homographies(from, to, &work->planes[i], 1, alone));
        CHECK(same_bytes(alone, h, sizeof alone), "patch %zu alone", i);
    }
}

static void check_correlations(const batch *work) {
    double sums[2] = {0, 0};
    size_t better = 0;
    for (size_t i = 0; i < work->count; ++i) {
        float alone = 9;
        CHECK(work->ncc[i] >= -1 && work->ncc[i] <= 1, "%g", work->ncc[i]);
        REQUIRE(skep_patch_ncc(work->window, work->reference, work->source, work->pixels + 2 * i,
                               work->homographies + 9 * i, 1, &alone));
        CHECK(same_bytes(&alone, &work->ncc[i], sizeof alone), "patch %zu alone", i);
        sums[i % 2] += work->ncc[i];
        better += i % 2 && work->ncc[i - 1] > work->ncc[i];
    }
    const double pairs = (double)work->count / 2;
    printf(
        "%g pairs of patches: mean NCC %.3f at the true depth, %.3f behind it; better %zu times\n",
        pairs, sums[0] / pairs, sums[1] / pairs, better);
    CHECK(scene_is_small() || sums[0] > 0.85 * pairs, "%g", sums[0] / pairs);
    CHECK(scene_is_small() || (double)better > 0.9 * pairs, "%zu of %g", better, pairs);
}

/* The NCC of a patch is 1 with itself and -1 with its negative; without texture it is -1. */
static void check_known_values(void) {
    enum { SIDE = 21 };
    static uint8_t gray[3][SIDE * SIDE];
    skep_packed_image *samples[3];
    for (int i = 0; i < SIDE * SIDE; ++i) {
        gray[0][i] = (uint8_t)(i * i % 199 + 20);
        gray[1][i] = (uint8_t)(255 - gray[0][i]);
        gray[2][i] = 77;
    }
    for (int i = 0; i < 3; ++i) {
        const skep_image image = {gray[i], SIDE, SIDE, SIDE, SKEP_FORMAT_GRAY};
        REQUIRE(skep_packed_image_create(&image, &samples[i]));
    }
    skep_ncc_window *window = NULL;
    REQUIRE(skep_ncc_window_create(3, 1, INFINITY, INFINITY, 1e-5, &window));
    const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double nowhere[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    const double far_away[9] = {1, 0, 1e300, 0, 1, -1e300, 0, 0, 1};
    const uint32_t pixel[2] = {10, 9}, corner[2] = {SIDE - 1, SIDE - 1};
    const struct {
        int reference, source;
        const uint32_t *pixel;
        const double *homography;
        float expected;
    } cases[] = {{0, 0, pixel, same, 1},     {0, 1, pixel, same, -1}, {0, 2, pixel, same, -1},
                 {2, 0, pixel, same, -1},    {0, 0, corner, same, 1}, {0, 0, pixel, nowhere, -1},
                 {0, 0, pixel, far_away, -1}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        float ncc = 9;
        REQUIRE(skep_patch_ncc(window, samples[cases[i].reference], samples[cases[i].source],
                               cases[i].pixel, cases[i].homography, 1, &ncc));
        CHECK(fabsf(ncc - cases[i].expected) < 1e-5f, "case %zu: %g", i, ncc);
    }
    skep_ncc_window_destroy(window);
    for (int i = 0; i < 3; ++i) {
        skep_packed_image_destroy(samples[i]);
    }
}

static void *correlate_often(void *argument) {
    const batch *work = argument;
    const skep_camera *from = &work->made->photographs[0].camera,
                      *to = &work->made->photographs[1].camera;
    double *homographies = take(9 * work->count, sizeof *homographies);
    float *ncc = take(work->count, sizeof *ncc);
    for (int round = 0; round < (scene_is_small() ? 3 : 50); ++round) {
        REQUIRE(skep_plane_homographies(from, to, work->planes, work->count, homographies));
        REQUIRE(skep_patch_ncc(work->window, work->reference, work->source, work->pixels,
                               homographies, work->count, ncc));
        CHECK(same_bytes(homographies, work->homographies, 9 * work->count * sizeof *homographies),
              "round %d", round);
        CHECK(same_bytes(ncc, work->ncc, work->count * sizeof *ncc), "round %d", round);
    }
    free(ncc);
    free(homographies);
    return NULL;
}

void test_kernels(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    batch *work = take(1, sizeof *work);
    work->made = &made;
    work->window = make_window();
    work->reference = make_packed_image(&made, 0);
    work->source = make_packed_image(&made, 1);
    work->count = make_patches(&made, 0, MOST, work->planes, work->pixels);
    REQUIRE(skep_plane_homographies(&made.photographs[0].camera, &made.photographs[1].camera,
                                    work->planes, work->count, work->homographies));
    REQUIRE(skep_patch_ncc(work->window, work->reference, work->source, work->pixels,
                           work->homographies, work->count, work->ncc));
    check_homographies(work);
    check_correlations(work);
    check_known_values();
    REQUIRE(skep_plane_homographies(&made.photographs[0].camera, &made.photographs[1].camera, NULL,
                                    0, NULL));
    REQUIRE(skep_patch_ncc(work->window, work->reference, work->source, NULL, NULL, 0, NULL));

    pthread_t threads[4];
    for (int i = 0; i < 4; ++i) {
        CHECK(pthread_create(&threads[i], NULL, correlate_often, work) == 0, "thread %d", i);
    }
    for (int i = 0; i < 4; ++i) {
        pthread_join(threads[i], NULL);
    }
    skep_packed_image_destroy(work->source);
    skep_packed_image_destroy(work->reference);
    skep_ncc_window_destroy(work->window);
    free(work);
    scene_free(&made);
}
