/* What is written is read back: scenes, whole workspaces, clouds, and maps with rows apart. */
#include "support/check.h"
#include "support/disk.h"
#include "support/results.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int32_t cancel(void *calls, const skep_progress *progress) {
    CHECK(progress->phase == SKEP_PHASE_READ && progress->done >= 0 && progress->done <= 1, "%g", progress->done);
    ++*(uint32_t *)calls;
    return 1;
}

/*
 * A scene that is written as a COLMAP folder and read again gives nearly the same cameras and the
 * same runs.
 */
static skep_scene *check_scene(const char *folder, const scene *made, const skep_scene *handed_in) {
    char place[MAX_PATH];
    path_in(place, folder, "scene");
    REQUIRE(skep_scene_write_colmap(handed_in, place));
    skep_scene *read = NULL;
    uint32_t calls = 0;
    CHECK(skep_scene_read(place, NULL, 0, 0, cancel, &calls, &read) == SKEP_ERR_CANCELLED, "%u calls",
          (unsigned)calls);
    CHECK(calls == 1 && read == NULL, "%u calls", (unsigned)calls);
    REQUIRE(skep_scene_read(place, NULL, 0, 0, NULL, NULL, &read));
    for (uint32_t view = 0; view < made->views; ++view) {
        uint32_t width = 0, height = 0;
        skep_camera camera;
        char name[32];
        REQUIRE(skep_scene_get_view(read, view, &width, &height, &camera));
        REQUIRE(skep_scene_get_name(read, view, name, sizeof name, NULL));
        CHECK(width == made->width && height == made->height, "view %u", (unsigned)view);
        CHECK(strncmp(name, "view000", 7) == 0, "%s", name);
        const skep_camera *own = &made->photographs[view].camera;
        CHECK(fabs(camera.fx - own->fx) < 1e-9 && fabs(camera.cx - own->cx) < 1e-9, "view %u",
              (unsigned)view);
        CHECK(fabs(camera.fy - own->fy) < 1e-9 && fabs(camera.cy - own->cy) < 1e-9, "view %u",
              (unsigned)view);
        for (int i = 0; i < 9; ++i) {
            CHECK(fabs(camera.rotation[i] - own->rotation[i]) < 1e-12, "view %u, %d",
                  (unsigned)view, i);
        }
        for (int i = 0; i < 3; ++i) {
            CHECK(fabs(camera.translation[i] - own->translation[i]) < 1e-12, "view %u, %d",
                  (unsigned)view, i);
        }
        double ranges[4];
        REQUIRE(skep_scene_get_depth_range(read, view, &ranges[0], &ranges[1]));
        REQUIRE(skep_scene_get_depth_range(handed_in, view, &ranges[2], &ranges[3]));
        CHECK(fabs(ranges[0] - ranges[2]) < 1e-9 && fabs(ranges[1] - ranges[3]) < 1e-9,
              "the points' range");
    }
    skep_scene *ranged = NULL;
    double near_by = 0, far_away = 0;
    REQUIRE(skep_scene_read(place, NULL, 1.5, 7, NULL, NULL, &ranged));
    REQUIRE(skep_scene_get_depth_range(ranged, 1, &near_by, &far_away));
    CHECK(near_by == 1.5 && far_away == 7, "%g to %g", near_by, far_away);
    skep_scene_destroy(ranged);
    return read;
}

/* The files of a workspace hold what the result does. */
static void check_workspace(const char *folder, const scene *made, const skep_scene *read,
                            const skep_result *result) {
    static const char *const KINDS[] = {"photometric", "geometric"};
    char place[MAX_PATH], file[MAX_PATH], name[64];
    path_in(place, folder, "scene");
    REQUIRE(skep_result_write_workspace(result, read, place));
    const size_t pixels = scene_pixels(made);
    float *depth = take(pixels, sizeof *depth), *normal = take(pixels, 3 * sizeof *normal);
    uint32_t *counts = take(pixels, sizeof *counts),
             *views = take(pixels * MAX_VIEWS, sizeof *views);
    for (uint32_t view = 0; view < made->views; ++view) {
        view_maps maps = maps_of(result, view);
        for (uint32_t which = SKEP_MAPS_RAW; which <= SKEP_MAPS_VALIDATED; ++which) {
            uint32_t width = 0, height = 0;
            size_t total = 0, next = 0;
            snprintf(name, sizeof name, "stereo/depth_maps/view%04u.png.%s.bin", (unsigned)view,
                     KINDS[which]);
            path_in(file, place, name);
            REQUIRE(skep_read_depth_map(file, depth, pixels, &width, &height));
            CHECK(width == made->width && same_bytes(depth, maps.depth[which], 4 * pixels), "%s",
                  name);
            snprintf(name, sizeof name, "stereo/normal_maps/view%04u.png.%s.bin", (unsigned)view,
                     KINDS[which]);
            path_in(file, place, name);
            REQUIRE(skep_read_normal_map(file, normal, 3 * pixels, &width, &height));
            CHECK(height == made->height && same_bytes(normal, maps.normal[which], 12 * pixels),
                  "%s", name);
            snprintf(name, sizeof name, "stereo/consistency_graphs/view%04u.png.%s.bin",
                     (unsigned)view, KINDS[which]);
            path_in(file, place, name);
            REQUIRE(skep_read_consistency_graph(file, counts, pixels, views, pixels * MAX_VIEWS,
                                                &width, &height, &total));
            for (size_t i = 0; i < pixels; ++i) {
                const uint32_t expected = maps.depth[which][i] > 0 ? maps.source_count[i] : 0;
                CHECK(counts[i] == expected, "%s: pixel %zu has %u", name, i, (unsigned)counts[i]);
                for (uint32_t bit = 0; expected && bit < maps.source_total; ++bit) {
                    if (maps.source_bits[i] >> bit & 1) {
                        CHECK(views[next] == maps.sources[bit], "%s: pixel %zu", name, i);
                        ++next;
                    }
                }
            }
            CHECK(next == total, "%s: %zu of %zu", name, next, total);
        }
        maps_free(&maps);
    }
    static const char *const OTHERS[] = {"stereo/fusion.cfg",
                                         "stereo/patch-match.cfg",
                                         "preview/view0000.png.depth.png",
                                         "preview/view0001.png.normal.png",
                                         "preview/view0002.png.views.png",
                                         "fused.ply",
                                         "fused.ply.vis"};
    for (size_t i = 0; i < sizeof OTHERS / sizeof OTHERS[0]; ++i) {
        path_in(file, place, OTHERS[i]);
        CHECK(file_size(file) > 0, "%s", file);
    }
    free(views);
    free(counts);
    free(normal);
    free(depth);
}

/* A binary PLY of so many points, with as many view lists beside it. */
static void check_ply(const char *folder, const skep_result *result) {
    char file[MAX_PATH], beside[MAX_PATH];
    path_in(file, folder, "new folder/cloud.ply");
    path_in(beside, folder, "new folder/cloud.ply.vis");
    skep_cloud *cloud = NULL;
    REQUIRE(skep_result_get_cloud(result, &cloud));
    REQUIRE(skep_cloud_write_ply(cloud, file));
    points all = points_of(cloud);
    size_t size = 0;
    uint8_t *bytes = read_file(file, &size);
    static const char END[] = "end_header\n";
    size_t header = 0;
    while (header + sizeof END - 1 < size && memcmp(bytes + header, END, sizeof END - 1) != 0) {
        ++header;
    }
    header += sizeof END - 1;
    char announced[64];
    snprintf(announced, sizeof announced, "element vertex %zu\n", all.count);
    bytes[header - 1] = 0;
    CHECK(strstr((const char *)bytes, announced) != NULL, "%s", (const char *)bytes);
    if (CHECK(size == header + 27 * all.count, "%zu bytes of %zu points", size - header,
              all.count)) {
        for (size_t i = 0; i < all.count; ++i) {
            float numbers[6];
            memcpy(numbers, bytes + header + 27 * i, sizeof numbers);
            for (int axis = 0; axis < 3; ++axis) {
                CHECK(numbers[axis] == (float)all.positions[3 * i + axis], "point %zu", i);
            }
            CHECK(same_bytes(numbers + 3, all.normals + 3 * i, 12), "point %zu", i);
            CHECK(same_bytes(bytes + header + 27 * i + 24, all.colors + 3 * i, 3), "point %zu", i);
        }
    }
    CHECK(file_size(beside) == 8 + 4 * (all.count + all.view_total), "%zu bytes",
          file_size(beside));
    free(bytes);
    points_free(&all);
    skep_cloud_destroy(cloud);
}

/*
 * Maps of any numbers with gaps between rows, and a graph whose pixels have none, one or all views.
 */
static void check_maps(const char *folder) {
    enum { WIDTH = 5, HEIGHT = 3, GAP = 2, PIXELS = WIDTH * HEIGHT };
    char file[MAX_PATH];
    float depth[HEIGHT * (WIDTH + GAP)], normal[HEIGHT * (3 * WIDTH + GAP)], back[3 * PIXELS];
    for (int i = 0; i < HEIGHT * (WIDTH + GAP); ++i) {
        depth[i] = i % (WIDTH + GAP) < WIDTH ? 1.5f * (float)i : -1.0f;
    }
    for (int i = 0; i < HEIGHT * (3 * WIDTH + GAP); ++i) {
        normal[i] = i % (3 * WIDTH + GAP) < 3 * WIDTH ? 0.1f * (float)i - 2 : NAN;
    }
    uint32_t width = 0, height = 0;
    path_in(file, folder, "depth.bin");
    REQUIRE(skep_write_depth_map(file, depth, WIDTH, HEIGHT, sizeof(float) * (WIDTH + GAP)));
    REQUIRE(skep_read_depth_map(file, NULL, 0, &width, &height));
    CHECK(width == WIDTH && height == HEIGHT, "%u x %u", (unsigned)width, (unsigned)height);
    REQUIRE(skep_read_depth_map(file, back, PIXELS, &width, &height));
    for (int i = 0; i < PIXELS; ++i) {
        CHECK(back[i] == depth[i / WIDTH * (WIDTH + GAP) + i % WIDTH], "pixel %d", i);
    }
    path_in(file, folder, "normal.bin");
    REQUIRE(skep_write_normal_map(file, normal, WIDTH, HEIGHT, sizeof(float) * (3 * WIDTH + GAP)));
    REQUIRE(skep_read_normal_map(file, NULL, 0, &width, &height));
    REQUIRE(skep_read_normal_map(file, back, 3 * PIXELS, &width, &height));
    for (int i = 0; i < 3 * PIXELS; ++i) {
        CHECK(back[i] == normal[i / (3 * WIDTH) * (3 * WIDTH + GAP) + i % (3 * WIDTH)], "number %d",
              i);
    }
    uint32_t counts[PIXELS], views[3 * PIXELS], counts_back[PIXELS], views_back[3 * PIXELS];
    size_t total = 0, total_back = 0;
    for (uint32_t i = 0; i < PIXELS; ++i) {
        counts[i] = i % 4;
        for (uint32_t j = 0; j < counts[i]; ++j) {
            views[total++] = j == 2 ? INT32_MAX : i + j;
        }
    }
    path_in(file, folder, "graph.bin");
    REQUIRE(skep_write_consistency_graph(file, WIDTH, HEIGHT, counts, views, total));
    REQUIRE(skep_read_consistency_graph(file, NULL, 0, NULL, 0, &width, &height, &total_back));
    CHECK(width == WIDTH && height == HEIGHT && total_back == total, "%zu", total_back);
    REQUIRE(skep_read_consistency_graph(file, counts_back, PIXELS, views_back, total, &width,
                                        &height, &total_back));
    CHECK(same_bytes(counts, counts_back, sizeof counts) &&
              same_bytes(views, views_back, 4 * total),
          "graph");
}

void test_files(const char *folder) {
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    skep_scene *read = check_scene(folder, &made, handed_in);
    skep_result *result = scene_run(read, options);
    points cloud = points_of_result(result);
    CHECK(scene_is_small() || cloud.count > scene_pixels(&made) / 2, "%zu points", cloud.count);
    points_free(&cloud);
    check_workspace(folder, &made, read, result);
    check_ply(folder, result);
    check_maps(folder);
    skep_result_destroy(result);
    skep_scene_destroy(read);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
