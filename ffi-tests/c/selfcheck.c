/* selfcheck ERROR: makes an intentional error, which the sanitizers or valgrind must report. */
#include <skep.h>

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int count, char **arguments) {
    const char *error = count == 2 ? arguments[1] : "";
    volatile int place = 10;
    if (strcmp(error, "overflow") == 0) {
        char *bytes = malloc((size_t)place);
        if (bytes) {
            memset(bytes, 'x', (size_t)place + 1);
            printf("%c\n", bytes[place - 1]);
        }
        free(bytes);
    } else if (strcmp(error, "leak") == 0) {
        void *volatile lost = malloc(1234);
        lost = NULL;
        (void)lost;
    } else if (strcmp(error, "library-leak") == 0) {
        skep_scene *volatile lost = NULL;
        skep_scene *scene = NULL;
        if (skep_scene_create(&scene) == SKEP_OK) {
            lost = scene;
            lost = NULL;
            scene = NULL;
        }
        (void)lost;
    } else if (strcmp(error, "library-overflow") == 0) {
        /* The library reads memory that is smaller than was said. */
        skep_packed_image *samples = NULL;
        unsigned char *pixels = malloc(12);
        const skep_image image = {pixels, 4, 4, 4, SKEP_FORMAT_GRAY};
        memset(pixels, 7, 12);
        printf("%d\n", (int)skep_packed_image_create(&image, &samples));
        skep_packed_image_destroy(samples);
        free(pixels);
    } else if (strcmp(error, "undefined") == 0) {
        place = INT_MAX;
        place = place + 1;
        printf("%d\n", place);
    } else {
        fprintf(stderr, "usage: %s overflow|leak|library-leak|library-overflow|undefined\n",
                arguments[0]);
        return 2;
    }
    return 0;
}
