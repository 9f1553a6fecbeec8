/* reconstruct SCENE WORKSPACE CLOUD.ply: whole runs, from COLMAP's folder to maps and points.
 * Ctrl-C stops. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

#include <skep.h>

static volatile sig_atomic_t interrupted = 0;

static void interrupt(int number) {
    (void)number;
    interrupted = 1;
}

/* Called by the library about a hundred times a second; non-zero cancels the run. */
static int32_t print_progress(void *user, const skep_progress *at) {
    static const char *const PHASES[] = {"search", "check", "fusion", "read"};
    (void)user;
    fprintf(stderr, "\r%3.0f %%  %s at 1/%u, cycle %u, view %u of %u    ", 100 * at->done,
            PHASES[at->phase], (unsigned)at->downscale, (unsigned)at->cycle + 1,
            (unsigned)at->view + 1, (unsigned)at->view_count);
    return interrupted;
}

/* Ends the program with the library's error text when a call failed. */
static void check(skep_status status) {
    if (status != SKEP_OK) {
        char text[1024];
        skep_last_error(text, sizeof text);
        fprintf(stderr, "\nskep: %s\n", text);
        exit(1);
    }
}

/* The status of a view's pixels, in percent. */
static void print_view(const skep_scene *scene, const skep_result *result, uint32_t view) {
    static const char *const NAMES[] = {"validated",  "masked",       "no texture",
                                        "no sources", "inconsistent", "out of range"};
    char name[256];
    skep_statistics statistics;
    uint32_t width = 0, height = 0, status;
    check(skep_scene_get_name(scene, view, name, sizeof name, NULL));
    check(skep_result_get_size(result, view, &width, &height));
    check(skep_result_get_statistics(result, view, &statistics));
    printf("%s %ux%u:", name, (unsigned)width, (unsigned)height);
    for (status = SKEP_PIXEL_VALIDATED; status <= SKEP_PIXEL_OUT_OF_RANGE; ++status) {
        printf(" %.1f %% %s,", 100.0 * (double)statistics.status_counts[status] / width / height,
               NAMES[status]);
    }
    printf(" %.1f M NCC evaluations\n", (double)statistics.ncc_evaluations / 1e6);
}

/* What the user should know: depth ranges that no point supports, views without source views. */
static void print_warnings(const skep_scene *scene, const skep_result *result) {
    char text[1024];
    size_t index;
    for (index = 0;
         skep_scene_get_warning(scene, index, text, sizeof text, NULL) == SKEP_OK; ++index) {
        fprintf(stderr, "warning: %s\n", text);
    }
    for (index = 0;
         skep_result_get_warning(result, index, text, sizeof text, NULL) == SKEP_OK; ++index) {
        fprintf(stderr, "warning: %s\n", text);
    }
}

int main(int count, char **arguments) {
    skep_scene *scene = NULL;
    skep_options *options = NULL;
    skep_result *result = NULL;
    skep_cloud *cloud = NULL;
    uint32_t views = 0, view;
    size_t points = 0;
    if (count != 4) {
        fprintf(stderr, "usage: %s SCENE WORKSPACE CLOUD.ply\n", arguments[0]);
        return 2;
    }
    signal(SIGINT, interrupt);
    check(skep_scene_read(arguments[1], NULL, 0, 0, NULL, NULL, &scene));
    check(skep_options_create("default", &options));
    check(skep_options_set(options, "fusion.min_agreeing_views", 2));
    check(skep_reconstruct(scene, options, print_progress, NULL, &result));
    fprintf(stderr, "\n");
    print_warnings(scene, result);
    check(skep_scene_get_view_count(scene, &views));
    for (view = 0; view < views; ++view) {
        print_view(scene, result, view);
    }
    check(skep_result_get_cloud(result, &cloud));
    check(skep_cloud_get_count(cloud, &points, NULL));
    printf("%lu points\n", (unsigned long)points);
    check(skep_result_write_workspace(result, scene, arguments[2]));
    check(skep_cloud_write_ply(cloud, arguments[3]));
    skep_cloud_destroy(cloud);
    skep_result_destroy(result);
    skep_options_destroy(options);
    skep_scene_destroy(scene);
}
