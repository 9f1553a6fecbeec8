// A synthetic scene: cameras in a row in front of a slanted textured wall, with exact depths and
// normals.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <skep.h>
#include <vector>

namespace world {

using Vector = std::array<double, 3>;

inline double dot(const Vector &a, const Vector &b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Unit normal of the wall, which goes through (0, 0, 5).
inline Vector wall_normal() {
    const double length = std::sqrt(0.2 * 0.2 + 0.1 * 0.1 + 1.0);
    return {0.2 / length, 0.1 / length, -1.0 / length};
}

/// Gray of the wall at a point, 0 to 255.
inline double gray(const Vector &p) {
    const double coarse = std::sin(7 * p[0] + 3 * p[1]) + std::sin(5 * p[1] - 3 * p[0] + 1);
    const double fine = std::sin(19 * p[0] - 11 * p[1] + 2) + std::sin(17 * p[1] + 13 * p[0]);
    return 127 + 32 * coarse + 24 * fine;
}

/// A camera at `x` on a line before the wall, turned towards its middle.
inline skep_camera camera(double x, std::uint32_t width, std::uint32_t height) {
    const double angle = std::atan(x / 5), c = std::cos(angle), s = std::sin(angle);
    skep_camera camera = {};
    camera.fx = 1.1 * width;
    camera.fy = 1.12 * width;
    camera.cx = 0.5 * (width - 1) + 0.25;
    camera.cy = 0.5 * (height - 1) - 0.25;
    const double rotation[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
    for (int i = 0; i < 9; ++i)
        camera.rotation[i] = rotation[i];
    for (int row = 0; row < 3; ++row)
        camera.translation[row] = -rotation[3 * row] * x;
    return camera;
}

/// The center of a camera, -R^T t.
inline Vector center(const skep_camera &camera) {
    Vector out = {};
    for (std::size_t i = 0; i < 9; ++i)
        out[i % 3] -= camera.rotation[i] * camera.translation[i / 3];
    return out;
}

/// The ray of a pixel in the world, with depth 1 along it.
inline Vector ray(const skep_camera &camera, double x, double y) {
    const Vector ray = {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1};
    Vector out = {};
    for (std::size_t i = 0; i < 9; ++i)
        out[i % 3] += camera.rotation[i] * ray[i / 3];
    return out;
}

/// Depth of the wall at a pixel.
inline double depth(const skep_camera &camera, double x, double y) {
    const Vector from = center(camera), normal = wall_normal();
    return dot(normal, {-from[0], -from[1], 5 - from[2]}) / dot(normal, ray(camera, x, y));
}

/// The wall's normal in a camera's frame.
inline Vector normal(const skep_camera &camera) {
    const Vector normal = wall_normal();
    Vector out = {};
    for (std::size_t i = 0; i < 9; ++i)
        out[i / 3] += camera.rotation[i] * normal[i % 3];
    return out;
}

/// The image of a camera, 8 bits a pixel.
inline std::vector<std::uint8_t> picture(const skep_camera &camera, std::uint32_t width,
                                         std::uint32_t height) {
    const Vector from = center(camera);
    std::vector<std::uint8_t> out;
    out.reserve(std::size_t(width) * height);
    for (std::uint32_t y = 0; y < height; ++y) {
        for (std::uint32_t x = 0; x < width; ++x) {
            const Vector along = ray(camera, x, y);
            const double far = depth(camera, x, y);
            Vector point = {};
            for (std::size_t i = 0; i < 3; ++i)
                point[i] = from[i] + far * along[i];
            out.push_back(std::uint8_t(std::lround(gray(point))));
        }
    }
    return out;
}

/// Positions of the cameras.
constexpr std::array<double, 5> places = {0.0, 0.8, -0.8, 1.4, -1.4};
constexpr std::uint32_t width = 56, height = 42;

} // namespace world
