/*
 * A slanted wall and a board in front of it, in synthetic photographs with exact depths and
 * normals.
 */
#ifndef SCENE_H
#define SCENE_H

#include <skep.h>

enum { MAX_VIEWS = 5 };

/* One photograph with the true values of its pixels, all dense, row by row. */
typedef struct photograph {
    skep_camera camera;
    uint8_t *rgb;
    float *depth;
    float *normal;
    /* 1 on the wall, 2 on the board; 0 beside an edge between the two. */
    uint8_t *surface;
} photograph;

typedef struct scene {
    uint32_t width;
    uint32_t height;
    uint32_t views;
    photograph photographs[MAX_VIEWS];
    /* Sparse points as skep_scene_add_points takes them. */
    size_t points;
    double *positions;
    uint32_t *view_counts;
    uint32_t *point_views;
    size_t view_total;
} scene;

/* The depths of all surfaces in every view are between these. */
extern const double SCENE_NEAR;
extern const double SCENE_FAR;

/*
 * The scene of all tests: 5 views of 72 x 54 pixels or, where SKEP_TEST_SMALL is set, 4 of 24 x 18,
 * which are too small for accurate results, but fast.
 */
void scene_make(scene *made);
int scene_is_small(void);
void scene_make_sized(scene *made, uint32_t views, uint32_t width, uint32_t height);
void scene_free(scene *made);

size_t scene_pixels(const scene *made);

/* A view's photograph as 8-bit RGB. */
skep_image scene_image(const scene *made, uint32_t view);

/* All views with their sparse points. */
skep_scene *scene_hand_in(const scene *made);

/* Options of a fast run on two scales. */
skep_options *quick_options(void);

/* A whole run, which must succeed. NULL options are the default ones. */
skep_result *scene_run(const skep_scene *handed_in, const skep_options *options);

#endif
