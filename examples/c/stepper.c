/* stepper SCENE CLOUD.ply: the stepwise level. The program schedules the views of COLMAP's folder
 * itself; each loop over views could run on several threads, or on several machines that exchange
 * saved estimates. */
#include <stdio.h>
#include <stdlib.h>

#include <skep.h>

typedef const skep_estimate *const *estimate_list;

/* Ends the program with the library's error text when a call failed. */
static void check(skep_status status) {
    if (status != SKEP_OK) {
        char text[1024];
        skep_last_error(text, sizeof text);
        fprintf(stderr, "skep: %s\n", text);
        exit(1);
    }
}

static void *allocate(size_t count, size_t size) {
    void *memory = calloc(count, size);
    if (memory == NULL) {
        fprintf(stderr, "stepper: no memory\n");
        exit(1);
    }
    return memory;
}

/* Brings the estimates of coarser scales to the scale of a cycle. */
static void upsample(const skep_stepper *stepper, uint32_t cycle, skep_estimate **estimates,
                     uint32_t views) {
    skep_cycle now, before;
    skep_estimate_info info;
    uint32_t view;
    check(skep_stepper_get_cycle(stepper, cycle, &now));
    for (view = 0; view < views && estimates[view] != NULL; ++view) {
        check(skep_estimate_get_info(estimates[view], &info));
        check(skep_stepper_get_cycle(stepper, info.cycle, &before));
        if (before.downscale != now.downscale) {
            skep_estimate *coarse = estimates[view];
            check(skep_stepper_upsample(stepper, cycle, view, coarse, &estimates[view]));
            skep_estimate_destroy(coarse);
        }
    }
}

/* One cycle: searches all views from the checked estimates, then checks all searched ones. */
static void run_cycle(const skep_stepper *stepper, uint32_t cycle, skep_estimate **estimates,
                      uint32_t views) {
    skep_estimate **searched = allocate(views, sizeof *searched);
    unsigned long long validated = 0, pixels = 0;
    uint32_t view;
    upsample(stepper, cycle, estimates, views);
    for (view = 0; view < views; ++view) {
        skep_candidates *candidates = NULL;
        check(skep_stepper_propagate(stepper, cycle, view, (estimate_list)estimates, views,
                                     &candidates));
        check(skep_stepper_search(stepper, cycle, view, (estimate_list)estimates, views, candidates,
                                  NULL, NULL, &searched[view]));
        skep_candidates_destroy(candidates);
    }
    for (view = 0; view < views; ++view) {
        skep_estimate_info info;
        skep_estimate_destroy(estimates[view]);
        check(skep_stepper_check(stepper, cycle, view, (estimate_list)searched, views,
                                 &estimates[view]));
        check(skep_estimate_get_info(estimates[view], &info));
        validated += info.validated;
        pixels += info.pixels;
    }
    for (view = 0; view < views; ++view) {
        skep_estimate_destroy(searched[view]);
    }
    free(searched);
    printf("cycle %u: %.1f %% of %llu pixels validated\n", (unsigned)cycle,
           100.0 * (double)validated / (double)pixels, pixels);
}

/* A view as skep_fuse takes it, with its validated maps. The memory is freed by free_view. */
static skep_fusion_view fusion_view(const skep_scene *scene, const skep_result *result,
                                    uint32_t view, uint32_t views) {
    skep_fusion_view fused = {0};
    skep_camera *camera = allocate(1, sizeof *camera);
    uint32_t *overlap = allocate(views, sizeof *overlap);
    float *depth, *normal, *confidence;
    check(skep_scene_get_view(scene, view, &fused.width, &fused.height, camera));
    check(skep_scene_get_overlap(scene, view, overlap, views, &fused.overlap_count));
    fused.depth_stride_bytes = fused.width * sizeof(float);
    fused.normal_stride_bytes = 3 * fused.width * sizeof(float);
    depth = allocate(fused.height, fused.depth_stride_bytes);
    normal = allocate(fused.height, fused.normal_stride_bytes);
    check(
        skep_result_get_depth(result, view, SKEP_MAPS_VALIDATED, depth, fused.depth_stride_bytes));
    check(skep_result_get_normal(result, view, SKEP_MAPS_VALIDATED, normal,
                                 fused.normal_stride_bytes));
    fused.confidence_stride_bytes = fused.depth_stride_bytes;
    confidence = allocate(fused.height, fused.confidence_stride_bytes);
    check(skep_result_get_confidence(result, view, confidence, fused.confidence_stride_bytes));
    fused.confidence_or_null = confidence;
    fused.camera = camera;
    fused.overlap = overlap;
    fused.depth = depth;
    fused.normal = normal;
    return fused;
}

static void free_view(const skep_fusion_view *view) {
    free((void *)view->camera);
    free((void *)view->overlap);
    free((void *)view->depth);
    free((void *)view->normal);
    free((void *)view->confidence_or_null);
}

int main(int count, char **arguments) {
    skep_scene *scene = NULL;
    skep_options *options = NULL;
    skep_stepper *stepper = NULL;
    skep_cloud *cloud = NULL;
    skep_estimate **estimates;
    skep_fusion_view *fused;
    uint32_t views = 0, view, cycle = 0;
    size_t points = 0;
    if (count != 3) {
        fprintf(stderr, "usage: %s SCENE CLOUD.ply\n", arguments[0]);
        return 2;
    }
    check(skep_scene_read(arguments[1], NULL, 0, 0, NULL, NULL, &scene));
    check(skep_options_create("fast", &options));
    check(skep_options_set(options, "fusion.min_agreeing_views", 2));
    check(skep_stepper_create(scene, options, &stepper));
    check(skep_stepper_get_count(stepper, NULL, &views));
    estimates = allocate(views, sizeof *estimates);
    fused = allocate(views, sizeof *fused);
    while (cycle != SKEP_CYCLE_NONE) {
        run_cycle(stepper, cycle, estimates, views);
        check(skep_stepper_next(stepper, cycle, (estimate_list)estimates, views, &cycle));
    }
    for (view = 0; view < views; ++view) {
        skep_result *result = NULL;
        check(skep_stepper_finish(stepper, view, (estimate_list)estimates, views, NULL, NULL,
                                  &result));
        fused[view] = fusion_view(scene, result, view, views);
        skep_result_destroy(result);
    }
    check(skep_fuse(fused, views, options, NULL, NULL, &cloud));
    check(skep_cloud_get_count(cloud, &points, NULL));
    check(skep_cloud_write_ply(cloud, arguments[2]));
    printf("%lu points\n", (unsigned long)points);
    for (view = 0; view < views; ++view) {
        free_view(&fused[view]);
        skep_estimate_destroy(estimates[view]);
    }
    free(fused);
    free(estimates);
    skep_cloud_destroy(cloud);
    skep_stepper_destroy(stepper);
    skep_options_destroy(options);
    skep_scene_destroy(scene);
}
