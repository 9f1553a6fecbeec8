// A synthetic scene with exact surfaces, and the library's result.
#pragma once

#include "check.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace scene {

using Vector = std::array<double, 3>;

struct View {
    std::string name;
    uint32_t width;
    uint32_t height;
    skep_camera camera;
    std::vector<uint8_t> rgb;
};

struct Point {
    Vector position;
    std::vector<uint32_t> views;
};

// A box and a ball in front of a slanted wall, textured all over, in six photographs of two sizes.
struct Scene {
    std::vector<View> views;
    std::vector<Point> points;
};

Scene make();

// How far a point is from the nearest surface.
double distance_to_surface(const Vector &point);

Vector center(const skep_camera &camera);

// The pixel a point is seen at, and its depth as third number.
Vector project(const skep_camera &camera, const Vector &point);

// The scene as the library's object.
check::Owned<skep_scene> hand_over(const Scene &scene);

// The scene with its result, and a folder with all that the library writes of both.
struct Workspace {
    Scene made;
    check::Owned<skep_scene> scene;
    check::Owned<skep_result> result;
    check::Owned<skep_cloud> cloud;
    std::string folder;
};

// Reconstructs the scene and writes it into the folder, which must not be there.
Workspace reconstruct_into(const std::string &folder);

// A new folder of this name in the current one; what was there is gone.
std::string empty_folder(const std::string &name);

} // namespace scene
