#include "results.h"

#include "check.h"

#include <stdlib.h>

view_maps maps_of(const skep_result *result, uint32_t view) {
    view_maps maps = {0};
    REQUIRE(skep_result_get_size(result, view, &maps.width, &maps.height));
    const size_t width = maps.width, pixels = width * maps.height;
    for (uint32_t which = SKEP_MAPS_RAW; which <= SKEP_MAPS_VALIDATED; ++which) {
        maps.depth[which] = take(pixels, sizeof(float));
        maps.normal[which] = take(pixels, 3 * sizeof(float));
        REQUIRE(skep_result_get_depth(result, view, which, maps.depth[which], 4 * width));
        REQUIRE(skep_result_get_normal(result, view, which, maps.normal[which], 12 * width));
    }
    maps.cost = take(pixels, sizeof *maps.cost);
    maps.confidence = take(pixels, sizeof *maps.confidence);
    maps.status = take(pixels, sizeof *maps.status);
    maps.source_count = take(pixels, sizeof *maps.source_count);
    maps.source_bits = take(pixels, sizeof *maps.source_bits);
    REQUIRE(skep_result_get_cost(result, view, maps.cost, 4 * width));
    REQUIRE(skep_result_get_confidence(result, view, maps.confidence, 4 * width));
    REQUIRE(skep_result_get_status(result, view, maps.status, width));
    REQUIRE(skep_result_get_source_count(result, view, maps.source_count, 2 * width));
    REQUIRE(skep_result_get_source_bits(result, view, 0, maps.source_bits, 4 * width));
    REQUIRE(skep_result_get_sources(result, view, maps.sources, 32, &maps.source_total));
    REQUIRE(skep_result_get_statistics(result, view, &maps.statistics));
    REQUIRE(skep_result_get_cycles(result, view, maps.cycles, 64, &maps.cycle_total));
    return maps;
}

void maps_free(view_maps *maps) {
    for (int which = 0; which < 2; ++which) {
        free(maps->depth[which]);
        free(maps->normal[which]);
    }
    free(maps->cost);
    free(maps->confidence);
    free(maps->status);
    free(maps->source_count);
    free(maps->source_bits);
}

static int same_cycles(const view_maps *a, const view_maps *b) {
    int same = a->cycle_total == b->cycle_total;
    for (size_t i = 0; same && i < a->cycle_total; ++i) {
        const skep_cycle_record *x = &a->cycles[i], *y = &b->cycles[i];
        same = x->downscale == y->downscale && x->cycle == y->cycle && x->pixels == y->pixels &&
               x->changed == y->changed && x->validated == y->validated;
    }
    return same;
}

void check_same_maps(const view_maps *a, const view_maps *b, const char *what) {
    const size_t pixels = (size_t)a->width * a->height;
    if (!CHECK(a->width == b->width && a->height == b->height, "%s", what)) {
        return;
    }
    for (int which = 0; which < 2; ++which) {
        CHECK(same_bytes(a->depth[which], b->depth[which], 4 * pixels), "%s, maps %d", what, which);
        CHECK(same_bytes(a->normal[which], b->normal[which], 12 * pixels), "%s, maps %d", what,
              which);
    }
    CHECK(same_bytes(a->cost, b->cost, 4 * pixels), "%s", what);
    CHECK(same_bytes(a->confidence, b->confidence, 4 * pixels), "%s", what);
    CHECK(same_bytes(a->status, b->status, pixels), "%s", what);
    CHECK(same_bytes(a->source_count, b->source_count, 2 * pixels), "%s", what);
    CHECK(same_bytes(a->source_bits, b->source_bits, 4 * pixels), "%s", what);
    CHECK(a->source_total == b->source_total &&
              same_bytes(a->sources, b->sources, 4 * a->source_total),
          "%s", what);
    CHECK(same_bytes(&a->statistics, &b->statistics, sizeof a->statistics), "%s", what);
    CHECK(same_cycles(a, b), "%s", what);
}

void check_same_results(const skep_result *a, const skep_result *b, uint32_t views,
                        const char *what) {
    for (uint32_t view = 0; view < views; ++view) {
        view_maps of_a = maps_of(a, view), of_b = maps_of(b, view);
        check_same_maps(&of_a, &of_b, what);
        maps_free(&of_a);
        maps_free(&of_b);
    }
    points points_a = points_of_result(a), points_b = points_of_result(b);
    check_same_points(&points_a, &points_b, what);
    points_free(&points_a);
    points_free(&points_b);
}

points points_of(const skep_cloud *cloud) {
    points all = {0};
    REQUIRE(skep_cloud_get_count(cloud, &all.count, &all.view_total));
    all.positions = take(all.count, 3 * sizeof *all.positions);
    all.normals = take(all.count, 3 * sizeof *all.normals);
    all.colors = take(all.count, 3);
    all.view_counts = take(all.count, sizeof *all.view_counts);
    all.views = take(all.view_total, sizeof *all.views);
    REQUIRE(skep_cloud_get_points(cloud, all.positions, all.normals, all.colors, all.count));
    REQUIRE(skep_cloud_get_views(cloud, all.view_counts, all.count, all.views, all.view_total));
    return all;
}

points points_of_result(const skep_result *result) {
    skep_cloud *cloud = NULL;
    REQUIRE(skep_result_get_cloud(result, &cloud));
    const points all = points_of(cloud);
    skep_cloud_destroy(cloud);
    return all;
}

void points_free(points *all) {
    free(all->positions);
    free(all->normals);
    free(all->colors);
    free(all->view_counts);
    free(all->views);
}

void check_same_points(const points *a, const points *b, const char *what) {
    if (!CHECK(a->count == b->count && a->view_total == b->view_total,
               "%s: %zu points over %zu views, %zu over %zu", what, a->count, a->view_total,
               b->count, b->view_total)) {
        return;
    }
    CHECK(same_bytes(a->positions, b->positions, a->count * 3 * sizeof *a->positions), "%s", what);
    CHECK(same_bytes(a->normals, b->normals, a->count * 3 * sizeof *a->normals), "%s", what);
    CHECK(same_bytes(a->colors, b->colors, a->count * 3), "%s", what);
    CHECK(same_bytes(a->view_counts, b->view_counts, a->count * sizeof *a->view_counts), "%s",
          what);
    CHECK(same_bytes(a->views, b->views, a->view_total * sizeof *a->views), "%s", what);
}
