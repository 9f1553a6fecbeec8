/*
 * Files that are missing, cut, garbled or out of place: SKEP_ERR_FILE with the file's name, and
 * nothing written.
 */
#define _DEFAULT_SOURCE
#include "support/check.h"
#include "support/disk.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 4, HEIGHT = 3, PIXELS = WIDTH * HEIGHT };

static void check_null(const char *folder, const skep_scene *handed_in, const skep_result *result,
                       const skep_cloud *cloud) {
    static const float MAP[3 * PIXELS] = {0};
    static const uint32_t COUNTS[PIXELS] = {1}, VIEW = 5;
    char file[MAX_PATH];
    path_in(file, folder, "none.bin");
    FAILS(skep_scene_read(NULL, NULL, 0, 0, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_NULL, "path");
    FAILS(skep_scene_read(folder, NULL, 0, 0, NULL, NULL, NULL), SKEP_ERR_NULL, "scene_out");
    FAILS(skep_scene_read(folder, NULL, 2, 1, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_ARGUMENT,
          "depth range");
    FAILS(skep_scene_read(folder, NULL, NAN, 1, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_ARGUMENT,
          "depth range");
    FAILS(skep_scene_write_colmap(NULL, file), SKEP_ERR_NULL, "scene");
    FAILS(skep_scene_write_colmap(handed_in, NULL), SKEP_ERR_NULL, "folder");
    FAILS(skep_result_write_workspace(NULL, handed_in, file), SKEP_ERR_NULL, "result");
    FAILS(skep_result_write_workspace(result, NULL, file), SKEP_ERR_NULL, "scene");
    FAILS(skep_result_write_workspace(result, handed_in, NULL), SKEP_ERR_NULL, "folder");
    FAILS(skep_cloud_write_ply(NULL, file), SKEP_ERR_NULL, "cloud");
    FAILS(skep_cloud_write_ply(cloud, NULL), SKEP_ERR_NULL, "file");
    FAILS(skep_write_depth_map(NULL, MAP, WIDTH, HEIGHT, 4 * WIDTH), SKEP_ERR_NULL, "file");
    FAILS(skep_write_depth_map(file, NULL, WIDTH, HEIGHT, 4 * WIDTH), SKEP_ERR_NULL, "depth");
    /* Pointers are looked at before gigabytes are taken for a copy. */
    FAILS(skep_write_depth_map(file, NULL, 32768, 32768, 4 * 32768), SKEP_ERR_NULL, "depth");
    FAILS(skep_write_normal_map(file, NULL, 32768, 32768, 12 * 32768), SKEP_ERR_NULL, "normal");
    FAILS(skep_write_depth_map(file, MAP, 0, HEIGHT, 4 * WIDTH), SKEP_ERR_ARGUMENT, "width is 0");
    FAILS(skep_write_depth_map(file, MAP, WIDTH, 0, 4 * WIDTH), SKEP_ERR_ARGUMENT, "height is 0");
    FAILS(skep_write_depth_map(file, MAP, UINT32_MAX, UINT32_MAX, SIZE_MAX), SKEP_ERR_ARGUMENT,
          "width");
    FAILS(skep_write_depth_map(file, MAP, WIDTH, HEIGHT, 4 * WIDTH - 1), SKEP_ERR_ARGUMENT,
          "stride_bytes");
    FAILS(skep_write_normal_map(NULL, MAP, WIDTH, HEIGHT, 12 * WIDTH), SKEP_ERR_NULL, "file");
    FAILS(skep_write_normal_map(file, NULL, WIDTH, HEIGHT, 12 * WIDTH), SKEP_ERR_NULL, "normal");
    FAILS(skep_write_normal_map(file, MAP, WIDTH, 32769, 12 * WIDTH), SKEP_ERR_ARGUMENT, "height");
    FAILS(skep_write_normal_map(file, MAP, WIDTH, HEIGHT, 12 * WIDTH - 1), SKEP_ERR_ARGUMENT,
          "stride_bytes");
    const float wrong[3] = {1, NAN, -1};
    FAILS(skep_write_depth_map(file, wrong, 2, 1, 8), SKEP_ERR_ARGUMENT,
          "depth at column 1, row 0 is NaN");
    FAILS(skep_write_depth_map(file, wrong + 2, 1, 1, 4), SKEP_ERR_ARGUMENT,
          "depth at column 0, row 0 is -1");
    FAILS(skep_write_normal_map(file, wrong, 1, 1, 12), SKEP_ERR_ARGUMENT,
          "normal at column 0, row 0");
    FAILS(skep_write_consistency_graph(NULL, WIDTH, HEIGHT, COUNTS, &VIEW, 1), SKEP_ERR_NULL,
          "file");
    FAILS(skep_write_consistency_graph(file, WIDTH, HEIGHT, NULL, &VIEW, 1), SKEP_ERR_NULL,
          "counts");
    FAILS(skep_write_consistency_graph(file, WIDTH, HEIGHT, COUNTS, NULL, 1), SKEP_ERR_NULL,
          "views");
    FAILS(skep_write_consistency_graph(file, 0, HEIGHT, COUNTS, &VIEW, 1), SKEP_ERR_ARGUMENT,
          "width is 0");
    FAILS(skep_write_consistency_graph(file, WIDTH, HEIGHT, COUNTS, NULL, 0), SKEP_ERR_ARGUMENT,
          "view_total is 0");
    const uint32_t many[PIXELS] = {UINT32_MAX, UINT32_MAX, UINT32_MAX}, negative = 0x80000000u;
    FAILS(skep_write_consistency_graph(file, WIDTH, HEIGHT, many, &VIEW, 1), SKEP_ERR_ARGUMENT,
          "view_total");
    FAILS(skep_write_consistency_graph(file, WIDTH, HEIGHT, COUNTS, &negative, 1),
          SKEP_ERR_ARGUMENT, "views[0]");
    uint32_t *width = OUT(uint32_t, 0), *height = OUT(uint32_t, 1);
    FAILS(skep_read_depth_map(NULL, OUT(float, 2), 9, width, height), SKEP_ERR_NULL, "file");
    FAILS(skep_read_depth_map(file, OUT(float, 2), 9, NULL, height), SKEP_ERR_NULL, "width_out");
    FAILS(skep_read_depth_map(file, OUT(float, 2), 9, width, NULL), SKEP_ERR_NULL, "height_out");
    FAILS(skep_read_normal_map(NULL, OUT(float, 2), 9, width, height), SKEP_ERR_NULL, "file");
    FAILS(skep_read_normal_map(file, OUT(float, 2), 9, NULL, height), SKEP_ERR_NULL, "width_out");
    FAILS(skep_read_normal_map(file, OUT(float, 2), 9, width, NULL), SKEP_ERR_NULL, "height_out");
    FAILS(skep_read_consistency_graph(NULL, NULL, 0, NULL, 0, width, height, OUT(size_t, 2)),
          SKEP_ERR_NULL, "file");
    FAILS(skep_read_consistency_graph(file, NULL, 0, NULL, 0, NULL, height, OUT(size_t, 2)),
          SKEP_ERR_NULL, "width_out");
    FAILS(skep_read_consistency_graph(file, NULL, 0, NULL, 0, width, NULL, OUT(size_t, 2)),
          SKEP_ERR_NULL, "height_out");
    CHECK(file_size(file) == 0, "no file was made");
}

static skep_status read_map(int kind, const char *file) {
    uint32_t *width = OUT(uint32_t, 0), *height = OUT(uint32_t, 1);
    switch (kind) {
    case 0: return skep_read_depth_map(file, NULL, 0, width, height);
    case 1: return skep_read_normal_map(file, NULL, 0, width, height);
    default:
        return skep_read_consistency_graph(file, NULL, 0, NULL, 0, width, height, OUT(size_t, 2));
    }
}

static void check_maps(const char *folder) {
    static const char *const HEADERS[] = {"",
                                          "4&3&",
                                          "4&3&9&",
                                          "0&3&1&",
                                          "&&&",
                                          "-4&3&1&",
                                          "4&3&1",
                                          "4 & 3 & 1 &",
                                          "a&b&c&",
                                          "4294967296&1&1&",
                                          "99999999999999999999&1&1&",
                                          "4&0&3&"};
    char file[MAX_PATH], cut[MAX_PATH];
    float map[3 * PIXELS];
    uint32_t counts[PIXELS], views[PIXELS], width = 0, height = 0;
    for (int i = 0; i < 3 * PIXELS; ++i) {
        map[i] = 1;
    }
    for (uint32_t i = 0; i < PIXELS; ++i) {
        counts[i] = 1;
        views[i] = i;
    }
    path_in(cut, folder, "cut.bin");
    for (int kind = 0; kind < 3; ++kind) {
        path_in(file, folder, "whole.bin");
        if (kind == 0) {
            REQUIRE(skep_write_depth_map(file, map, WIDTH, HEIGHT, 4 * WIDTH));
            FAILS(skep_read_depth_map(file, OUT(float, 2), PIXELS - 1, OUT(uint32_t, 0),
                                      OUT(uint32_t, 1)),
                  SKEP_ERR_CAPACITY, "depth");
        } else if (kind == 1) {
            REQUIRE(skep_write_normal_map(file, map, WIDTH, HEIGHT, 12 * WIDTH));
            FAILS(skep_read_normal_map(file, OUT(float, 2), 3 * PIXELS - 1, OUT(uint32_t, 0),
                                       OUT(uint32_t, 1)),
                  SKEP_ERR_CAPACITY, "normal");
        } else {
            REQUIRE(skep_write_consistency_graph(file, WIDTH, HEIGHT, counts, views, PIXELS));
            FAILS(skep_read_consistency_graph(file, OUT(uint32_t, 3), PIXELS - 1, NULL, 0,
                                              OUT(uint32_t, 0), OUT(uint32_t, 1), OUT(size_t, 2)),
                  SKEP_ERR_CAPACITY, "counts");
            FAILS(skep_read_consistency_graph(file, NULL, 0, OUT(uint32_t, 3), PIXELS - 1,
                                              OUT(uint32_t, 0), OUT(uint32_t, 1), OUT(size_t, 2)),
                  SKEP_ERR_CAPACITY, "views");
            FAILS(skep_read_consistency_graph(file, NULL, 0, NULL, 0, OUT(uint32_t, 0),
                                              OUT(uint32_t, 1), NULL),
                  SKEP_ERR_NULL, "view_total_out");
        }
        size_t size = 0, header = 6;
        uint8_t *bytes = read_file(file, &size);
        for (size_t kept = 0; kept < size; ++kept) {
            if (kind == 2 && kept >= header && (kept - header) % 16 == 0) {
                continue; /* A graph may end after any pixel. */
            }
            write_bytes(cut, bytes, kept);
            FAILS(read_map(kind, cut), SKEP_ERR_FILE, "cut.bin");
        }
        free(bytes);
        for (size_t i = 0; i < sizeof HEADERS / sizeof HEADERS[0]; ++i) {
            write_bytes(cut, HEADERS[i], strlen(HEADERS[i]));
            FAILS(read_map(kind, cut), SKEP_ERR_FILE, "cut.bin");
        }
        path_in(file, folder, "no such file.bin");
        FAILS(read_map(kind, file), SKEP_ERR_FILE, "no such file.bin");
        FAILS(read_map(kind, folder), SKEP_ERR_FILE, "cannot be read");
        FAILS(read_map(kind, ""), SKEP_ERR_FILE, "cannot be read");
    }
    /* No header makes the reader allocate: a huge map is limited by the caller's buffers alone. */
    write_bytes(cut, "4000000000&1000000&1&", 21);
    size_t total = 9;
    REQUIRE(skep_read_consistency_graph(cut, NULL, 0, NULL, 0, &width, &height, &total));
    CHECK(width == 4000000000u && height == 1000000u && total == 0, "%zu views", total);
    FAILS(skep_read_consistency_graph(cut, OUT(uint32_t, 3), 9, NULL, 0, OUT(uint32_t, 0),
                                      OUT(uint32_t, 1), OUT(size_t, 2)),
          SKEP_ERR_CAPACITY, "counts");
}

/* Every file of a scene folder, missing, cut or garbled. */
static void check_scene_folder(const char *folder, const skep_scene *handed_in) {
    static const char *const FILES[] = {"sparse/cameras.bin", "sparse/images.bin",
                                        "sparse/points3D.bin", "images/view0001.png"};
    char place[MAX_PATH], file[MAX_PATH];
    path_in(place, folder, "no such scene");
    FAILS(skep_scene_read(place, NULL, 0, 0, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_FILE,
          "no such scene");
    path_in(place, folder, "broken scene");
    REQUIRE(skep_scene_write_colmap(handed_in, place));
    for (size_t i = 0; i < sizeof FILES / sizeof FILES[0]; ++i) {
        path_in(file, place, FILES[i]);
        size_t size = 0;
        uint8_t *bytes = read_file(file, &size);
        for (size_t cut = 0; cut < 40; ++cut) {
            write_bytes(file, bytes, size * cut / 40);
            FAILS(skep_scene_read(place, NULL, 1, 9, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_FILE,
                  strrchr(FILES[i], '/') + 1);
        }
        for (size_t at = 0; at < size; at += size / 60 + 1) {
            const uint8_t kept = bytes[at];
            bytes[at] ^= 0xFF;
            write_bytes(file, bytes, size);
            skep_scene *read = NULL;
            const skep_status status = skep_scene_read(place, NULL, 1, 9, NULL, NULL, &read);
            CHECK(status == SKEP_OK ||
                      (read == NULL && (status == SKEP_ERR_FILE || status == SKEP_ERR_ARGUMENT)),
                  "byte %zu of %s: %s", at, FILES[i], skep_status_name(status));
            skep_scene_destroy(read);
            bytes[at] = kept;
        }
        remove(file);
        if (i != 2) {
            FAILS(skep_scene_read(place, NULL, 1, 9, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_FILE,
                  i == 3 ? "view0001.png" : "a COLMAP model");
        } else {
            FAILS(skep_scene_read(place, NULL, 0, 0, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_ARGUMENT,
                  "depth range");
        }
        write_bytes(file, bytes, size);
        free(bytes);
    }
    skep_scene *read = NULL;
    REQUIRE(skep_scene_read(place, NULL, 0, 0, NULL, NULL, &read));
    skep_scene_destroy(read);
}

/* Folders that are files, and names that lead outside a folder. */
static void check_places(const char *folder, const scene *made, const skep_result *result,
                         const skep_scene *handed_in, const skep_cloud *cloud) {
    static const char *const NAMES[] = {"../up.png", "/absolute.png", "a/../../b.png", "",
                                        "line\nbreak.png"};
    char file[MAX_PATH], below[MAX_PATH];
    path_in(file, folder, "a file");
    write_bytes(file, "x", 1);
    path_in(below, file, "below");
    FAILS(skep_scene_read(file, NULL, 0, 0, NULL, NULL, OUT(skep_scene *, 0)), SKEP_ERR_FILE, "a file");
    FAILS(skep_scene_write_colmap(handed_in, below), SKEP_ERR_FILE, "cannot be written");
    FAILS(skep_result_write_workspace(result, handed_in, below), SKEP_ERR_FILE,
          "cannot be written");
    FAILS(skep_cloud_write_ply(cloud, below), SKEP_ERR_FILE, "cannot be written");
    FAILS(skep_cloud_write_ply(cloud, folder), SKEP_ERR_FILE, "cannot be written");
    FAILS(skep_cloud_write_ply(cloud, ""), SKEP_ERR_FILE, "cannot be written");
    const float depth = 1;
    FAILS(skep_write_depth_map(below, &depth, 1, 1, 4), SKEP_ERR_FILE, "a file/below");
    path_in(below, folder, "names");
    for (size_t i = 0; i < sizeof NAMES / sizeof NAMES[0]; ++i) {
        skep_scene *named = NULL;
        REQUIRE(skep_scene_create(&named));
        for (uint32_t view = 0; view < made->views; ++view) {
            const skep_image image = scene_image(made, view);
            const char *name = view == 1 ? NAMES[i] : NULL;
            REQUIRE(
                skep_scene_add_view(named, name, &image, &made->photographs[view].camera, NULL));
            REQUIRE(skep_scene_set_depth_range(named, view, SCENE_NEAR, SCENE_FAR));
        }
        FAILS(skep_scene_write_colmap(named, below), SKEP_ERR_ARGUMENT, "views[1].name");
        FAILS(skep_result_write_workspace(result, named, below), SKEP_ERR_ARGUMENT, "name");
        skep_scene_destroy(named);
    }
    CHECK(access(below, F_OK) != 0, "no folder was made");
    /* The result of another scene. */
    scene other;
    scene_make_sized(&other, made->views, made->width + 1, made->height);
    skep_scene *foreign = scene_hand_in(&other);
    FAILS(skep_result_write_workspace(result, foreign, below), SKEP_ERR_ARGUMENT, "scene is");
    skep_scene_destroy(foreign);
    scene_free(&other);
}

void test_misuse_files(const char *folder) {
    scene made;
    scene_make(&made);
    skep_options *options = quick_options();
    skep_scene *handed_in = scene_hand_in(&made);
    skep_result *result = scene_run(handed_in, options);
    skep_cloud *cloud = NULL;
    REQUIRE(skep_result_get_cloud(result, &cloud));
    check_null(folder, handed_in, result, cloud);
    check_maps(folder);
    check_scene_folder(folder, handed_in);
    check_places(folder, &made, result, handed_in, cloud);
    skep_cloud_destroy(cloud);
    skep_result_destroy(result);
    skep_scene_destroy(handed_in);
    skep_options_destroy(options);
    scene_free(&made);
}
