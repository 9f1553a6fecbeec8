#include "scene.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

namespace scene {
namespace {

// The surfaces, in world units: the wall is the plane wall_normal . X = wall_distance.
const Vector wall_normal = {0.2 / std::sqrt(1.08), 0.2 / std::sqrt(1.08), 1 / std::sqrt(1.08)};
const double wall_distance = 4.8;
const Vector ball_center = {0.7, -0.25, 3.9};
const double ball_radius = 0.6;
const Vector box_low = {-1.2, -0.3, 3.7};
const Vector box_high = {-0.3, 0.6, 4.5};

Vector plus(const Vector &a, const Vector &b, double factor) {
    return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

double dot(const Vector &a, const Vector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector &a, const Vector &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector unit(const Vector &a) { return plus({0, 0, 0}, a, 1 / std::sqrt(dot(a, a))); }

// How far along a ray, in multiples of its direction, the first surface is; the wall ends every
// ray.
double first_hit(const Vector &from, const Vector &direction) {
    double nearest = (wall_distance - dot(wall_normal, from)) / dot(wall_normal, direction);

    const Vector to_ball = plus(ball_center, from, -1);
    const double along = dot(to_ball, direction), square = dot(direction, direction);
    const double root =
        along * along - square * (dot(to_ball, to_ball) - ball_radius * ball_radius);
    if (root > 0) {
        nearest = std::min(nearest, (along - std::sqrt(root)) / square);
    }

    double enter = 0, leave = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double low = (box_low[axis] - from[axis]) / direction[axis];
        const double high = (box_high[axis] - from[axis]) / direction[axis];
        enter = std::max(enter, std::min(low, high));
        leave = std::min(leave, std::max(low, high));
    }
    return enter < leave ? std::min(nearest, enter) : nearest;
}

// A number in [0, 1) for a corner of the grid.
double corner(int x, int y, int z, uint32_t seed) {
    uint32_t hash = seed * 0x9E3779B9u;
    for (int coordinate : {x, y, z}) {
        hash = (hash ^ static_cast<uint32_t>(coordinate)) * 0x85EBCA6Bu;
        hash ^= hash >> 15;
    }
    return (hash >> 8) / 16777216.0;
}

// Random values at the corners of a cubic grid, blended in between.
double noise(const Vector &point, double cell, uint32_t seed) {
    int base[3];
    double part[3];
    for (int axis = 0; axis < 3; ++axis) {
        base[axis] = static_cast<int>(std::floor(point[axis] / cell));
        part[axis] = point[axis] / cell - base[axis];
    }
    double sum = 0;
    for (int x = 0; x < 2; ++x) {
        for (int y = 0; y < 2; ++y) {
            for (int z = 0; z < 2; ++z) {
                sum += corner(base[0] + x, base[1] + y, base[2] + z, seed) *
                       (x ? part[0] : 1 - part[0]) * (y ? part[1] : 1 - part[1]) *
                       (z ? part[2] : 1 - part[2]);
            }
        }
    }
    return sum;
}

double brightness(const Vector &point, uint32_t channel) {
    return 0.4 * noise(point, 0.07, 1) + 0.3 * noise(point, 0.15, 2) +
           0.3 * noise(point, 0.4, 3 + channel);
}

// The direction, in the world, in which a camera sees a pixel; its depth is 1.
Vector ray(const skep_camera &camera, double x, double y) {
    const Vector seen = {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1};
    Vector direction;
    for (int axis = 0; axis < 3; ++axis) {
        direction[axis] = camera.rotation[axis] * seen[0] + camera.rotation[3 + axis] * seen[1] +
                          camera.rotation[6 + axis] * seen[2];
    }
    return direction;
}

// A camera at a place that looks at another, upright but for a small turn about its axis.
skep_camera look_at(const Vector &from, const Vector &at, double turn) {
    const Vector forward = unit(plus(at, from, -1));
    const Vector right = unit(cross({std::sin(turn), std::cos(turn), 0}, forward));
    const Vector rows[3] = {right, cross(forward, right), forward};
    skep_camera camera = {};
    for (int row = 0; row < 3; ++row) {
        std::copy(rows[row].begin(), rows[row].end(), camera.rotation + 3 * row);
        camera.translation[row] = -dot(rows[row], from);
    }
    return camera;
}

void photograph(View &view) {
    const Vector from = center(view.camera);
    const int grid = 3;
    view.rgb.clear();
    for (uint32_t y = 0; y < view.height; ++y) {
        for (uint32_t x = 0; x < view.width; ++x) {
            double sum[3] = {0, 0, 0};
            for (int sample = 0; sample < grid * grid; ++sample) {
                const Vector direction = ray(view.camera, x + (sample % grid + 0.5) / grid - 0.5,
                                             y + (sample / grid + 0.5) / grid - 0.5);
                const Vector point = plus(from, direction, first_hit(from, direction));
                for (uint32_t channel = 0; channel < 3; ++channel) {
                    sum[channel] += brightness(point, channel);
                }
            }
            for (double channel : sum) {
                view.rgb.push_back(static_cast<uint8_t>(255 * channel / (grid * grid)));
            }
        }
    }
}

bool sees(const View &view, const Vector &point) {
    const Vector pixel = project(view.camera, point), from = center(view.camera);
    const bool inside =
        pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] <= view.width - 1 && pixel[1] <= view.height - 1;
    return inside && first_hit(from, plus(point, from, -1)) > 1 - 1e-6;
}

} // namespace

Vector center(const skep_camera &camera) {
    Vector place;
    for (int axis = 0; axis < 3; ++axis) {
        place[axis] = 0;
        for (int row = 0; row < 3; ++row) {
            place[axis] -= camera.rotation[3 * row + axis] * camera.translation[row];
        }
    }
    return place;
}

Vector project(const skep_camera &camera, const Vector &point) {
    Vector seen;
    for (int row = 0; row < 3; ++row) {
        const double *turn = camera.rotation + 3 * row;
        seen[row] = dot({turn[0], turn[1], turn[2]}, point) + camera.translation[row];
    }
    return {camera.fx * seen[0] / seen[2] + camera.cx, camera.fy * seen[1] / seen[2] + camera.cy,
            seen[2]};
}

double distance_to_surface(const Vector &point) {
    const double wall = std::abs(dot(wall_normal, point) - wall_distance);
    const Vector from_ball = plus(point, ball_center, -1);
    const double ball = std::abs(std::sqrt(dot(from_ball, from_ball)) - ball_radius);
    double outside = 0, inside = -std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double beyond = std::max(box_low[axis] - point[axis], point[axis] - box_high[axis]);
        outside += std::pow(std::max(beyond, 0.0), 2);
        inside = std::max(inside, beyond);
    }
    const double box = inside > 0 ? std::sqrt(outside) : -inside;
    return std::min({wall, ball, box});
}

Scene make() {
    Scene scene;
    for (uint32_t index = 0; index < 6; ++index) {
        const double column = index % 3 - 1.0, row = index / 3 - 0.5;
        View view;
        // A folder in a name must come out as a folder.
        view.name = (index < 3 ? "upper/" : "lower/") + std::to_string(index) + ".png";
        // Sizes, focal lengths and principal points differ, so that none can stand in for another.
        view.width = index == 4 ? 148 : 160;
        view.height = index == 4 ? 128 : 120;
        view.camera = look_at({0.55 * column, 0.6 * row, 0.05 * column}, {0.1 * column, 0, 4.5},
                              0.05 * column);
        view.camera.fx = 150.5;
        view.camera.fy = 152.25;
        view.camera.cx = view.width / 2.0 - 1.75;
        view.camera.cy = view.height / 2.0 + 0.625;
        photograph(view);
        scene.views.push_back(view);
    }
    for (const View &view : scene.views) {
        const Vector from = center(view.camera);
        for (uint32_t y = 7; y < view.height; y += 15) {
            for (uint32_t x = 7; x < view.width; x += 15) {
                const Vector direction = ray(view.camera, x, y);
                Point point;
                point.position = plus(from, direction, first_hit(from, direction));
                for (uint32_t other = 0; other < scene.views.size(); ++other) {
                    if (sees(scene.views[other], point.position)) {
                        point.views.push_back(other);
                    }
                }
                if (point.views.size() >= 2) {
                    scene.points.push_back(point);
                }
            }
        }
    }
    return scene;
}

check::Owned<skep_scene> hand_over(const Scene &made) {
    skep_scene *handle = nullptr;
    check::must(skep_scene_create(&handle));
    check::Owned<skep_scene> scene(handle, skep_scene_destroy);
    for (const View &view : made.views) {
        const skep_image image = {view.rgb.data(), view.width, view.height, 3 * size_t{view.width},
                                  SKEP_FORMAT_RGB};
        check::must(
            skep_scene_add_view(scene.get(), view.name.c_str(), &image, &view.camera, nullptr));
    }
    for (const Point &point : made.points) {
        const uint32_t count = static_cast<uint32_t>(point.views.size());
        check::must(skep_scene_add_points(scene.get(), point.position.data(), 1, &count,
                                          point.views.data(), count));
    }
    return scene;
}

Workspace reconstruct_into(const std::string &folder) {
    Scene made = make();
    check::Owned<skep_scene> scene = hand_over(made);
    skep_options *options = nullptr;
    check::must(skep_options_create(nullptr, &options));
    check::Owned<skep_options> owned_options(options, skep_options_destroy);
    // COLMAP asks the same number of views of every point.
    check::must(skep_options_set(options, "fusion.min_agreeing_fraction", 0));
    skep_result *result = nullptr;
    check::must(skep_reconstruct(scene.get(), options, nullptr, nullptr, &result));
    check::Owned<skep_result> owned_result(result, skep_result_destroy);
    skep_cloud *cloud = nullptr;
    check::must(skep_result_get_cloud(result, &cloud));
    check::Owned<skep_cloud> owned_cloud(cloud, skep_cloud_destroy);
    check::must(skep_scene_write_colmap(scene.get(), folder.c_str()));
    check::must(skep_result_write_workspace(result, scene.get(), folder.c_str()));
    return {std::move(made), std::move(scene), std::move(owned_result), std::move(owned_cloud),
            folder};
}

std::string empty_folder(const std::string &name) {
    const std::filesystem::path folder = std::filesystem::absolute(name);
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    return folder.string();
}

} // namespace scene
