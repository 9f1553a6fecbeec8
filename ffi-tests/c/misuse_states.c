/* Maps that make no state, and saved states that were cut or garbled: refused, or harmless. */
#include "support/check.h"
#include "support/guarded.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check_maps(const scene *made, const skep_steps *steps, uint32_t last) {
    const photograph *truth = &made->photographs[0];
    const size_t pixels = scene_pixels(made), row = 4 * (size_t)made->width;
    float *depth = take(pixels, sizeof *depth), *normal = take(pixels, 3 * sizeof *normal);
    float *cost = take(pixels, sizeof *cost);
    uint8_t *validated = take(pixels, 1);
    memcpy(depth, truth->depth, pixels * sizeof *depth);
    memcpy(normal, truth->normal, pixels * 3 * sizeof *normal);
    skep_state **out = OUT(skep_state *, 0);
#define FROM(steps, step, view, depth, a, normal, b, validated, c, cost, d, out)                   \
    skep_state_from_maps(steps, step, view, depth, a, normal, b, validated, c, cost, d, out)
    const size_t w = made->width;
    FAILS(FROM(NULL, last, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out), SKEP_ERR_NULL,
          "steps");
    FAILS(FROM(steps, last, 0, NULL, row, normal, 3 * row, NULL, 0, NULL, 0, out), SKEP_ERR_NULL,
          "depth");
    FAILS(FROM(steps, last, 0, depth, row, NULL, 3 * row, NULL, 0, NULL, 0, out), SKEP_ERR_NULL,
          "normal");
    FAILS(FROM(steps, last, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, NULL), SKEP_ERR_NULL,
          "state_out");
    FAILS(FROM(steps, last + 1, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "step");
    FAILS(FROM(steps, last, 9, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "view");
    FAILS(FROM(steps, last, 0, depth, row - 1, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of depth");
    FAILS(FROM(steps, last, 0, depth, row, normal, 3 * row - 1, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of normal");
    FAILS(FROM(steps, last, 0, depth, row, normal, 3 * row, validated, w - 1, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of validated");
    FAILS(FROM(steps, last, 0, depth, row, normal, 3 * row, NULL, 0, cost, row - 1, out),
          SKEP_ERR_ARGUMENT, "stride_bytes of cost");
    FAILS(FROM(steps, last, 0, depth, SIZE_MAX, normal, 3 * row, NULL, 0, NULL, 0, out),
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
        FAILS(FROM(steps, last, 0, depth, row, normal, 3 * row, validated, w, cost, row, out),
              SKEP_ERR_ARGUMENT, WRONG[i].word);
        *WRONG[i].place = kept;
    }
    for (size_t axis = 0; axis < 3; ++axis) {
        normal[axis] = -normal[axis];
    }
    FAILS(FROM(steps, last, 0, depth, row, normal, 3 * row, NULL, 0, NULL, 0, out),
          SKEP_ERR_ARGUMENT, "normal at column 0, row 0");
#undef FROM
    free(validated);
    free(cost);
    free(normal);
    free(depth);
}

static void check_getters(const skep_state *state, size_t pixels) {
    FAILS(skep_state_get_info(NULL, OUT(skep_state_info, 0)), SKEP_ERR_NULL, "state");
    FAILS(skep_state_get_info(state, NULL), SKEP_ERR_NULL, "info_out");
    FAILS(skep_state_get_maps(NULL, OUT(float, 0), NULL, NULL, NULL, pixels), SKEP_ERR_NULL,
          "state");
    const size_t less = pixels - 1;
    FAILS(skep_state_get_maps(state, OUT(float, 0), OUT(float, 1), OUT(float, 2), OUT(uint8_t, 3),
                              less),
          SKEP_ERR_CAPACITY, "depth");
    FAILS(skep_state_get_maps(state, NULL, OUT(float, 1), NULL, NULL, less), SKEP_ERR_CAPACITY,
          "normal");
    FAILS(skep_state_get_maps(state, NULL, NULL, OUT(float, 2), NULL, 0), SKEP_ERR_CAPACITY,
          "cost");
    FAILS(skep_state_get_maps(state, NULL, NULL, NULL, OUT(uint8_t, 3), less), SKEP_ERR_CAPACITY,
          "validated");
    FAILS(skep_state_save(NULL, OUT(uint8_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL, "state");
    FAILS(skep_state_save(state, OUT(uint8_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_CAPACITY, "buffer");
    FAILS(skep_state_save(state, OUT(uint8_t, 0), 9, NULL), SKEP_ERR_NULL, "size_out");
    FAILS(skep_state_save(state, NULL, 0, NULL), SKEP_ERR_NULL, "size_out");
}

/* Every cut is refused, whether bytes are missing or too many; none is read past its end. */
static void check_cuts(const skep_steps *steps, const uint8_t *bytes, size_t size) {
    const size_t step = size / 200 + 1;
    for (size_t cut = 0; cut < size; cut += cut < 300 ? 1 : step) {
        guarded memory = guarded_take(cut);
        memcpy(memory.bytes, bytes, cut);
        FAILS(skep_state_load(steps, memory.bytes, cut, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
              "bytes is");
        guarded_free(&memory);
    }
    uint8_t *longer = take(size + 9, 1);
    memcpy(longer, bytes, size);
    FAILS(skep_state_load(steps, longer, size + 1, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
          "bytes");
    FAILS(skep_state_load(steps, longer, size + 9, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
          "bytes");
    free(longer);
    FAILS(skep_state_load(NULL, bytes, size, OUT(skep_state *, 0)), SKEP_ERR_NULL, "steps");
    FAILS(skep_state_load(steps, NULL, size, OUT(skep_state *, 0)), SKEP_ERR_NULL, "bytes");
    FAILS(skep_state_load(steps, bytes, size, NULL), SKEP_ERR_NULL, "state_out");
    FAILS(skep_state_load(steps, bytes, SIZE_MAX, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
          "bytes");
}

static uint32_t next_random(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

/* A state that was garbled and yet passes may be wrong, but a step with it ends like any other. */
static void use(const scene *made, const skep_steps *steps, skep_state *state) {
    const skep_state *states[MAX_VIEWS] = {NULL};
    skep_state_info info;
    REQUIRE(skep_state_get_info(state, &info));
    CHECK(info.view < made->views && info.is_checked <= 1, "view %u", (unsigned)info.view);
    if (info.view >= made->views) {
        return;
    }
    states[info.view] = state;
    skep_state *next = NULL, *finer = NULL;
    skep_offers *offers = NULL;
    uint32_t following = 0;
    const skep_status statuses[] = {
        skep_steps_propagate(steps, 1, (info.view + 1) % made->views, states, made->views, &offers),
        skep_steps_search(steps, 1, info.view, states, made->views, NULL, NULL, NULL, &next),
        skep_steps_hand_up(steps, 2, info.view, state, &finer),
        skep_steps_next(steps, 1, states, made->views, &following),
    };
    for (int i = 0; i < 4; ++i) {
        CHECK(statuses[i] == SKEP_OK || statuses[i] == SKEP_ERR_ARGUMENT, "call %d: %s", i,
              skep_status_name(statuses[i]));
    }
    skep_offers_destroy(offers);
    skep_state_destroy(finer);
    skep_state_destroy(next);
}

static void check_garbled(const scene *made, const skep_steps *steps, const uint8_t *bytes,
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
        skep_state *state = NULL;
        const skep_status status = skep_state_load(steps, garbled, size, &state);
        if (status == SKEP_OK) {
            ++passed;
            if (passed % 16 == 0) {
                use(made, steps, state);
                ++used;
            }
            skep_state_destroy(state);
        } else {
            FAILS(status, SKEP_ERR_ARGUMENT, "bytes is");
            CHECK(state == NULL, "nothing is written in round %d", round);
        }
    }
    printf("%d of %d garbled states passed, %d were used\n", passed, rounds, used);
    /*
     * Numbers that are none are refused wherever they are: depth, normal and cost of the last
     * pixel.
     */
    const float not_a_number = NAN;
    for (size_t field = 0; field < 5; ++field) {
        memcpy(garbled, bytes, size);
        memcpy(garbled + size - 26 + 4 * field, &not_a_number, sizeof not_a_number);
        FAILS(skep_state_load(steps, garbled, size, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT,
              "bytes");
    }
    /* So is a pixel that is validated without a depth. */
    memcpy(garbled, bytes, size);
    memset(garbled + size - 26, 0, 4);
    garbled[size - 26 + 21] = 1;
    FAILS(skep_state_load(steps, garbled, size, OUT(skep_state *, 0)), SKEP_ERR_ARGUMENT, "bytes");
    free(garbled);
}

void test_misuse_states(const char *folder) {
    (void)folder;
    scene made;
    scene_make_sized(&made, 3, 24, 18);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    skep_steps *steps = NULL;
    REQUIRE(skep_steps_create(handed_in, options, &steps));
    uint32_t last = 0, width = 0, height = 0;
    REQUIRE(skep_steps_get_count(steps, &last, NULL));
    check_maps(&made, steps, --last);
    REQUIRE(skep_steps_get_size(steps, 0, 0, &width, &height));
    skep_state *searched[3] = {NULL}, *state = NULL;
    for (uint32_t view = 0; view < made.views; ++view) {
        REQUIRE(skep_steps_search(steps, 0, view, NULL, 0, NULL, NULL, NULL, &searched[view]));
    }
    REQUIRE(skep_steps_check(steps, 0, 0, (const skep_state *const *)searched, made.views, &state));
    check_getters(state, (size_t)width * height);
    size_t size = 0;
    REQUIRE(skep_state_save(state, NULL, 0, &size));
    uint8_t *bytes = take(size, 1);
    REQUIRE(skep_state_save(state, bytes, size, &size));
    check_cuts(steps, bytes, size);
    check_garbled(&made, steps, bytes, size);
    skep_state *loaded = NULL;
    REQUIRE(skep_state_load(steps, bytes, size, &loaded));
    skep_state_destroy(loaded);
    free(bytes);
    skep_state_destroy(state);
    for (uint32_t view = 0; view < made.views; ++view) {
        skep_state_destroy(searched[view]);
    }
    skep_steps_destroy(steps);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
