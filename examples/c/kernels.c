/* kernels: the lowest level. A plane sweep at one pixel: of planes at several depths, the one where
 * the patches of both images correlate best is the true one. Both images are rendered here, of a
 * textured wall at depth 4. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <skep.h>

enum { WIDTH = 64, HEIGHT = 48, DEPTHS = 9, PIXEL_X = 30, PIXEL_Y = 22 };
static const double WALL_DEPTH = 4;

/* Ends the program with the library's error text when a call failed. */
static void check(skep_status status) {
    if (status != SKEP_OK) {
        char text[1024];
        skep_last_error(text, sizeof text);
        fprintf(stderr, "skep: %s\n", text);
        exit(1);
    }
}

/* A camera that faces the wall, shifted to the right. */
static skep_camera camera_at(double right) {
    skep_camera camera = {
        60, 60, (WIDTH - 1) / 2.0, (HEIGHT - 1) / 2.0, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    camera.translation[0] = -right;
    return camera;
}

/* Renders the wall as a camera shows it, in the layout that the kernels sample. */
static skep_packed_image *render(const skep_camera *camera) {
    static unsigned char pixels[HEIGHT][WIDTH];
    skep_packed_image *packed = NULL;
    skep_image image;
    int x, y;
    for (y = 0; y < HEIGHT; ++y) {
        for (x = 0; x < WIDTH; ++x) {
            const double u = (x - camera->cx) / camera->fx * WALL_DEPTH - camera->translation[0];
            const double v = (y - camera->cy) / camera->fy * WALL_DEPTH;
            const double gray = sin(7 * u + 2 * v) + sin(5 * v - 3 * u) + sin(11 * u * v);
            pixels[y][x] = (unsigned char)(127.5 + 40 * gray);
        }
    }
    image.data = pixels;
    image.width = WIDTH;
    image.height = HEIGHT;
    image.stride_bytes = WIDTH;
    image.format = SKEP_FORMAT_GRAY;
    check(skep_packed_image_create(&image, &packed));
    return packed;
}

int main(void) {
    const skep_camera left = camera_at(0), right = camera_at(0.5);
    const double facing[3] = {0, 0, -1};
    skep_packed_image *reference = render(&left), *source = render(&right);
    skep_ncc_window *window = NULL;
    skep_plane planes[DEPTHS];
    double homographies[9 * DEPTHS], depths[DEPTHS];
    uint32_t pixels[2 * DEPTHS];
    float ncc[DEPTHS];
    int i, best = 0;
    for (i = 0; i < DEPTHS; ++i) {
        depths[i] = WALL_DEPTH * (0.8 + 0.05 * i);
        check(skep_plane_through(&left, PIXEL_X, PIXEL_Y, depths[i], facing, &planes[i]));
        pixels[2 * i] = PIXEL_X;
        pixels[2 * i + 1] = PIXEL_Y;
    }
    check(skep_plane_homographies(&left, &right, planes, DEPTHS, homographies));
    check(skep_ncc_window_create(5, 1, 5, 0.2, 1e-5, &window));
    check(skep_patch_ncc(window, reference, source, pixels, homographies, DEPTHS, ncc));
    for (i = 0; i < DEPTHS; ++i) {
        printf("depth %.2f: NCC %6.3f\n", depths[i], ncc[i]);
        best = ncc[i] > ncc[best] ? i : best;
    }
    printf("best depth: %.2f\n", depths[best]);
    skep_ncc_window_destroy(window);
    skep_packed_image_destroy(source);
    skep_packed_image_destroy(reference);
}
