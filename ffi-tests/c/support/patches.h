/* Patches of the scene with their true planes, for the kernels. */
#ifndef PATCHES_H
#define PATCHES_H

#include "scene.h"

/* The window most tests take. */
skep_ncc_window *make_window(void);
skep_packed_image *make_packed_image(const scene *made, uint32_t view);

/*
 * Planes at the pixels of a view that lie on a surface, up to `most`: two each, the true one and
 * one at 1.2 times its depth. `pixels` takes x, y of each plane. Returns the number of planes.
 */
size_t make_patches(const scene *made, uint32_t view, size_t most, skep_plane *planes,
                    uint32_t *pixels);

#endif
