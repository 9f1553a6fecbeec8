/*
 * Errors of texts, options and scenes: the status, the argument's name, nothing written, nothing
 * changed.
 */
#include "support/check.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Invalid texts of an option are refused with its name, and its value is kept. */
static void check_option_texts(skep_options *options) {
    static const char *const TEXTS[][2] = {
        {"seed", "-1"},
        {"seed", "18446744073709551616"},
        {"simd", "avx512"},
        {"simd", ""},
        {"threads", "two"},
        {"search.view_propagation", "yes"},
        {"check.depth_tolerance", "1 %"},
        {"check.depth_tolerance", "2"},
        {"schedule.scales", ""},
        {"schedule.scales", "2:4:1+1x1"},
        {"schedule.scales", "downscale=2 food_sources=4 iterations=1+1x1"},
        {"schedule.scales", "downscale=4 food_sources=4 iterations=1+1x1; "
                            "downscale=1 food_sources=4 iterations=1+1x1"},
        {"schedule.scales", "downscale=1 food_sources=1 iterations=1+1x1"},
        {"schedule.scales", "downscale=1 food_sources=65 iterations=1+1x1"},
        {"schedule.scales", "downscale=1 food_sources=4 iterations=1+1001x1"},
        {"schedule.scales", "downscale=1 food_sources=4 iterations=4294967296+1x1"}};
    char before[256], after[256];
    for (size_t i = 0; i < sizeof TEXTS / sizeof TEXTS[0]; ++i) {
        const char *const name = TEXTS[i][0];
        REQUIRE(skep_options_get_text(options, name, before, sizeof before, NULL));
        FAILS(skep_options_set_text(options, name, TEXTS[i][1]), SKEP_ERR_ARGUMENT, name);
        REQUIRE(skep_options_get_text(options, name, after, sizeof after, NULL));
        CHECK(strcmp(before, after) == 0, "%s", name);
    }
    FAILS(skep_options_set_text(NULL, "seed", "1"), SKEP_ERR_NULL, "options");
    FAILS(skep_options_set_text(options, NULL, "1"), SKEP_ERR_NULL, "name");
    FAILS(skep_options_set_text(options, "seed", NULL), SKEP_ERR_NULL, "value");
    FAILS(skep_options_set_text(options, "no", "1"), SKEP_ERR_ARGUMENT, "no");
    FAILS(skep_options_get_text(NULL, "seed", OUT(char, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "options");
    FAILS(skep_options_get_text(options, "no", OUT(char, 0), 9, OUT(size_t, 1)), SKEP_ERR_ARGUMENT,
          "no");
    /* Two groups have an option of this name. */
    FAILS(skep_options_get_text(options, "depth_tolerance", OUT(char, 0), 9, OUT(size_t, 1)),
          SKEP_ERR_ARGUMENT, "fusion.depth_tolerance");
}

static void check_texts(void) {
    char text[64];
    memset(text, 'x', sizeof text);
    CHECK(skep_last_error(NULL, 0) == 1 && skep_last_error(text, 1) == 1, "no failure yet");
    CHECK(text[0] == 0 && text[1] == 'x', "an empty text");
    CHECK(skep_scene_create(NULL) == SKEP_ERR_NULL, "NULL");
    const size_t whole = skep_last_error(NULL, 0);
    CHECK(whole > 10 && whole < sizeof text, "%zu", whole);
    for (size_t capacity = 0; capacity <= whole + 2; ++capacity) {
        memset(text, 'x', sizeof text);
        CHECK(skep_last_error(text, capacity) == whole, "room for %zu", capacity);
        CHECK(text[capacity] == 'x', "room for %zu is kept to", capacity);
        CHECK(capacity == 0 || strlen(text) == (capacity < whole ? capacity : whole) - 1, "%zu",
              capacity);
    }
    /* Calls that succeed leave the text alone; so does asking for it. */
    skep_scene *handed_in = NULL;
    REQUIRE(skep_scene_create(&handed_in));
    CHECK(skep_last_error(text, sizeof text) == whole && strstr(text, "scene_out"), "%s", text);
    /* Names with umlauts are cut between characters. */
    skep_options *options = NULL;
    REQUIRE(skep_options_create(NULL, &options));
    CHECK(skep_options_set(options, "\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4", 0) == SKEP_ERR_ARGUMENT,
          "no option");
    for (size_t capacity = 1; capacity < sizeof text; ++capacity) {
        skep_last_error(text, capacity);
        const size_t length = strlen(text);
        CHECK(length < capacity && (length == 0 || (unsigned char)text[length - 1] != 0xC3), "%zu",
              capacity);
    }
    skep_options_destroy(options);
    skep_scene_destroy(handed_in);
    for (skep_status status = 5; status > -20; --status) {
        CHECK(skep_status_name(status) && strlen(skep_status_name(status)) >= 2, "%d", (int)status);
    }
    CHECK(strcmp(skep_status_name(SKEP_ERR_CAPACITY), "capacity") == 0, "a word");
    CHECK(strchr(skep_version(), '.') != NULL && strlen(skep_simd_level_name()) >= 2, "%s",
          skep_version());
}

static void check_options(void) {
    skep_options *options = NULL;
    REQUIRE(skep_options_create("default", &options));
    FAILS(skep_options_create(NULL, NULL), SKEP_ERR_NULL, "options_out");
    FAILS(skep_options_create("best", OUT(skep_options *, 0)), SKEP_ERR_ARGUMENT, "preset is best");
    FAILS(skep_options_create("\xFF", OUT(skep_options *, 0)), SKEP_ERR_ARGUMENT, "UTF-8");
    FAILS(skep_options_set(NULL, "smoothness_reward", 0), SKEP_ERR_NULL, "options");
    FAILS(skep_options_set(options, NULL, 0), SKEP_ERR_NULL, "name");
    FAILS(skep_options_set(options, "", 0), SKEP_ERR_ARGUMENT, "an option of a group");
    FAILS(skep_options_set(options, "rewards", 0), SKEP_ERR_ARGUMENT, "rewards");
    FAILS(skep_options_set(options, "\xC0\x80", 0), SKEP_ERR_ARGUMENT, "name");
    static const struct {
        const char *name;
        double value;
    } WRONG[] = {{"smoothness_reward", -0.1},
                 {"smoothness_reward", 1.1},
                 {"smoothness_reward", NAN},
                 {"threads", 1.5},
                 {"threads", -1},
                 {"threads", 1e9},
                 {"window_radius", 0},
                 {"window_radius", 17},
                 {"window_radius", 1e300},
                 {"view_propagation", 2},
                 {"view_propagation", NAN},
                 {"min_consistent_views", 0},
                 {"min_changed_fraction", INFINITY},
                 {"best_views", 9},
                 {"sigma_color", 0}};
    for (size_t i = 0; i < sizeof WRONG / sizeof WRONG[0]; ++i) {
        double before = -1, after = -2;
        REQUIRE(skep_options_get(options, WRONG[i].name, &before));
        FAILS(skep_options_set(options, WRONG[i].name, WRONG[i].value), SKEP_ERR_ARGUMENT,
              WRONG[i].name);
        REQUIRE(skep_options_get(options, WRONG[i].name, &after));
        CHECK(before == after, "%s", WRONG[i].name);
    }
    FAILS(skep_options_get(NULL, "smoothness_reward", OUT(double, 0)), SKEP_ERR_NULL, "options");
    FAILS(skep_options_get(options, NULL, OUT(double, 0)), SKEP_ERR_NULL, "name");
    FAILS(skep_options_get(options, "smoothness_reward", NULL), SKEP_ERR_NULL, "value_out");
    FAILS(skep_options_get(options, "no", OUT(double, 0)), SKEP_ERR_ARGUMENT, "no");
    FAILS(skep_options_get(options, "simd", OUT(double, 0)), SKEP_ERR_ARGUMENT, "simd");
    FAILS(skep_options_set(options, "seed", 1e17), SKEP_ERR_ARGUMENT, "seed");
    FAILS(skep_options_set(options, "scales", 1), SKEP_ERR_ARGUMENT, "scales");
    check_option_texts(options);
    skep_options_destroy(options);
    skep_options_destroy(NULL);
}

static void check_images(skep_scene *handed_in, const skep_image *good, const skep_camera *camera) {
    skep_image image = *good;
#define WRONG_IMAGE(field, value, word)                                                            \
    image = *good;                                                                                 \
    image.field = (value);                                                                         \
    FAILS(skep_scene_add_view(handed_in, NULL, &image, camera, OUT(uint32_t, 0)),                  \
          SKEP_ERR_ARGUMENT, word);                                                                \
    FAILS(skep_packed_image_create(&image, OUT(skep_packed_image *, 0)), SKEP_ERR_ARGUMENT, word)
    WRONG_IMAGE(width, 0, "image.width is 0");
    WRONG_IMAGE(height, 0, "image.height is 0");
    WRONG_IMAGE(width, 32769, "image.width");
    WRONG_IMAGE(height, UINT32_MAX, "image.height");
    WRONG_IMAGE(stride_bytes, 0, "stride_bytes of image.data is 0");
    WRONG_IMAGE(stride_bytes, 3 * good->width - 1, "stride_bytes");
    WRONG_IMAGE(stride_bytes, SIZE_MAX, "stride_bytes");
    WRONG_IMAGE(stride_bytes, SIZE_MAX / good->height, "stride_bytes");
    WRONG_IMAGE(format, 5, "image.format is 5");
    WRONG_IMAGE(format, 48, "image.format");
    WRONG_IMAGE(format, 64, "image.format");
    WRONG_IMAGE(format, UINT32_MAX, "image.format");
#undef WRONG_IMAGE
    image = *good;
    image.data = NULL;
    FAILS(skep_scene_add_view(handed_in, NULL, &image, camera, OUT(uint32_t, 0)), SKEP_ERR_NULL,
          "image.data");
    const float not_numbers[4] = {0.5f, 0.5f, 0.5f, NAN};
    const skep_image nan = {not_numbers, 2, 2, 8, SKEP_FORMAT_GRAY + SKEP_FORMAT_FLOAT};
    FAILS(skep_scene_add_view(handed_in, NULL, &nan, camera, NULL), SKEP_ERR_ARGUMENT,
          "column 1, row 1");
    /* Pixels of 0 to 255, and of an image from which the mean was subtracted. */
    static const struct {
        float value;
        const char *text;
    } OUTSIDE[] = {{254, "row 0 is 254"},       {1.01f, "row 0 is 1.01"}, {-0.5f, "row 0 is -0.5"},
                   {INFINITY, "row 0 is inf"}, {-1e30f, "scale by"}};
    for (size_t i = 0; i < sizeof OUTSIDE / sizeof *OUTSIDE; ++i) {
        const float outside[4] = {0.5f, OUTSIDE[i].value, 0.5f, 0.5f};
        const skep_image wrong = {outside, 2, 2, 8, SKEP_FORMAT_GRAY + SKEP_FORMAT_FLOAT};
        FAILS(skep_scene_add_view(handed_in, NULL, &wrong, camera, NULL), SKEP_ERR_ARGUMENT,
              OUTSIDE[i].text);
    }
}

static void check_cameras(skep_scene *handed_in, const skep_image *image, const skep_camera *good) {
    static const double NUMBERS[] = {NAN, INFINITY, -INFINITY};
    skep_camera camera;
#define WRONG_CAMERA(field, value, word)                                                           \
    camera = *good;                                                                                \
    camera.field = (value);                                                                        \
    FAILS(skep_scene_add_view(handed_in, NULL, image, &camera, OUT(uint32_t, 0)),                  \
          SKEP_ERR_ARGUMENT, word)
    for (size_t i = 0; i < 3; ++i) {
        WRONG_CAMERA(fx, NUMBERS[i], "camera.fx");
        WRONG_CAMERA(fy, NUMBERS[i], "camera.fy");
        WRONG_CAMERA(cx, NUMBERS[i], "camera.cx");
        WRONG_CAMERA(cy, NUMBERS[i], "camera.cy");
        WRONG_CAMERA(translation[i], NUMBERS[i], "camera.translation");
        WRONG_CAMERA(rotation[4 * i], NUMBERS[i], "camera.rotation");
    }
    WRONG_CAMERA(fx, 0, "camera.fx is 0");
    WRONG_CAMERA(fy, -5, "camera.fy is -5");
    WRONG_CAMERA(rotation[0], 0.5, "camera.rotation");
    WRONG_CAMERA(rotation[1], 0.01 + good->rotation[1], "camera.rotation");
#undef WRONG_CAMERA
    camera = *good;
    for (int i = 0; i < 9; ++i) {
        camera.rotation[i] = -camera.rotation[i];
    }
    FAILS(skep_scene_add_view(handed_in, NULL, image, &camera, NULL), SKEP_ERR_ARGUMENT,
          "camera.rotation");
    memset(camera.rotation, 0, sizeof camera.rotation);
    FAILS(skep_scene_add_view(handed_in, NULL, image, &camera, NULL), SKEP_ERR_ARGUMENT,
          "camera.rotation");
}

/* Everything that changes a scene, with a scene of two views. */
static void check_changes(skep_scene *handed_in, const skep_image *image,
                          const skep_camera *camera) {
    const uint8_t mask[4] = {1, 1, 1, 1};
    const uint32_t one = 1, two = 2;
    const double at[3] = {0, 0, 4}, nan[3] = {0, NAN, 4};
    FAILS(skep_scene_add_view(NULL, NULL, image, camera, OUT(uint32_t, 0)), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_add_view(handed_in, NULL, NULL, camera, OUT(uint32_t, 0)), SKEP_ERR_NULL,
          "image");
    FAILS(skep_scene_add_view(handed_in, NULL, image, NULL, OUT(uint32_t, 0)), SKEP_ERR_NULL,
          "camera");
    FAILS(skep_scene_add_view(handed_in, "view0001.png", image, camera, OUT(uint32_t, 0)),
          SKEP_ERR_ARGUMENT, "view0001.png again");
    FAILS(skep_scene_add_view(handed_in, "\x80", image, camera, OUT(uint32_t, 0)),
          SKEP_ERR_ARGUMENT, "name");
    FAILS(skep_scene_set_mask(NULL, 0, mask, image->width), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_set_mask(handed_in, 2, mask, image->width), SKEP_ERR_ARGUMENT, "view is 2");
    FAILS(skep_scene_set_mask(handed_in, 0, mask, image->width - 1), SKEP_ERR_ARGUMENT,
          "stride_bytes of mask");
    FAILS(skep_scene_set_mask(handed_in, 0, mask, SIZE_MAX / 2), SKEP_ERR_ARGUMENT,
          "stride_bytes of mask");
    FAILS(skep_scene_set_mask(handed_in, UINT32_MAX, NULL, 0), SKEP_ERR_ARGUMENT, "view");
    FAILS(skep_scene_set_depth_range(NULL, 0, 1, 2), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_set_depth_range(handed_in, 2, 1, 2), SKEP_ERR_ARGUMENT, "view is 2");
    const double ranges[][2] = {{2, 1},     {1, 1},    {-1, 2},  {0, 2},
                                {1, 0},     {NAN, 2},  {1, NAN}, {1, INFINITY},
                                {1e-50, 1}, {1, 1e50}, {-2, -1}, {NAN, NAN}};
    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; ++i) {
        FAILS(skep_scene_set_depth_range(handed_in, 0, ranges[i][0], ranges[i][1]),
              SKEP_ERR_ARGUMENT, "near");
    }
    FAILS(skep_scene_set_sources(NULL, 0, &one, 1), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_set_sources(handed_in, 7, &one, 1), SKEP_ERR_ARGUMENT, "view is 7");
    FAILS(skep_scene_set_sources(handed_in, 0, NULL, 1), SKEP_ERR_NULL, "sources");
    FAILS(skep_scene_set_sources(handed_in, 0, &one, SIZE_MAX), SKEP_ERR_ARGUMENT, "sources");
    FAILS(skep_scene_add_points(NULL, at, 1, &one, &one, 1), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_add_points(handed_in, NULL, 1, &one, &one, 1), SKEP_ERR_NULL, "positions");
    FAILS(skep_scene_add_points(handed_in, at, 1, NULL, &one, 1), SKEP_ERR_NULL, "view_counts");
    FAILS(skep_scene_add_points(handed_in, at, 1, &one, NULL, 1), SKEP_ERR_NULL, "views");
    FAILS(skep_scene_add_points(handed_in, nan, 1, &one, &one, 1), SKEP_ERR_ARGUMENT,
          "positions[0]");
    FAILS(skep_scene_add_points(handed_in, at, 1, &two, &one, 1), SKEP_ERR_ARGUMENT,
          "view_counts[0] is 2");
    FAILS(skep_scene_add_points(handed_in, at, 1, &one, &one, 0), SKEP_ERR_ARGUMENT,
          "view_counts[0]");
    FAILS(skep_scene_add_points(handed_in, NULL, 0, NULL, &one, 1), SKEP_ERR_ARGUMENT,
          "view_total is 1");
    FAILS(skep_scene_add_points(handed_in, at, SIZE_MAX, &one, &one, 1), SKEP_ERR_ARGUMENT,
          "positions");
    FAILS(skep_scene_add_points(handed_in, at, 1, &one, &one, SIZE_MAX), SKEP_ERR_ARGUMENT,
          "views");
    REQUIRE(skep_scene_add_points(handed_in, NULL, 0, NULL, NULL, 0));
    REQUIRE(skep_scene_validate(handed_in));
}

static void check_questions(skep_scene *handed_in) {
    FAILS(skep_scene_validate(NULL), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_copy(NULL, OUT(skep_scene *, 0)), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_copy(handed_in, NULL), SKEP_ERR_NULL, "scene_out");
    FAILS(skep_scene_get_warning(NULL, 0, OUT(char, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_get_warning(handed_in, 99, OUT(char, 0), 9, OUT(size_t, 1)),
          SKEP_ERR_ARGUMENT, "index is 99");
    FAILS(skep_scene_get_view_count(NULL, OUT(uint32_t, 0)), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_get_view_count(handed_in, NULL), SKEP_ERR_NULL, "count_out");
    FAILS(skep_scene_get_view(NULL, 0, OUT(uint32_t, 0), OUT(uint32_t, 1), OUT(skep_camera, 2)),
          SKEP_ERR_NULL, "scene");
    FAILS(
        skep_scene_get_view(handed_in, 2, OUT(uint32_t, 0), OUT(uint32_t, 1), OUT(skep_camera, 2)),
        SKEP_ERR_ARGUMENT, "view is 2");
    FAILS(skep_scene_get_name(NULL, 0, OUT(char, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_get_name(handed_in, 2, OUT(char, 0), 9, OUT(size_t, 1)), SKEP_ERR_ARGUMENT,
          "view is 2");
    FAILS(skep_scene_get_depth_range(NULL, 0, OUT(double, 0), OUT(double, 1)), SKEP_ERR_NULL,
          "scene");
    FAILS(skep_scene_get_depth_range(handed_in, 0, NULL, OUT(double, 1)), SKEP_ERR_NULL,
          "near_out");
    FAILS(skep_scene_get_depth_range(handed_in, 0, OUT(double, 0), NULL), SKEP_ERR_NULL, "far_out");
    FAILS(skep_scene_get_depth_range(handed_in, 9, OUT(double, 0), OUT(double, 1)),
          SKEP_ERR_ARGUMENT, "view is 9");
    FAILS(skep_scene_get_sources(NULL, NULL, 0, OUT(uint32_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "scene");
    FAILS(skep_scene_get_sources(handed_in, NULL, 2, OUT(uint32_t, 0), 9, OUT(size_t, 1)),
          SKEP_ERR_ARGUMENT, "view is 2");
    FAILS(skep_scene_get_sources(handed_in, NULL, 0, OUT(uint32_t, 0), 0, OUT(size_t, 1)),
          SKEP_ERR_CAPACITY, "sources");
    FAILS(skep_scene_get_sources(handed_in, NULL, 0, OUT(uint32_t, 0), 9, NULL), SKEP_ERR_NULL,
          "count_out");
    FAILS(skep_scene_get_overlap(NULL, 0, OUT(uint32_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "scene");
    FAILS(skep_scene_get_overlap(handed_in, 2, OUT(uint32_t, 0), 9, OUT(size_t, 1)),
          SKEP_ERR_ARGUMENT, "view is 2");
    FAILS(skep_scene_get_overlap(handed_in, 0, OUT(uint32_t, 0), 0, OUT(size_t, 1)),
          SKEP_ERR_CAPACITY, "views");
    FAILS(skep_scene_get_overlap(handed_in, 0, OUT(uint32_t, 0), 9, NULL), SKEP_ERR_NULL,
          "count_out");
    FAILS(skep_scene_get_triangulation_angle(NULL, 0, 1, OUT(double, 0)), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_get_triangulation_angle(handed_in, 0, 1, NULL), SKEP_ERR_NULL, "degrees_out");
    FAILS(skep_scene_get_triangulation_angle(handed_in, 1, 1, OUT(double, 0)), SKEP_ERR_ARGUMENT,
          "source is 1");
    FAILS(skep_scene_get_triangulation_angle(handed_in, 2, 1, OUT(double, 0)), SKEP_ERR_ARGUMENT,
          "view is 2");
    FAILS(skep_scene_get_triangulation_angle(handed_in, 0, 3, OUT(double, 0)), SKEP_ERR_ARGUMENT,
          "view is 3");
}

/*
 * Errors that only a complete scene has: too few views, no ranges, lists with indices of no view.
 */
static void check_whole_scenes(const scene *made, skep_scene *handed_in) {
    const uint32_t lists[][2] = {{1, 1}, {0, 1}, {1, 2}, {UINT32_MAX, 1}};
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; ++i) {
        REQUIRE(skep_scene_set_sources(handed_in, 0, lists[i], 2));
        FAILS(skep_scene_validate(handed_in), SKEP_ERR_ARGUMENT, "views[0] (view0000.png).sources");
        FAILS(skep_reconstruct(handed_in, NULL, NULL, NULL, OUT(skep_result *, 0)),
              SKEP_ERR_ARGUMENT, "sources");
        FAILS(skep_stepper_create(handed_in, NULL, OUT(skep_stepper *, 0)), SKEP_ERR_ARGUMENT,
              "sources");
        FAILS(skep_scene_get_sources(handed_in, NULL, 0, OUT(uint32_t, 0), 9, OUT(size_t, 1)),
              SKEP_ERR_ARGUMENT, "sources");
    }
    REQUIRE(skep_scene_set_sources(handed_in, 0, NULL, 0));
    REQUIRE(skep_scene_set_depth_range(handed_in, 1, 0, 0));
    FAILS(skep_scene_validate(handed_in), SKEP_ERR_ARGUMENT, "depth range of view0001.png");
    FAILS(skep_reconstruct(handed_in, NULL, NULL, NULL, OUT(skep_result *, 0)), SKEP_ERR_ARGUMENT,
          "depth range");
    REQUIRE(skep_scene_set_depth_range(handed_in, 1, SCENE_NEAR, SCENE_FAR));
    REQUIRE(skep_scene_validate(handed_in));
    const double at[3] = {0, 0, 4};
    const uint32_t one = 1, two = 2;
    REQUIRE(skep_scene_add_points(handed_in, at, 1, &one, &two, 1));
    FAILS(skep_scene_validate(handed_in), SKEP_ERR_ARGUMENT, "points[0].views is 2");
    const skep_image image = scene_image(made, 2);
    REQUIRE(skep_scene_add_view(handed_in, NULL, &image, &made->photographs[2].camera, NULL));
    REQUIRE(skep_scene_validate(handed_in));
}

void test_misuse_scene(const char *folder) {
    (void)folder;
    check_texts();
    check_options();
    scene made;
    scene_make(&made);
    const skep_image image = scene_image(&made, 0);
    const skep_camera *camera = &made.photographs[0].camera;
    skep_scene *handed_in = NULL;
    REQUIRE(skep_scene_create(&handed_in));
    skep_scene_destroy(NULL);
    FAILS(skep_scene_validate(handed_in), SKEP_ERR_ARGUMENT, "views is 0");
    REQUIRE(skep_scene_add_view(handed_in, NULL, &image, camera, NULL));
    FAILS(skep_scene_validate(handed_in), SKEP_ERR_ARGUMENT, "views is 1");
    FAILS(skep_reconstruct(handed_in, NULL, NULL, NULL, OUT(skep_result *, 0)), SKEP_ERR_ARGUMENT,
          "views is 1");
    check_images(handed_in, &image, camera);
    check_cameras(handed_in, &image, camera);
    REQUIRE(skep_scene_add_view(handed_in, NULL, &image, &made.photographs[1].camera, NULL));
    REQUIRE(skep_scene_set_depth_range(handed_in, 0, SCENE_NEAR, SCENE_FAR));
    REQUIRE(skep_scene_set_depth_range(handed_in, 1, SCENE_NEAR, SCENE_FAR));
    check_changes(handed_in, &image, camera);
    check_questions(handed_in);
    check_whole_scenes(&made, handed_in);
    /* After all that was refused, the scene works. */
    skep_options *options = quick_options();
    REQUIRE(skep_scene_set_depth_range(handed_in, 2, SCENE_NEAR, SCENE_FAR));
    skep_result *result = scene_run(handed_in, options);
    skep_result_destroy(result);
    skep_options_destroy(options);
    skep_scene_destroy(handed_in);
    scene_free(&made);
}
