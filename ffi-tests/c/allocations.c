/*
 * The kernels allocate nothing. The linker redirects malloc and the like to this file (--wrap).
 */
#include "support/check.h"
#include "support/patches.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 100 };

static atomic_long allocations;

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);
int __real_posix_memalign(void **memory, size_t alignment, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t size);
int __wrap_posix_memalign(void **memory, size_t alignment, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);

void *__wrap_malloc(size_t size) {
    atomic_fetch_add(&allocations, 1);
    return __real_malloc(size);
}

void *__wrap_calloc(size_t count, size_t size) {
    atomic_fetch_add(&allocations, 1);
    return __real_calloc(count, size);
}

void *__wrap_realloc(void *memory, size_t size) {
    atomic_fetch_add(&allocations, 1);
    return __real_realloc(memory, size);
}

int __wrap_posix_memalign(void **memory, size_t alignment, size_t size) {
    atomic_fetch_add(&allocations, 1);
    return __real_posix_memalign(memory, alignment, size);
}

void *__wrap_aligned_alloc(size_t alignment, size_t size) {
    atomic_fetch_add(&allocations, 1);
    return __real_aligned_alloc(alignment, size);
}

int main(void) {
    static skep_plane planes[MOST];
    static uint32_t pixels[2 * MOST];
    static double homographies[9 * MOST];
    static float ncc[MOST];
    check_start();
    scene made;
    scene_make(&made);
    const skep_camera *from = &made.photographs[0].camera, *to = &made.photographs[1].camera;

    long before = atomic_load(&allocations);
    skep_ncc_window *window = make_window();
    skep_packed_image *reference = make_packed_image(&made, 0),
                      *source = make_packed_image(&made, 1);
    const long made_with = atomic_load(&allocations) - before;
    CHECK(made_with >= 3, "allocations of the library are counted, but there were %ld", made_with);

    before = atomic_load(&allocations);
    const size_t count = make_patches(&made, 0, MOST, planes, pixels);
    for (int round = 0; round < 10; ++round) {
        REQUIRE(skep_plane_homographies(from, to, planes, count, homographies));
        REQUIRE(skep_patch_ncc(window, reference, source, pixels, homographies, count, ncc));
    }
    const long worked_with = atomic_load(&allocations) - before;
    printf("%zu patches; allocations: %ld to make objects, %ld in the kernels\n", count, made_with,
           worked_with);
    CHECK(count == MOST && worked_with == 0, "%ld allocations", worked_with);

    skep_packed_image_destroy(source);
    skep_packed_image_destroy(reference);
    skep_ncc_window_destroy(window);
    scene_free(&made);
    return check_summary();
}
