/* Maps that make no estimate, and saved estimates that were cut or garbled: refused, or harmless.
 */
#include "support/check.h"
#include "support/guarded.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check_maps(const scene *made, const skep_stepper *stepper, uint32_t last) {
    const photograph *truth = &made->photographs[0];
    const size_t pixels = scene_pixels(made), row = 4 * (size_t)made->width;
    float *depth = take(pixels, sizeof *depth), *normal = take(pixels, 3 * sizeof *normal);
    float *cost = take(pixels, sizeof *cost);
    uint8_t *validated = take(pixels, 1);
    memcpy(depth, truth->depth, pixels * sizeof *depth);
    memcpy(normal, truth->normal, pixels * 3 * sizeof *normal);
    skep_estimate **out = OUT(skep_estimate *, 0);
#define FROM(stepper, cycle, view, depth, a, normal, b, validated, c, cost, d, out)                \
    skep_estimate_from_maps(stepper, cycle, view, depth, a, normal, b, validated, c, cost, d, out)
    const size_t w = made->width;
    FAILS(FROM(NULL, last, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out), SKEP_ERR_NULL,
          "stepper");
    FAILS(FROM(stepper, last, 0, NULL, row, normal, 3 * row, NULL, 0, NULL, 0, out), SKEP_ERR_NULL,
          "depth");
    FAILS(FROM(stepper, last, 0, depth, row, NULL, 3 * row, NULL, 0, NULL, 0, out), SKEP_ERR_NULL,
          "normal");
    FAILS(FROM(stepper, last, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, NULL),
          SKEP_ERR_NULL, "estimate_out");
    FAILS(FROM(stepper, last + 1, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "cycle");
    FAILS(FROM(stepper, last, 9, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "view");
    FAILS(FROM(stepper, last, 0, depth, row - 1, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of depth");
    FAILS(FROM(stepper, last, 0, depth, row, normal, 3 * row - 1, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of normal");
    FAILS(FROM(stepper, last, 0, depth, row, normal, 3 * row, validated, w - 1, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of validated");
    FAILS(FROM(stepper, last, 0, depth, row, normal, 3 * row, NULL, 0, cost, row - 1, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of cost");
    FAILS(FROM(stepper, last, 0, depth, SIZE_MAX, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of depth");
    const struct {
        float *place;
        float value;
        const char *word;
    } WRONG[] = {{depth + w + 3, NAN, "depth at column 3, row 1"},
                 {depth + w + 3, -1, "depth at column 3, row 1"},
                 {depth + w + 3, INFINITY, "depth at column 3"},
                 {cost + 2, NAN, "cost at column 2, row 0"},
                 {cost + 2, -0.5f, "cost at column 2, row 0"},
                 {normal + 5, NAN, "normal at column 1, row 0"},
                 {normal + 5, 5, "normal at column 1, row 0"},
                 {normal + 5, 0, "normal at column 1, row 0"}};
    for (size_t i = 0; i < sizeof WRONG / sizeof WRONG[0]; ++i) {
        const float kept = *WRONG[i].place;
        *WRONG[i].place = WRONG[i].value;
        FAILS(FROM(stepper, last, 0, depth, row, normal, 3 * row, validated, w, cost, row, out),
              SKEP_ERR_ARGUMENT, WRONG[i].word);
        *WRONG[i].place = kept;
    }
    for (size_t axis = 0; axis < 3; ++axis) {
        normal[axis] = -normal[axis];
    }
    FAILS(FROM(stepper, last, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "normal at column 0, row 0");
#undef FROM
    free(validated);
    free(cost);
    free(normal);
    free(depth);
}

static void check_getters(const skep_estimate *estimate, size_t pixels) {
    FAILS(skep_estimate_get_info(NULL, OUT(skep_estimate_info, 0)), SKEP_ERR_NULL, "estimate");
    FAILS(skep_estimate_get_info(estimate, NULL), SKEP_ERR_NULL, "info_out");
    FAILS(skep_estimate_get_maps(NULL, OUT(float, 0), NULL, NULL, NULL, pixels), SKEP_ERR_NULL,
          "estimate");
    const size_t less = pixels - 1;
    FAILS(skep_estimate_get_maps(estimate, OUT(float, 0), OUT(float, 1), OUT(float, 2),
                                 OUT(uint8_t, 3), less),
          SKEP_ERR_CAPACITY, "depth");
    FAILS(skep_estimate_get_maps(estimate, NULL, OUT(float, 1), NULL, NULL, less),
          SKEP_ERR_CAPACITY, "normal");
    FAILS(skep_estimate_get_maps(estimate, NULL, NULL, OUT(float, 2), NULL, 0), SKEP_ERR_CAPACITY,
          "cost");
    FAILS(skep_estimate_get_maps(estimate, NULL, NULL, NULL, OUT(uint8_t, 3), less),
          SKEP_ERR_CAPACITY, "validated");
    FAILS(skep_estimate_save(NULL, OUT(uint8_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL, "estimate");
    FAILS(skep_estimate_save(estimate, OUT(uint8_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_CAPACITY,
          "buffer");
    FAILS(skep_estimate_save(estimate, OUT(uint8_t, 0), 9, NULL), SKEP_ERR_NULL, "size_out");
    FAILS(skep_estimate_save(estimate, NULL, 0, NULL), SKEP_ERR_NULL, "size_out");
}

/* Every cut is refused, whether bytes are missing or too many; none is read past its end. */
static void check_cuts(const skep_stepper *stepper, const uint8_t *bytes, size_t size) {
    const size_t stride = size / 200 + 1;
    for (size_t cut = 0; cut < size; cut += cut < 300 ? 1 : stride) {
        guarded memory = guarded_take(cut);
        memcpy(memory.bytes, bytes, cut);
        FAILS(skep_estimate_load(stepper, memory.bytes, cut, OUT(skep_estimate *, 0)),
              SKEP_ERR_ARGUMENT, "bytes is");
        guarded_free(&memory);
    }
    uint8_t *longer = take(size + 9, 1);
    memcpy(longer, bytes, size);
    FAILS(skep_estimate_load(stepper, longer, size + 1, OUT(skep_estimate *, 0)), SKEP_ERR_ARGUMENT,
          "bytes");
    FAILS(skep_estimate_load(stepper, longer, size + 9, OUT(skep_estimate *, 0)), SKEP_ERR_ARGUMENT,
          "bytes");
    free(longer);
    FAILS(skep_estimate_load(NULL, bytes, size, OUT(skep_estimate *, 0)), SKEP_ERR_NULL, "stepper");
    FAILS(skep_estimate_load(stepper, NULL, size, OUT(skep_estimate *, 0)), SKEP_ERR_NULL, "bytes");
    FAILS(skep_estimate_load(stepper, bytes, size, NULL), SKEP_ERR_NULL, "estimate_out");
    FAILS(skep_estimate_load(stepper, bytes, SIZE_MAX, OUT(skep_estimate *, 0)), SKEP_ERR_ARGUMENT,
          "bytes");
}

static uint32_t next_random(uint32_t *estimate) {
    *estimate = *estimate * 1664525u + 1013904223u;
    return *estimate >> 8;
}

/* An estimate that was garbled and yet passes may be wrong, but a cycle with it ends like any
 * other. */
static void use(const scene *made, const skep_stepper *stepper, skep_estimate *estimate) {
    const skep_estimate *estimates[MAX_VIEWS] = {NULL};
    skep_estimate_info info;
    REQUIRE(skep_estimate_get_info(estimate, &info));
    CHECK(info.view < made->views && info.is_checked <= 1, "view %u", (unsigned)info.view);
    if (info.view >= made->views) {
        return;
    }
    estimates[info.view] = estimate;
    skep_estimate *next = NULL, *finer = NULL;
    skep_candidates *candidates = NULL;
    uint32_t following = 0;
    const skep_status statuses[] = {
        skep_stepper_propagate(stepper, 1, (info.view + 1) % made->views, estimates, made->views,
                               &candidates),
        skep_stepper_search(stepper, 1, info.view, estimates, made->views, NULL, NULL, NULL, &next),
        skep_stepper_upsample(stepper, 2, info.view, estimate, &finer),
        skep_stepper_next(stepper, 1, estimates, made->views, &following),
    };
    for (int i = 0; i < 4; ++i) {
        CHECK(statuses[i] == SKEP_OK || statuses[i] == SKEP_ERR_ARGUMENT, "call %d: %s", i,
              skep_status_name(statuses[i]));
    }
    skep_candidates_destroy(candidates);
    skep_estimate_destroy(finer);
    skep_estimate_destroy(next);
}

static void check_garbled(const scene *made, const skep_stepper *stepper, const uint8_t *bytes,
                          size_t size) {
    static const uint8_t VALUES[] = {0x00, 0xFF, 0x7F, 0x80, 0x01};
    uint8_t *garbled = take(size, 1);
    uint32_t seed = 12345;
    int passed = 0, used = 0;
    const int rounds = scene_is_small() ? 150 : 1500;
    for (int round = 0; round < rounds; ++round) {
        memcpy(garbled, bytes, size);
        /* The header in every second round, byte by byte; anything anywhere in the others. */
        const size_t changes = round % 2 ? 1 + next_random(&seed) % 8 : 1;
        for (size_t i = 0; i < changes; ++i) {
            const size_t reach = round % 2 ? size : 160;
            garbled[next_random(&seed) % reach] = VALUES[next_random(&seed) % 5];
        }
        skep_estimate *estimate = NULL;
        const skep_status status = skep_estimate_load(stepper, garbled, size, &estimate);
        if (status == SKEP_OK) {
            ++passed;
            if (passed % 16 == 0) {
                use(made, stepper, estimate);
                ++used;
            }
            skep_estimate_destroy(estimate);
        } else {
            FAILS(status, SKEP_ERR_ARGUMENT, "bytes is");
            CHECK(estimate == NULL, "nothing is written in round %d", round);
        }
    }
    printf("%d of %d garbled estimates passed, %d were used\n", passed, rounds, used);
    /*
     * Numbers that are none are refused wherever they are: depth, normal and cost of the last
     * pixel.
     */
    const float not_a_number = NAN;
    for (size_t field = 0; field < 5; ++field) {
        memcpy(garbled, bytes, size);
        memcpy(garbled + size - 26 + 4 * field, &not_a_number, sizeof not_a_number);
        FAILS(skep_estimate_load(stepper, garbled, size, OUT(skep_estimate *, 0)),
              SKEP_ERR_ARGUMENT, "bytes");
    }
    /* So is a pixel that is validated without a depth. */
    memcpy(garbled, bytes, size);
    memset(garbled + size - 26, 0, 4);
    garbled[size - 26 + 21] = 1;
    FAILS(skep_estimate_load(stepper, garbled, size, OUT(skep_estimate *, 0)), SKEP_ERR_ARGUMENT,
          "bytes");
    free(garbled);
}

void test_misuse_estimates(const char *folder) {
    (void)folder;
    scene made;
    scene_make_sized(&made, 3, 24, 18);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    skep_stepper *stepper = NULL;
    REQUIRE(skep_stepper_create(handed_in, options, &stepper));
    uint32_t last = 0, width = 0, height = 0;
    REQUIRE(skep_stepper_get_count(stepper, &last, NULL));
    check_maps(&made, stepper, --last);
    REQUIRE(skep_stepper_get_size(stepper, 0, 0, &width, &height));
    skep_estimate *searched[3] = {NULL}, *estimate = NULL;
    for (uint32_t view = 0; view < made.views; ++view) {
        REQUIRE(skep_stepper_search(stepper, 0, view, NULL, 0, NULL, NULL, NULL, &searched[view]));
    }
    REQUIRE(skep_stepper_check(stepper, 0, 0, (const skep_estimate *const *)searched, made.views,
                               &estimate));
    check_getters(estimate, (size_t)width * height);
    size_t size = 0;
    REQUIRE(skep_estimate_save(estimate, NULL, 0, &size));
    uint8_t *bytes = take(size, 1);
    REQUIRE(skep_estimate_save(estimate, bytes, size, &size));
    check_cuts(stepper, bytes, size);
    check_garbled(&made, stepper, bytes, size);
    skep_estimate *loaded = NULL;
    REQUIRE(skep_estimate_load(stepper, bytes, size, &loaded));
    skep_estimate_destroy(loaded);
    free(bytes);
    skep_estimate_destroy(estimate);
    for (uint32_t view = 0; view < made.views; ++view) {
        skep_estimate_destroy(searched[view]);
    }
    skep_stepper_destroy(stepper);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
