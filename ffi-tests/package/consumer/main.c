/* consumer VERSION: calls something of each kind in the library, which must be of that version. */
#include <math.h>
#include <skep.h>
#include <stdio.h>
#include <string.h>

static int expect(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "consumer: %s\n", what);
    }
    return holds ? 0 : 1;
}

int main(int argc, char **argv)
{
    const skep_camera camera = {
        100.0, 100.0, 50.0, 40.0, {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}, {0.0, 0.0, 0.0},
    };
    const double normal[3] = {0.0, 0.0, -1.0};
    skep_plane plane = {{0.0, 0.0, 0.0}, 0.0};
    skep_scene *scene = NULL;
    skep_result *result = NULL;
    char text[256] = "";
    int failures = 0;

    failures += expect(
        argc == 2 && strcmp(skep_version(), argv[1]) == 0, "another version was installed");
    failures += expect(
        skep_abi_version() == SKEP_ABI_VERSION, "header and library do not fit together");

    /* A plane that faces the camera lies as far away as its points are deep. */
    failures += expect(
        skep_plane_through(&camera, 10.0, 20.0, 3.0, normal, &plane) == SKEP_OK,
        "a plane is refused");
    failures += expect(fabs(plane.distance - 3.0) < 1e-12, "a plane lies elsewhere");

    /* Objects, failures and their texts. */
    failures += expect(skep_scene_create(&scene) == SKEP_OK && scene != NULL, "no scene is made");
    failures += expect(
        skep_reconstruct(scene, NULL, NULL, NULL, &result) == SKEP_ERR_ARGUMENT,
        "an empty scene is accepted");
    failures += expect(result == NULL, "a call that failed wrote its output");
    failures += expect(
        skep_last_error(text, sizeof text) > 1 && text[0] != '\0', "a failure has no text");
    skep_scene_destroy(scene);
    return failures == 0 ? 0 : 1;
}
