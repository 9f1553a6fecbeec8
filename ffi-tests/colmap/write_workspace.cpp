// Writes the scene, and the workspace that the library makes of it through its C ABI:
//   write-workspace FOLDER    makes FOLDER/scene (images and model) and FOLDER/workspace (these and
//   the results)
#include "scene.hpp"

#include <exception>

int main(int argument_count, char **arguments)
{
    if (argument_count != 2) {
        std::fprintf(stderr, "usage: write-workspace FOLDER\n");
        return 2;
    }
    try {
        const std::string folder = scene::empty_folder(arguments[1]);
        const scene::Workspace workspace = scene::reconstruct_into(folder + "/workspace");
        check::must(skep_scene_write_colmap(workspace.scene.get(), (folder + "/scene").c_str()));
    } catch (const std::exception &error) {
        std::fprintf(stderr, "write-workspace: %s\n", error.what());
        return 1;
    }
    return 0;
}
