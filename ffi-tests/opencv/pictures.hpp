// Helpers of the tests against OpenCV: synthetic pictures, and exact arithmetic on them in doubles.
#pragma once

#include "../cpp/test.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

/// Smoothed noise that uses most of the grays, 8 bits a pixel.
inline cv::Mat texture(int width, int height, double smoothness, std::uint64_t seed) {
    cv::Mat noise(height, width, CV_32F), out;
    cv::RNG random(seed);
    random.fill(noise, cv::RNG::NORMAL, 0, 1);
    cv::GaussianBlur(noise, noise, {}, smoothness);
    cv::Scalar mean, deviation;
    cv::meanStdDev(noise, mean, deviation);
    noise.convertTo(out, CV_8U, 45 / deviation[0], 127);
    return out;
}

/// The image of a pixel by a homography.
inline cv::Point2d apply(const skep::Homography &h, double x, double y) {
    const double z = h[6] * x + h[7] * y + h[8];
    return {(h[0] * x + h[1] * y + h[2]) / z, (h[3] * x + h[4] * y + h[5]) / z};
}

/// Bilinear sample of an 8-bit picture; beyond the border it repeats.
inline double sample(const cv::Mat &picture, cv::Point2d at) {
    const double x = std::clamp(at.x, 0.0, picture.cols - 1.0);
    const double y = std::clamp(at.y, 0.0, picture.rows - 1.0);
    const int column = std::min(int(x), picture.cols - 2), row = std::min(int(y), picture.rows - 2);
    const double right = x - column, low = y - row;
    const auto *above = picture.ptr(row) + column, *below = picture.ptr(row + 1) + column;
    return (1 - low) * ((1 - right) * above[0] + right * above[1]) +
           low * ((1 - right) * below[0] + right * below[1]);
}

/// The most a bilinear sample can change when its place is rounded to 1/32 of a pixel, as OpenCV's
/// fixed-point interpolation does: half of that in each axis, times the steepest slopes around.
inline double rounding_bound(const cv::Mat &picture, cv::Point2d at) {
    const int left = std::max(int(std::floor(at.x)) - 1, 0),
              top = std::max(int(std::floor(at.y)) - 1, 0);
    const int right = std::min(left + 3, picture.cols - 1),
              bottom = std::min(top + 3, picture.rows - 1);
    int across = 0, down = 0;
    for (int y = top; y <= bottom; ++y) {
        for (int x = left; x <= right; ++x) {
            const int gray = picture.at<std::uint8_t>(y, x);
            if (x < right)
                across = std::max(across, std::abs(picture.at<std::uint8_t>(y, x + 1) - gray));
            if (y < bottom)
                down = std::max(down, std::abs(picture.at<std::uint8_t>(y + 1, x) - gray));
        }
    }
    return (across + down) / 64.0;
}
