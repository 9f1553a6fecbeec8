#include "patches.h"

#include "check.h"

skep_ncc_window *make_window(void) {
    skep_ncc_window *window = NULL;
    REQUIRE(skep_ncc_window_create(4, 1, 4, 0.2, 1e-5, &window));
    return window;
}

skep_packed_image *make_packed_image(const scene *made, uint32_t view) {
    const skep_image image = scene_image(made, view);
    skep_packed_image *samples = NULL;
    REQUIRE(skep_packed_image_create(&image, &samples));
    return samples;
}

size_t make_patches(const scene *made, uint32_t view, size_t most, skep_plane *planes,
                    uint32_t *pixels) {
    const photograph *truth = &made->photographs[view];
    size_t count = 0;
    for (uint32_t y = 8; y + 8 < made->height; y += 2) {
        for (uint32_t x = 8; x + 8 < made->width && count + 2 <= most; x += 3) {
            const size_t pixel = (size_t)y * made->width + x;
            if (!truth->surface[pixel]) {
                continue;
            }
            const double normal[3] = {truth->normal[3 * pixel], truth->normal[3 * pixel + 1],
                                      truth->normal[3 * pixel + 2]};
            for (int is_wrong = 0; is_wrong < 2; ++is_wrong) {
                const double depth = truth->depth[pixel] * (is_wrong ? 1.2 : 1);
                REQUIRE(skep_plane_through(&truth->camera, x, y, depth, normal, &planes[count]));
                pixels[2 * count] = x;
                pixels[2 * count + 1] = y;
                ++count;
            }
        }
    }
    return count;
}
