// The homographies of planes against OpenCV's projections, its estimate from points, and its
// warping.
#include "../cpp/world.hpp"
#include "pictures.hpp"

#include <opencv2/calib3d.hpp>

static constexpr int width = 160, height = 120;

static cv::Matx33d intrinsics(const skep_camera &camera) {
    return {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
}

/// Places of a grid of reference pixels' plane points in the source view, by cv::projectPoints.
static std::vector<cv::Point2d> projected(const skep_camera &reference, const skep_camera &source,
                                          const skep_plane &plane,
                                          const std::vector<cv::Point2d> &pixels) {
    const cv::Vec3d normal(plane.normal);
    const cv::Matx33d reference_rotation(reference.rotation), source_rotation(source.rotation);
    const cv::Matx33d rotation = source_rotation * reference_rotation.t();
    const cv::Vec3d translation =
        cv::Vec3d(source.translation) - rotation * cv::Vec3d(reference.translation);
    std::vector<cv::Point3d> points;
    for (const cv::Point2d &pixel : pixels) {
        const cv::Vec3d ray((pixel.x - reference.cx) / reference.fx,
                            (pixel.y - reference.cy) / reference.fy, 1);
        points.emplace_back(-plane.distance / normal.dot(ray) * ray);
    }
    cv::Vec3d turn;
    cv::Rodrigues(rotation, turn);
    std::vector<cv::Point2d> places;
    cv::projectPoints(points, turn, translation, intrinsics(source), cv::noArray(), places);
    return places;
}

static void test_against_projections() {
    const skep_camera reference = world::camera(0.3, width, height);
    std::vector<cv::Point2d> pixels;
    for (int y = 0; y < height; y += 17)
        for (int x = 0; x < width; x += 13)
            pixels.emplace_back(x + 0.25, y - 0.5);
    cv::RNG random(1);
    double most = 0, most_found = 0;
    for (int round = 0; round < 50; ++round) {
        skep_camera source = world::camera(random.uniform(-1.5, 1.5), width, height);
        source.fx *= random.uniform(0.8, 1.2), source.translation[1] += random.uniform(-0.5, 0.5);
        const cv::Vec3d direction =
            cv::normalize(cv::Vec3d(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), -1));
        const skep_plane plane = skep::plane_through(reference, random.uniform(0.0, 1.0 * width),
                                                     random.uniform(0.0, 1.0 * height),
                                                     random.uniform(3.0, 9.0), direction);
        const skep::Homography h =
            skep::plane_homographies(reference, source, skep::Span<const skep_plane>(&plane, 1))[0];
        const auto places = projected(reference, source, plane, pixels);
        const skep::Homography found = skep::homography(cv::findHomography(pixels, places));
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const cv::Point2d ours = apply(h, pixels[i].x, pixels[i].y);
            most = std::max(most, cv::norm(ours - places[i]));
            most_found =
                std::max(most_found, cv::norm(ours - apply(found, pixels[i].x, pixels[i].y)));
        }
    }
    std::printf(
        "homographies: at most %.1e px from cv::projectPoints, %.1e px from cv::findHomography\n",
        most, most_found);
    CHECK(most < 1e-6);
    // cv::findHomography takes points in single precision: places up to 256 px are rounded by up to
    // 2^-17 px.
    CHECK(most_found < std::ldexp(1, -17));
}

/// H takes reference pixels to source pixels, so cv::warpPerspective takes it as an inverse map.
static void test_against_warp() {
    const skep_camera reference = world::camera(0, width, height),
                      source = world::camera(0.8, width, height);
    const skep_plane wall = skep::plane_through(reference, 70, 50, world::depth(reference, 70, 50),
                                                world::normal(reference));
    const skep::Homography h =
        skep::plane_homographies(reference, source, skep::Span<const skep_plane>(&wall, 1))[0];
    const auto source_pixels = world::picture(source, width, height);
    const auto reference_pixels = world::picture(reference, width, height);
    const cv::Mat seen(height, width, CV_8U, const_cast<std::uint8_t *>(source_pixels.data()));
    cv::Mat matrix, warped;
    skep::assign(h, matrix);
    cv::warpPerspective(seen, warped, matrix, {width, height},
                        cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);

    // The exact warp by H may differ by the rounding of places and, half a gray, of the result;
    // weights have 15 bits.
    double most = 0, from_exact = 0, from_truth = 0, unwarped = 0;
    int inside = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const cv::Point2d at = apply(h, x, y);
            if (at.x < 1 || at.y < 1 || at.x > width - 2 || at.y > height - 2)
                continue;
            const int gray = warped.at<std::uint8_t>(y, x),
                      truth = reference_pixels[std::size_t(y * width + x)];
            const double difference = std::abs(gray - sample(seen, at));
            CHECK(difference <= rounding_bound(seen, at) + 0.51);
            most = std::max(most, difference), from_exact += difference;
            from_truth += std::abs(gray - truth);
            unwarped += std::abs(seen.at<std::uint8_t>(y, x) - truth);
            ++inside;
        }
    }
    std::printf("warps: from the exact warp %.3f grays in the mean, %.2f at most; from what the "
                "camera sees %.2f, "
                "without warping %.2f (%d pixels)\n",
                from_exact / inside, most, from_truth / inside, unwarped / inside, inside);
    CHECK(inside > width * height / 2);
    // The source image, warped into the reference, is the reference image.
    CHECK(from_truth / inside < 1.5 && unwarped / inside > 10 * from_truth / inside);
}

int main() {
    test_against_projections();
    test_against_warp();
}
