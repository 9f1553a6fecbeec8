// Patch correlation against cv::remap and cv::matchTemplate, and against the same done in doubles.
#include "pictures.hpp"

#include <limits>

static constexpr int width = 320, height = 240, radius = 5;

/// Turned, stretched and slanted a little about the patch, and moved by some pixels.
static skep::Homography random_homography(cv::RNG &random, const skep::Pixel &pixel) {
    const double angle = random.uniform(-0.3, 0.3), scale = random.uniform(0.8, 1.25);
    const cv::Matx33d there(1, 0, pixel[0] + random.uniform(-6.0, 6.0), 0, 1,
                            pixel[1] + random.uniform(-6.0, 6.0), 0, 0, 1);
    const cv::Matx33d turn(scale * std::cos(angle), -std::sin(angle), 0, std::sin(angle),
                           std::cos(angle) / scale, 0, random.uniform(-2e-3, 2e-3),
                           random.uniform(-2e-3, 2e-3), 1);
    const cv::Matx33d back(1, 0, -double(pixel[0]), 0, 1, -double(pixel[1]), 0, 0, 1);
    return skep::homography(there * turn * back);
}

struct Differences {
    double from_exact = 0, mean_from_exact = 0, from_opencv = 0, mean_from_opencv = 0,
           largest_bound = 0;
};

static Differences compare(const cv::Mat &reference, const cv::Mat &source, int step,
                           const std::vector<skep::Pixel> &pixels,
                           const std::vector<skep::Homography> &homographies) {
    const double alike = std::numeric_limits<double>::infinity();
    const skep::NccWindow window =
        skep::NccWindow::create(radius, std::uint32_t(step), alike, alike);
    std::vector<float> ncc(pixels.size());
    skep::patch_ncc(window, skep::PackedImage::create(reference), skep::PackedImage::create(source),
                    pixels, homographies, ncc);

    const int side = 2 * radius / step + 1;
    cv::Mat real_source, patch(side, side, CV_32F), map_x = patch.clone(), map_y = patch.clone(),
                                                    seen, result;
    source.convertTo(real_source, CV_32F); // so that results are not rounded to whole grays
    Differences out;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        cv::Mat exact(side, side, CV_64F), error(side, side, CV_64F), own(side, side, CV_64F);
        for (int row = 0; row < side; ++row) {
            for (int column = 0; column < side; ++column) {
                const int x = int(pixels[i][0]) - radius + step * column;
                const int y = int(pixels[i][1]) - radius + step * row;
                const cv::Point2d at = apply(homographies[i], x, y);
                own.at<double>(row, column) = reference.at<std::uint8_t>(y, x);
                patch.at<float>(row, column) = reference.at<std::uint8_t>(y, x);
                map_x.at<float>(row, column) = float(at.x),
                                     map_y.at<float>(row, column) = float(at.y);
                exact.at<double>(row, column) = sample(source, at);
                error.at<double>(row, column) = rounding_bound(source, at);
            }
        }
        cv::remap(real_source, seen, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
        cv::matchTemplate(seen, patch, result, cv::TM_CCOEFF_NORMED);
        own -= cv::mean(own)[0], exact -= cv::mean(exact)[0];
        const double expected = own.dot(exact) / (cv::norm(own) * cv::norm(exact));
        // Unit vectors change by at most twice the relative change of what they are made from, and
        // so does their product with another; 1e-4 more is for the single precision of both sides.
        // The library's places are off by up to 1/256 px, a quarter of what OpenCV's are.
        const double change = 2 * cv::norm(error) / cv::norm(exact);
        const double own_bound = change / 4 + 1e-4, bound = change + own_bound;
        const double from_exact = std::abs(double(ncc[i]) - expected);
        CHECK(from_exact <= own_bound);
        const double difference = std::abs(double(ncc[i]) - result.at<float>(0, 0));
        CHECK(difference <= bound);
        out.from_exact = std::max(out.from_exact, from_exact);
        out.mean_from_exact += from_exact / double(pixels.size());
        out.from_opencv = std::max(out.from_opencv, difference);
        out.mean_from_opencv += difference / double(pixels.size());
        out.largest_bound = std::max(out.largest_bound, bound);
    }
    return out;
}

int main() {
    const cv::Mat reference = texture(width, height, 1.5, 1);
    cv::Mat source, noise(height, width, CV_8U);
    cv::RNG random(2);
    random.fill(noise, cv::RNG::UNIFORM, 0, 20);
    cv::addWeighted(reference, 0.8, noise, 1, 10, source);
    std::vector<skep::Pixel> pixels;
    std::vector<skep::Homography> homographies;
    for (int i = 0; i < 2000; ++i) {
        pixels.push_back({std::uint32_t(random.uniform(30, width - 30)),
                          std::uint32_t(random.uniform(30, height - 30))});
        homographies.push_back(random_homography(random, pixels.back()));
    }
    for (int step : {1, 2}) {
        const Differences found = compare(reference, source, step, pixels, homographies);
        std::printf(
            "ncc, step %d: from doubles %.1e in the mean, %.1e at most; from OpenCV %.1e in "
            "the mean, %.1e at most, where "
            "rounding places to 1/32 px allows up to %.1e\n",
            step, found.mean_from_exact, found.from_exact, found.mean_from_opencv,
            found.from_opencv, found.largest_bound);
        CHECK(found.mean_from_exact < 2e-4);
        CHECK(found.mean_from_opencv < 2e-3);
    }
}
