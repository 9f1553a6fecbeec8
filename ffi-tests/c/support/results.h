/* The results of a run, copied and compared. */
#ifndef RESULTS_H
#define RESULTS_H

#include <skep.h>

/* All maps of one view, dense. */
typedef struct view_maps {
    uint32_t width;
    uint32_t height;
    float *depth[2];
    float *normal[2];
    float *cost;
    float *confidence;
    uint8_t *status;
    uint16_t *source_count;
    uint32_t *source_bits;
    uint32_t sources[32];
    size_t source_total;
    skep_statistics statistics;
    skep_cycle_record cycles[64];
    size_t cycle_total;
} view_maps;

view_maps maps_of(const skep_result *result, uint32_t view);
void maps_free(view_maps *maps);

/* Compares every bit of two views' results. */
void check_same_maps(const view_maps *a, const view_maps *b, const char *what);
void check_same_results(const skep_result *a, const skep_result *b, uint32_t views,
                        const char *what);

typedef struct points {
    size_t count;
    size_t view_total;
    double *positions;
    float *normals;
    uint8_t *colors;
    uint32_t *view_counts;
    uint32_t *views;
} points;

points points_of(const skep_cloud *cloud);
points points_of_result(const skep_result *result);
void points_free(points *all);

/* Compares every bit of two clouds. */
void check_same_points(const points *a, const points *b, const char *what);

#endif
