// What several tests need of COLMAP.
#pragma once

#include "scene.hpp"

#include <base/reconstruction.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <fstream>
#include <iterator>
#include <random>
#include <string>

// COLMAP puts the center of the top-left pixel at (0.5, 0.5), the library at (0, 0).
const double half_pixel = 0.5;

inline Eigen::Matrix3d rotation_of(const skep_camera &camera) {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(camera.rotation);
}

inline Eigen::Vector3d translation_of(const skep_camera &camera) {
    return Eigen::Map<const Eigen::Vector3d>(camera.translation);
}

// fx, fy, cx, cy of a camera of COLMAP's, in the library's pixels.
inline Eigen::Vector4d calibration_of(const colmap::Camera &camera) {
    const Eigen::Matrix3d matrix = camera.CalibrationMatrix();
    return {matrix(0, 0), matrix(1, 1), matrix(0, 2) - half_pixel, matrix(1, 2) - half_pixel};
}

inline Eigen::Vector4d calibration_of(const skep_camera &camera) {
    return {camera.fx, camera.fy, camera.cx, camera.cy};
}

// Rotations of every size are as likely.
inline Eigen::Matrix3d random_rotation(std::mt19937 &random) {
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
        .normalized()
        .toRotationMatrix();
}

inline void place(skep_camera &camera, const Eigen::Matrix3d &rotation,
                  const Eigen::Vector3d &translation) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(camera.rotation) = rotation;
    Eigen::Map<Eigen::Vector3d>(camera.translation) = translation;
}

inline std::string bytes_of(const std::string &file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}
