/* scene BOARD SCENE: writes the scene of a folder with its photographs reduced to 128 pixels. */
#include <skep.h>
#include <stdio.h>

int main(int count, char **arguments) {
    skep_options *options = NULL;
    skep_scene *scene = NULL;
    char text[500];
    int done = count == 3 && skep_options_create("default", &options) == SKEP_OK
        && skep_options_set(options, "input.max_image_size", 128) == SKEP_OK
        && skep_scene_read(arguments[1], options, 0, 0, NULL, NULL, &scene) == SKEP_OK
        && skep_scene_write_colmap(scene, arguments[2]) == SKEP_OK;
    if (!done && skep_last_error(text, sizeof text)) fprintf(stderr, "%s\n", text);
    skep_scene_destroy(scene);
    skep_options_destroy(options);
    return !done;
}
