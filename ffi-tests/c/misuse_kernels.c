/* Errors of the kernels: the status, the argument's name, and nothing written. */
#include "support/check.h"
#include "support/patches.h"
#include "support/scene.h"
#include "tests.h"

#include <math.h>

static void check_planes(const skep_camera *camera) {
    static const double FACING[3] = {0, 0, -1}, AWAY[3] = {0, 0, 1}, LONG[3] = {0, 0, -2},
                        NONE[3] = {NAN, 0, -1};
    skep_plane *out = OUT(skep_plane, 0);
    skep_camera wrong = *camera;
    wrong.fy = NAN;
    FAILS(skep_plane_through(NULL, 1, 1, 4, FACING, out), SKEP_ERR_NULL, "camera");
    FAILS(skep_plane_through(&wrong, 1, 1, 4, FACING, out), SKEP_ERR_ARGUMENT, "camera.fy");
    FAILS(skep_plane_through(camera, 1, 1, 4, NULL, out), SKEP_ERR_NULL, "normal");
    FAILS(skep_plane_through(camera, 1, 1, 4, FACING, NULL), SKEP_ERR_NULL, "plane_out");
    FAILS(skep_plane_through(camera, NAN, 1, 4, FACING, out), SKEP_ERR_ARGUMENT, "x is NaN");
    FAILS(skep_plane_through(camera, 1, INFINITY, 4, FACING, out), SKEP_ERR_ARGUMENT, "y is inf");
    FAILS(skep_plane_through(camera, 1, 1, 0, FACING, out), SKEP_ERR_ARGUMENT, "depth is 0");
    FAILS(skep_plane_through(camera, 1, 1, -4, FACING, out), SKEP_ERR_ARGUMENT, "depth is -4");
    FAILS(skep_plane_through(camera, 1, 1, NAN, FACING, out), SKEP_ERR_ARGUMENT, "depth is NaN");
    FAILS(skep_plane_through(camera, 1, 1, 4, AWAY, out), SKEP_ERR_ARGUMENT, "normal");
    FAILS(skep_plane_through(camera, 1, 1, 4, LONG, out), SKEP_ERR_ARGUMENT, "normal");
    FAILS(skep_plane_through(camera, 1, 1, 4, NONE, out), SKEP_ERR_ARGUMENT, "normal");
}

static void check_homographies(const skep_camera *camera) {
    const skep_plane good = {{0, 0, -1}, 4};
    skep_plane planes[3] = {good, good, good};
    skep_camera wrong = *camera;
    wrong.rotation[4] = 7;
    double *out = OUT(double, 0);
    FAILS(skep_plane_homographies(NULL, camera, planes, 3, out), SKEP_ERR_NULL, "reference");
    FAILS(skep_plane_homographies(camera, NULL, planes, 3, out), SKEP_ERR_NULL, "source");
    FAILS(skep_plane_homographies(&wrong, camera, planes, 3, out), SKEP_ERR_ARGUMENT,
          "reference.rotation");
    FAILS(skep_plane_homographies(camera, &wrong, planes, 3, out), SKEP_ERR_ARGUMENT,
          "source.rotation");
    FAILS(skep_plane_homographies(camera, camera, NULL, 3, out), SKEP_ERR_NULL, "planes");
    FAILS(skep_plane_homographies(camera, camera, planes, 3, NULL), SKEP_ERR_NULL, "homographies");
    FAILS(skep_plane_homographies(camera, camera, planes, SIZE_MAX, out), SKEP_ERR_ARGUMENT,
          "planes");
    static const double DISTANCES[] = {0, -1, NAN, INFINITY};
    for (int i = 0; i < 4; ++i) {
        planes[2].distance = DISTANCES[i];
        FAILS(skep_plane_homographies(camera, camera, planes, 3, out), SKEP_ERR_ARGUMENT,
              "planes[2].distance");
    }
    planes[2] = good;
    planes[1].normal[2] = -0.9;
    FAILS(skep_plane_homographies(camera, camera, planes, 3, out), SKEP_ERR_ARGUMENT,
          "planes[1].normal");
}

static void check_windows(void) {
    skep_ncc_window **out = OUT(skep_ncc_window *, 0);
    FAILS(skep_ncc_window_create(5, 2, 5, 0.2, 1e-5, NULL), SKEP_ERR_NULL, "window_out");
    FAILS(skep_ncc_window_create(0, 2, 5, 0.2, 1e-5, out), SKEP_ERR_ARGUMENT, "radius is 0");
    FAILS(skep_ncc_window_create(17, 2, 5, 0.2, 1e-5, out), SKEP_ERR_ARGUMENT, "radius is 17");
    FAILS(skep_ncc_window_create(5, 0, 5, 0.2, 1e-5, out), SKEP_ERR_ARGUMENT, "step is 0");
    FAILS(skep_ncc_window_create(5, 9, 5, 0.2, 1e-5, out), SKEP_ERR_ARGUMENT, "step is 9");
    FAILS(skep_ncc_window_create(5, 2, 0, 0.2, 1e-5, out), SKEP_ERR_ARGUMENT, "sigma_spatial");
    FAILS(skep_ncc_window_create(5, 2, NAN, 0.2, 1e-5, out), SKEP_ERR_ARGUMENT, "sigma_spatial");
    FAILS(skep_ncc_window_create(5, 2, 5, -1, 1e-5, out), SKEP_ERR_ARGUMENT, "sigma_color");
    FAILS(skep_ncc_window_create(5, 2, 5, 0.2, NAN, out), SKEP_ERR_ARGUMENT, "min_variance");
    FAILS(skep_ncc_window_create(5, 2, 5, 0.2, 2, out), SKEP_ERR_ARGUMENT, "min_variance");
    skep_ncc_window_destroy(NULL);
    skep_packed_image_destroy(NULL);
}

static void check_correlations(const scene *made) {
    skep_ncc_window *window = make_window();
    skep_packed_image *reference = make_packed_image(made, 0), *source = make_packed_image(made, 1);
    const uint32_t w = made->width, h = made->height;
    const uint32_t pixels[4] = {3, 4, w - 1, h - 1}, right[4] = {3, 4, w, 0},
                   below[4] = {0, h, 3, 4};
    double homographies[18] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    float *out = OUT(float, 0);
    FAILS(skep_patch_ncc(NULL, reference, source, pixels, homographies, 2, out), SKEP_ERR_NULL,
          "window");
    FAILS(skep_patch_ncc(window, NULL, source, pixels, homographies, 2, out), SKEP_ERR_NULL,
          "reference");
    FAILS(skep_patch_ncc(window, reference, NULL, pixels, homographies, 2, out), SKEP_ERR_NULL,
          "source");
    FAILS(skep_patch_ncc(window, reference, source, NULL, homographies, 2, out), SKEP_ERR_NULL,
          "pixels");
    FAILS(skep_patch_ncc(window, reference, source, pixels, NULL, 2, out), SKEP_ERR_NULL,
          "homographies");
    FAILS(skep_patch_ncc(window, reference, source, pixels, homographies, 2, NULL), SKEP_ERR_NULL,
          "ncc");
    FAILS(skep_patch_ncc(window, reference, source, pixels, homographies, SIZE_MAX, out),
          SKEP_ERR_ARGUMENT, "pixels");
    FAILS(skep_patch_ncc(window, reference, source, right, homographies, 2, out), SKEP_ERR_ARGUMENT,
          "pixels[1]");
    FAILS(skep_patch_ncc(window, reference, source, below, homographies, 2, out), SKEP_ERR_ARGUMENT,
          "pixels[0]");
    homographies[13] = NAN;
    FAILS(skep_patch_ncc(window, reference, source, pixels, homographies, 2, out),
          SKEP_ERR_ARGUMENT, "homographies[1]");
    homographies[13] = 1;
    float ncc[2];
    REQUIRE(skep_patch_ncc(window, reference, source, pixels, homographies, 2, ncc));
    FAILS(skep_packed_image_create(NULL, OUT(skep_packed_image *, 0)), SKEP_ERR_NULL, "image");
    const skep_image image = scene_image(made, 0);
    FAILS(skep_packed_image_create(&image, NULL), SKEP_ERR_NULL, "packed_image_out");
    skep_packed_image_destroy(source);
    skep_packed_image_destroy(reference);
    skep_ncc_window_destroy(window);
}

/* Cameras and homographies of any finite numbers give numbers. */
static void check_extremes(const scene *made) {
    static const double SIZES[] = {1e-300, 1e-30, 1e30, 1e300};
    skep_ncc_window *window = make_window();
    skep_packed_image *samples = make_packed_image(made, 0);
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 9; ++j) {
            double homography[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
            homography[j] = SIZES[i];
            const uint32_t pixel[2] = {made->width / 2, made->height / 2};
            float ncc = NAN;
            REQUIRE(skep_patch_ncc(window, samples, samples, pixel, homography, 1, &ncc));
            CHECK(ncc >= -1 && ncc <= 1, "entry %d of size %g: %g", j, SIZES[i], ncc);
            homography[j] = -SIZES[i];
            REQUIRE(skep_patch_ncc(window, samples, samples, pixel, homography, 1, &ncc));
            CHECK(ncc >= -1 && ncc <= 1, "entry %d of size %g: %g", j, -SIZES[i], ncc);
        }
    }
    skep_packed_image_destroy(samples);
    skep_ncc_window_destroy(window);
}

void test_misuse_kernels(const char *folder) {
    (void)folder;
    scene made;
    scene_make_sized(&made, 2, 40, 30);
    const skep_camera *camera = &made.photographs[0].camera;
    check_planes(camera);
    check_homographies(camera);
    check_windows();
    check_correlations(&made);
    check_extremes(&made);
    scene_free(&made);
}
