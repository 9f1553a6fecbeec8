/*
 * Errors of runs, results, clouds and fusion: the status, the argument's name, and nothing written.
 */
#include "support/check.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdlib.h>

static void check_runs(const skep_scene *handed_in) {
    skep_options *options = NULL;
    REQUIRE(skep_options_create(NULL, &options));
    FAILS(skep_reconstruct(NULL, options, NULL, NULL, OUT(skep_result *, 0)), SKEP_ERR_NULL,
          "scene");
    FAILS(skep_reconstruct(handed_in, options, NULL, NULL, NULL), SKEP_ERR_NULL, "result_out");
    /* Options that are right alone and wrong together. */
    REQUIRE(skep_options_set(options, "min_triangulation_angle", 90));
    FAILS(skep_reconstruct(handed_in, options, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "max_triangulation_angle");
    FAILS(skep_stepper_create(handed_in, options, OUT(skep_stepper *, 0)), SKEP_ERR_ARGUMENT,
          "triangulation_angle");
    REQUIRE(skep_options_set(options, "min_triangulation_angle", 4));
    REQUIRE(skep_options_set(options, "max_views_per_pixel", 1));
    FAILS(skep_reconstruct(handed_in, options, NULL, NULL, OUT(skep_result *, 0)),
          SKEP_ERR_ARGUMENT, "max_views_per_pixel");
    FAILS(skep_fuse(NULL, 0, options, NULL, NULL, OUT(skep_cloud *, 0)), SKEP_ERR_ARGUMENT,
          "max_views_per_pixel");
    skep_options_destroy(options);
}

/* The functions that copy a map out of a result. */
typedef skep_status get_map(const skep_result *result, uint32_t view, void *out,
                            size_t stride_bytes);

static skep_status get_depth(const skep_result *result, uint32_t view, void *out,
                             size_t stride_bytes) {
    return skep_result_get_depth(result, view, SKEP_MAPS_RAW, out, stride_bytes);
}

static skep_status get_normal(const skep_result *result, uint32_t view, void *out,
                              size_t stride_bytes) {
    return skep_result_get_normal(result, view, SKEP_MAPS_VALIDATED, out, stride_bytes);
}

static skep_status get_cost(const skep_result *result, uint32_t view, void *out,
                            size_t stride_bytes) {
    return skep_result_get_cost(result, view, out, stride_bytes);
}

static skep_status get_status(const skep_result *result, uint32_t view, void *out,
                              size_t stride_bytes) {
    return skep_result_get_status(result, view, out, stride_bytes);
}

static skep_status get_count(const skep_result *result, uint32_t view, void *out,
                             size_t stride_bytes) {
    return skep_result_get_source_count(result, view, out, stride_bytes);
}

static skep_status get_bits(const skep_result *result, uint32_t view, void *out,
                            size_t stride_bytes) {
    return skep_result_get_source_bits(result, view, 0, out, stride_bytes);
}

static void check_maps(const scene *made, const skep_result *result) {
    static const struct {
        get_map *get;
        size_t size;
    } MAPS[] = {{get_depth, 4},  {get_normal, 12}, {get_cost, 4},
                {get_status, 1}, {get_count, 2},   {get_bits, 4}};
    void *out = OUT(char, 0);
    for (size_t i = 0; i < sizeof MAPS / sizeof MAPS[0]; ++i) {
        const size_t row = MAPS[i].size * made->width;
        FAILS(MAPS[i].get(NULL, 0, out, row), SKEP_ERR_NULL, "result");
        FAILS(MAPS[i].get(result, 0, NULL, row), SKEP_ERR_NULL, "out");
        FAILS(MAPS[i].get(result, made->views, out, row), SKEP_ERR_ARGUMENT, "view");
        FAILS(MAPS[i].get(result, UINT32_MAX, out, row), SKEP_ERR_ARGUMENT, "view is 4294967295");
        FAILS(MAPS[i].get(result, 0, out, row - 1), SKEP_ERR_ARGUMENT, "stride_bytes of out");
        FAILS(MAPS[i].get(result, 0, out, 0), SKEP_ERR_ARGUMENT, "stride_bytes of out is 0");
        FAILS(MAPS[i].get(result, 0, out, SIZE_MAX), SKEP_ERR_ARGUMENT, "stride_bytes");
        FAILS(MAPS[i].get(result, 0, out, SIZE_MAX / 4), SKEP_ERR_ARGUMENT, "stride_bytes");
    }
    FAILS(skep_result_get_depth(result, 0, 2, out, 4 * made->width), SKEP_ERR_ARGUMENT,
          "which is 2");
    FAILS(skep_result_get_normal(result, 0, UINT32_MAX, out, 12 * made->width), SKEP_ERR_ARGUMENT,
          "which");
    FAILS(skep_result_get_source_bits(result, 0, 1, out, 4 * made->width), SKEP_ERR_ARGUMENT,
          "word is 1");
    FAILS(skep_result_get_source_bits(result, 0, UINT32_MAX, out, 4 * made->width),
          SKEP_ERR_ARGUMENT, "word");
}

static void check_results(const skep_result *result) {
    FAILS(skep_result_get_views(NULL, OUT(uint32_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "result");
    FAILS(skep_result_get_views(result, NULL, 0, NULL), SKEP_ERR_NULL, "count_out");
    FAILS(skep_result_get_views(result, OUT(uint32_t, 0), 1, OUT(size_t, 1)), SKEP_ERR_CAPACITY,
          "views");
    FAILS(skep_result_get_cloud(NULL, OUT(skep_cloud *, 0)), SKEP_ERR_NULL, "result");
    FAILS(skep_result_get_cloud(result, NULL), SKEP_ERR_NULL, "cloud_out");
    FAILS(skep_result_get_warning(NULL, 0, OUT(char, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "result");
    FAILS(skep_result_get_warning(result, 99, OUT(char, 0), 9, OUT(size_t, 1)), SKEP_ERR_ARGUMENT,
          "index is 99");
    FAILS(skep_result_get_sources(NULL, 0, OUT(uint32_t, 0), 9, OUT(size_t, 1)), SKEP_ERR_NULL,
          "result");
    FAILS(skep_result_get_sources(result, 9, OUT(uint32_t, 0), 9, OUT(size_t, 1)),
          SKEP_ERR_ARGUMENT, "view is 9");
    FAILS(skep_result_get_sources(result, 0, OUT(uint32_t, 0), 1, OUT(size_t, 1)),
          SKEP_ERR_CAPACITY, "sources");
    FAILS(skep_result_get_sources(result, 0, OUT(uint32_t, 0), 9, NULL), SKEP_ERR_NULL,
          "count_out");
    FAILS(skep_result_get_size(NULL, 0, OUT(uint32_t, 0), OUT(uint32_t, 1)), SKEP_ERR_NULL,
          "result");
    FAILS(skep_result_get_size(result, 0, NULL, OUT(uint32_t, 1)), SKEP_ERR_NULL, "width_out");
    FAILS(skep_result_get_size(result, 0, OUT(uint32_t, 0), NULL), SKEP_ERR_NULL, "height_out");
    FAILS(skep_result_get_size(result, 9, OUT(uint32_t, 0), OUT(uint32_t, 1)), SKEP_ERR_ARGUMENT,
          "view is 9");
    FAILS(skep_result_get_statistics(NULL, 0, OUT(skep_statistics, 0)), SKEP_ERR_NULL, "result");
    FAILS(skep_result_get_statistics(result, 0, NULL), SKEP_ERR_NULL, "statistics_out");
    FAILS(skep_result_get_statistics(result, 9, OUT(skep_statistics, 0)), SKEP_ERR_ARGUMENT,
          "view is 9");
    FAILS(skep_result_get_cycles(NULL, 0, OUT(skep_cycle_record, 0), 9, OUT(size_t, 2)),
          SKEP_ERR_NULL, "result");
    FAILS(skep_result_get_cycles(result, 9, OUT(skep_cycle_record, 0), 9, OUT(size_t, 2)),
          SKEP_ERR_ARGUMENT, "view is 9");
    FAILS(skep_result_get_cycles(result, 0, OUT(skep_cycle_record, 0), 1, OUT(size_t, 2)),
          SKEP_ERR_CAPACITY, "cycles");
    FAILS(skep_result_get_cycles(result, 0, OUT(skep_cycle_record, 0), 9, NULL), SKEP_ERR_NULL,
          "count_out");
    FAILS(skep_result_borrow_depth(NULL, 0, OUT(const float *, 0)), SKEP_ERR_NULL, "result");
    FAILS(skep_result_borrow_depth(result, 0, NULL), SKEP_ERR_NULL, "depth_out");
    FAILS(skep_result_borrow_depth(result, 9, OUT(const float *, 0)), SKEP_ERR_ARGUMENT,
          "view is 9");
    FAILS(skep_result_borrow_normal(NULL, 0, OUT(const float *, 0)), SKEP_ERR_NULL, "result");
    FAILS(skep_result_borrow_normal(result, 0, NULL), SKEP_ERR_NULL, "normal_out");
    FAILS(skep_result_borrow_normal(result, 9, OUT(const float *, 0)), SKEP_ERR_ARGUMENT,
          "view is 9");
    FAILS(skep_result_borrow_cost(NULL, 0, OUT(const float *, 0)), SKEP_ERR_NULL, "result");
    FAILS(skep_result_borrow_cost(result, 0, NULL), SKEP_ERR_NULL, "cost_out");
    FAILS(skep_result_borrow_cost(result, 9, OUT(const float *, 0)), SKEP_ERR_ARGUMENT,
          "view is 9");
    FAILS(skep_result_borrow_status(NULL, 0, OUT(const uint8_t *, 0)), SKEP_ERR_NULL, "result");
    FAILS(skep_result_borrow_status(result, 0, NULL), SKEP_ERR_NULL, "status_out");
    FAILS(skep_result_borrow_status(result, 9, OUT(const uint8_t *, 0)), SKEP_ERR_ARGUMENT,
          "view is 9");
}

static void check_clouds(const skep_result *result) {
    skep_cloud *cloud = NULL;
    REQUIRE(skep_result_get_cloud(result, &cloud));
    size_t count = 0, total = 0;
    REQUIRE(skep_cloud_get_count(cloud, &count, &total));
    CHECK(count > 20 && total > count, "%zu points", count);
    FAILS(skep_cloud_get_count(NULL, OUT(size_t, 0), OUT(size_t, 1)), SKEP_ERR_NULL, "cloud");
    FAILS(skep_cloud_get_count(cloud, NULL, OUT(size_t, 1)), SKEP_ERR_NULL, "count_out");
    FAILS(skep_cloud_get_points(NULL, OUT(double, 0), OUT(float, 1), OUT(uint8_t, 2), count),
          SKEP_ERR_NULL, "cloud");
    const size_t less = count - 1;
    FAILS(skep_cloud_get_points(cloud, OUT(double, 0), OUT(float, 1), OUT(uint8_t, 2), less),
          SKEP_ERR_CAPACITY, "positions");
    FAILS(skep_cloud_get_points(cloud, NULL, OUT(float, 1), OUT(uint8_t, 2), less),
          SKEP_ERR_CAPACITY, "normals");
    FAILS(skep_cloud_get_points(cloud, NULL, NULL, OUT(uint8_t, 2), 0), SKEP_ERR_CAPACITY,
          "colors");
    REQUIRE(skep_cloud_get_points(cloud, NULL, NULL, NULL, 0));
    FAILS(skep_cloud_get_views(NULL, OUT(uint32_t, 0), count, OUT(uint32_t, 1), total),
          SKEP_ERR_NULL, "cloud");
    FAILS(skep_cloud_get_views(cloud, OUT(uint32_t, 0), less, OUT(uint32_t, 1), total),
          SKEP_ERR_CAPACITY, "view_counts");
    FAILS(skep_cloud_get_views(cloud, OUT(uint32_t, 0), count, OUT(uint32_t, 1), total - 1),
          SKEP_ERR_CAPACITY, "views");
    REQUIRE(skep_cloud_get_views(cloud, NULL, 0, NULL, 0));
    skep_cloud_destroy(cloud);
    skep_cloud_destroy(NULL);
    skep_result_destroy(NULL);
}

static void check_fusion(const scene *made) {
    static const uint32_t OTHER[] = {1, 0}, OWN[] = {0}, TWICE[] = {1, 1}, UNKNOWN[] = {2};
    skep_fusion_view good[2], views[2];
    for (uint32_t view = 0; view < 2; ++view) {
        const photograph *truth = &made->photographs[view];
        good[view] = (skep_fusion_view){&truth->camera,
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
    FAILS(skep_fuse(NULL, 2, NULL, NULL, NULL, OUT(skep_cloud *, 0)), SKEP_ERR_NULL, "views");
    FAILS(skep_fuse(good, 2, NULL, NULL, NULL, NULL), SKEP_ERR_NULL, "cloud_out");
    FAILS(skep_fuse(good, SIZE_MAX, NULL, NULL, NULL, OUT(skep_cloud *, 0)), SKEP_ERR_ARGUMENT,
          "views");
    FAILS(skep_fuse(good, 1, NULL, NULL, NULL, OUT(skep_cloud *, 0)), SKEP_ERR_ARGUMENT,
          "views[0].overlap[0] is 1");
    skep_image wrong_size = scene_image(made, 0), no_format = wrong_size, no_data = wrong_size;
    wrong_size.width -= 1;
    no_format.format = 77;
    no_data.data = NULL;
    skep_camera no_focus = made->photographs[1].camera;
    no_focus.fx = 0;
#define WRONG_VIEW(field, value, status, word)                                                     \
    views[0] = good[0];                                                                            \
    views[1] = good[1];                                                                            \
    views[1].field = (value);                                                                      \
    FAILS(skep_fuse(views, 2, NULL, NULL, NULL, OUT(skep_cloud *, 0)), status, word)
    WRONG_VIEW(camera, NULL, SKEP_ERR_NULL, "views[1].camera");
    WRONG_VIEW(camera, &no_focus, SKEP_ERR_ARGUMENT, "views[1].camera.fx");
    WRONG_VIEW(width, 0, SKEP_ERR_ARGUMENT, "views[1].width is 0");
    WRONG_VIEW(height, 40000, SKEP_ERR_ARGUMENT, "views[1].height");
    WRONG_VIEW(depth, NULL, SKEP_ERR_NULL, "views[1].depth");
    WRONG_VIEW(normal, NULL, SKEP_ERR_NULL, "views[1].normal");
    WRONG_VIEW(depth_stride_bytes, 4 * made->width - 1, SKEP_ERR_ARGUMENT,
               "stride_bytes of views[1].depth");
    WRONG_VIEW(normal_stride_bytes, 12 * made->width - 1, SKEP_ERR_ARGUMENT,
               "stride_bytes of views[1].normal");
    WRONG_VIEW(normal_stride_bytes, SIZE_MAX, SKEP_ERR_ARGUMENT, "stride_bytes of views[1].normal");
    WRONG_VIEW(image_or_null, &wrong_size, SKEP_ERR_ARGUMENT, "views[1].image");
    WRONG_VIEW(image_or_null, &no_format, SKEP_ERR_ARGUMENT, "views[1].image.format");
    WRONG_VIEW(image_or_null, &no_data, SKEP_ERR_NULL, "views[1].image.data");
    WRONG_VIEW(overlap, NULL, SKEP_ERR_NULL, "views[1].overlap");
    WRONG_VIEW(overlap, UNKNOWN, SKEP_ERR_ARGUMENT, "views[1].overlap[0] is 2");
    WRONG_VIEW(overlap, OTHER, SKEP_ERR_ARGUMENT, "views[1].overlap[0] is 1");
    WRONG_VIEW(overlap_count, SIZE_MAX, SKEP_ERR_ARGUMENT, "views[1].overlap");
#undef WRONG_VIEW
    views[0] = good[0];
    views[1] = good[1];
    views[0].overlap = TWICE;
    views[0].overlap_count = 2;
    FAILS(skep_fuse(views, 2, NULL, NULL, NULL, OUT(skep_cloud *, 0)), SKEP_ERR_ARGUMENT,
          "views[0].overlap[1]");
    views[0].overlap = OWN;
    views[0].overlap_count = 1;
    FAILS(skep_fuse(views, 2, NULL, NULL, NULL, OUT(skep_cloud *, 0)), SKEP_ERR_ARGUMENT,
          "views[0].overlap[0]");
    skep_cloud *cloud = NULL;
    size_t count = 9, total = 9;
    REQUIRE(skep_fuse(NULL, 0, NULL, NULL, NULL, &cloud));
    REQUIRE(skep_cloud_get_count(cloud, &count, &total));
    CHECK(count == 0 && total == 0, "%zu points of no views", count);
    skep_cloud_destroy(cloud);
}

/* Any bits may be in the maps that are fused. */
static void check_garbled_maps(const scene *made) {
    static const uint32_t OTHER[] = {1, 0};
    static const float VALUES[] = {0,      -1,    INFINITY, -INFINITY, NAN,
                                   1e-45f, 3e38f, 4,        1e-20f,    1e20f};
    const size_t pixels = scene_pixels(made);
    float *depth = take(pixels, sizeof *depth), *normal = take(pixels, 3 * sizeof *normal);
    for (size_t i = 0; i < pixels; ++i) {
        depth[i] = VALUES[i % 10];
        for (size_t axis = 0; axis < 3; ++axis) {
            normal[3 * i + axis] = VALUES[(i / 10 + axis * i) % 10];
        }
    }
    skep_fusion_view views[2];
    for (uint32_t view = 0; view < 2; ++view) {
        views[view] = (skep_fusion_view){&made->photographs[view].camera,
                                         made->width,
                                         made->height,
                                         depth,
                                         4 * (size_t)made->width,
                                         normal,
                                         12 * (size_t)made->width,
                                         NULL,
                                         &OTHER[view],
                                         1,
                                         NULL,
                                         0};
    }
    skep_options *options = quick_options();
    REQUIRE(skep_options_set(options, "fusion.min_agreeing_views", 0));
    skep_cloud *cloud = NULL;
    REQUIRE(skep_fuse(views, 2, options, NULL, NULL, &cloud));
    points all = points_of(cloud);
    for (size_t i = 0; i < all.count; ++i) {
        for (size_t axis = 0; axis < 3; ++axis) {
            CHECK(isfinite(all.positions[3 * i + axis]) && isfinite(all.normals[3 * i + axis]),
                  "point %zu", i);
        }
    }
    points_free(&all);
    skep_cloud_destroy(cloud);
    skep_options_destroy(options);
    free(normal);
    free(depth);
}

void test_misuse_run(const char *folder) {
    (void)folder;
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    if (scene_is_small()) {
        /* Enough points to misuse take a cycle more at full size. */
        REQUIRE(skep_options_set_text(options, "schedule.scales",
                                      "downscale=2 food_sources=4 iterations=5+1x1; "
                                      "downscale=1 food_sources=3 iterations=1+2x1"));
    }
    skep_scene *handed_in = scene_hand_in(&made);
    skep_result *result = scene_run(handed_in, options);
    check_runs(handed_in);
    check_maps(&made, result);
    check_results(result);
    check_clouds(result);
    check_fusion(&made);
    check_garbled_maps(&made);
    skep_result *again = scene_run(handed_in, options);
    check_same_results(result, again, made.views, "after all that was refused");
    skep_result_destroy(again);
    skep_result_destroy(result);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
