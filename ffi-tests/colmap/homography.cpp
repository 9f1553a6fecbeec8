// Homographies that planes induce: COLMAP's formula and COLMAP's warp against ours.
#include "colmap.hpp"

#include <base/homography_matrix.h>
#include <base/warp.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <vector>

namespace {

using check::must;
using check::Owned;
using Matrix = Eigen::Matrix3d;
using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

// Maps the library's pixels to COLMAP's.
Matrix half_a_pixel() {
    Matrix shift = Matrix::Identity();
    shift(0, 2) = shift(1, 2) = half_pixel;
    return shift;
}

Matrix calibration_matrix(const skep_camera &camera) {
    Matrix matrix;
    matrix << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
    return matrix;
}

// From pixels of the reference to pixels of the source, in the library's convention.
Matrix our_homography(const skep_camera &reference, const skep_camera &source,
                      const skep_plane &plane) {
    RowMajor homography;
    must(skep_plane_homographies(&reference, &source, &plane, 1, homography.data()));
    return homography;
}

// The same by COLMAP, in COLMAP's pixels. Its planes are normal . X = -distance too, which its
// documentation leaves open.
Matrix their_homography(const skep_camera &reference, const skep_camera &source,
                        const skep_plane &plane) {
    const Matrix rotation = rotation_of(source) * rotation_of(reference).transpose();
    const Eigen::Vector3d translation =
        translation_of(source) - rotation * translation_of(reference);
    return colmap::HomographyMatrixFromPose(
        half_a_pixel() * calibration_matrix(reference), half_a_pixel() * calibration_matrix(source),
        rotation, translation, Eigen::Vector3d(plane.normal), plane.distance);
}

double relative_difference(const Matrix &a, const Matrix &b) {
    return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

void formulas_agree() {
    std::printf("formulas\n");
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    double largest = 0, without_shift = 1;
    for (int trial = 0; trial < 1000; ++trial) {
        skep_camera cameras[2];
        for (skep_camera &camera : cameras) {
            camera.fx = 100 + 1000 * unit(random);
            camera.fy = 100 + 1000 * unit(random);
            camera.cx = 1000 * unit(random);
            camera.cy = 1000 * unit(random);
            const Matrix rotation = random_rotation(random);
            place(camera, rotation, 10 * (rotation * random_rotation(random)).col(0));
        }
        skep_plane plane = {{}, 0.1 + 10 * unit(random)};
        Eigen::Map<Eigen::Vector3d>(plane.normal) = random_rotation(random).col(0);
        const Matrix ours = our_homography(cameras[0], cameras[1], plane);
        const Matrix theirs = their_homography(cameras[0], cameras[1], plane);
        const Matrix shifted = half_a_pixel() * ours * half_a_pixel().inverse();
        largest = std::max(largest, relative_difference(shifted, theirs));
        without_shift = std::min(without_shift, relative_difference(ours, theirs));
    }
    check::expect_at_most(largest, 1e-9, "1000 homographies differ, relatively, by");
    std::printf("  without the half pixel at least by %.3g\n", without_shift);
    EXPECT(without_shift > 1e-7);
}

struct Gray {
    uint32_t width;
    uint32_t height;
    std::vector<uint8_t> values;
};

Gray gray_of(const scene::View &view) {
    Gray gray = {view.width, view.height, {}};
    for (size_t pixel = 0; pixel < view.rgb.size(); pixel += 3) {
        gray.values.push_back((view.rgb[pixel] + view.rgb[pixel + 1] + view.rgb[pixel + 2]) / 3);
    }
    return gray;
}

// COLMAP's warp of an image by a homography, into the pixels of another.
Gray warp(const Gray &image, const Matrix &homography, uint32_t width, uint32_t height) {
    colmap::Bitmap source, target;
    source.Allocate(image.width, image.height, false);
    target.Allocate(width, height, false);
    for (size_t pixel = 0; pixel < image.values.size(); ++pixel) {
        source.SetPixel(pixel % image.width, pixel / image.width,
                        colmap::BitmapColor<uint8_t>(image.values[pixel]));
    }
    colmap::WarpImageWithHomography(homography, source, &target);
    Gray warped = {width, height, {}};
    for (size_t pixel = 0; pixel < size_t{width} * height; ++pixel) {
        colmap::BitmapColor<uint8_t> color;
        target.GetPixel(pixel % width, pixel / width, &color);
        warped.values.push_back(color.r);
    }
    return warped;
}

// The library's correlation of patches at these pixels.
std::vector<float> correlate(const Gray &reference, const Gray &source,
                             const std::vector<uint32_t> &pixels, const Matrix &homography) {
    Owned<skep_packed_image> samples[] = {{nullptr, skep_packed_image_destroy},
                                          {nullptr, skep_packed_image_destroy}};
    const Gray *images[] = {&reference, &source};
    for (int side = 0; side < 2; ++side) {
        const Gray &gray = *images[side];
        const skep_image image = {gray.values.data(), gray.width, gray.height, gray.width,
                                  SKEP_FORMAT_GRAY};
        skep_packed_image *made = nullptr;
        must(skep_packed_image_create(&image, &made));
        samples[side].reset(made);
    }
    skep_ncc_window *window = nullptr;
    must(skep_ncc_window_create(5, 1, 3, 0.1, 1e-5, &window));
    const Owned<skep_ncc_window> owned(window, skep_ncc_window_destroy);
    const size_t count = pixels.size() / 2;
    const RowMajor row_major = homography;
    std::vector<double> homographies;
    for (size_t patch = 0; patch < count; ++patch) {
        homographies.insert(homographies.end(), row_major.data(), row_major.data() + 9);
    }
    std::vector<float> correlation(count);
    must(skep_patch_ncc(window, samples[0].get(), samples[1].get(), pixels.data(),
                        homographies.data(), count, correlation.data()));
    return correlation;
}

// The correlation of a patch with its image by a homography equals that with the same pixels of the
// image that COLMAP warped by this homography, up to the rounding of that image to whole gray
// values.
void warps_agree() {
    const scene::Scene made = scene::make();
    const scene::View &reference = made.views[0];
    const Gray reference_gray = gray_of(reference);
    for (const uint32_t other : {1u, 4u}) {
        const scene::View &source = made.views[other];
        std::printf("warp of %s to %s\n", source.name.c_str(), reference.name.c_str());
        const Gray source_gray = gray_of(source);
        // A plane about where the wall is.
        skep_plane plane;
        const double normal[] = {-0.2, -0.1, -std::sqrt(0.95)};
        must(skep_plane_through(&reference.camera, 80, 60, 4.6, normal, &plane));
        const Matrix ours = our_homography(reference.camera, source.camera, plane);
        const Matrix theirs = half_a_pixel() * ours * half_a_pixel().inverse();

        std::vector<uint32_t> pixels;
        for (uint32_t y = 6; y < reference.height - 6; y += 3) {
            for (uint32_t x = 6; x < reference.width - 6; x += 3) {
                // COLMAP leaves black what it finds outside: the whole patch must be inside.
                bool inside = true;
                for (int corner = 0; corner < 4; ++corner) {
                    const Eigen::Vector3d at(x + (corner % 2 ? 6.0 : -6.0),
                                             y + (corner / 2 ? 6.0 : -6.0), 1);
                    const Eigen::Vector2d image = (ours * at).hnormalized();
                    inside = inside && image.minCoeff() >= 0 && image.x() < source.width - 1 &&
                             image.y() < source.height - 1;
                }
                if (inside) {
                    pixels.insert(pixels.end(), {x, y});
                }
            }
        }
        const std::vector<float> direct = correlate(reference_gray, source_gray, pixels, ours);
        const auto difference = [&](const Matrix &homography) {
            const Gray warped = warp(source_gray, homography, reference.width, reference.height);
            const std::vector<float> indirect =
                correlate(reference_gray, warped, pixels, Matrix::Identity());
            double largest = 0;
            for (size_t patch = 0; patch < direct.size(); ++patch) {
                largest = std::max(largest, std::abs(double(direct[patch]) - indirect[patch]));
            }
            return largest;
        };
        std::printf("  %zu patches, best correlation %.4f\n", direct.size(),
                    *std::max_element(direct.begin(), direct.end()));
        EXPECT(direct.size() > 500);
        check::expect_at_most(difference(theirs), 0.02, "correlations differ by");
        const double wrong = difference(ours);
        std::printf("  without the half pixel by %.3g\n", wrong);
        EXPECT(wrong > 0.05);
    }
}

} // namespace

int main() {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        formulas_agree();
        warps_agree();
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return check::finish();
}
