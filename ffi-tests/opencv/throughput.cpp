// Patches a second beside OpenCV's on one thread: this header's batch against a homography's map,
// cv::remap and cv::matchTemplate for each patch.
#include "pictures.hpp"

#include <chrono>
#include <limits>

static constexpr int width = 640, height = 480, radius = 5;
static constexpr int patches = 4096, rounds = 15;

template <class Work> static double seconds(Work work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Batch {
    cv::Mat reference = texture(width, height, 1.5, 1), source = texture(width, height, 1.5, 1);
    std::vector<skep::Pixel> pixels;
    std::vector<skep::Homography> homographies;
};

/// Hypotheses of the same pixel follow each other, and share the reference's side.
static Batch made_batch(int hypotheses) {
    Batch batch;
    cv::RNG random(3);
    for (int i = 0; i < patches; ++i) {
        if (i % hypotheses == 0)
            batch.pixels.push_back({std::uint32_t(random.uniform(30, width - 30)),
                                    std::uint32_t(random.uniform(30, height - 30))});
        else
            batch.pixels.push_back(batch.pixels.back());
        const double slant = random.uniform(-0.2, 0.2), shift = random.uniform(-4.0, 4.0);
        const double x = batch.pixels.back()[0];
        batch.homographies.push_back(
            {1 + slant, 0, shift - slant * x, 0, 1, 0, 1e-5, 0, 1 - 1e-5 * x});
    }
    return batch;
}

static void correlate_with_opencv(const Batch &batch, int step, std::vector<float> &ncc) {
    skep::Pixel at_work = {};
    const int side = 2 * radius / step + 1;
    cv::Mat map_x(side, side, CV_32F), map_y(side, side, CV_32F);
    cv::Mat patch(side, side, CV_8U), seen, result;
    for (std::size_t i = 0; i < batch.pixels.size(); ++i) {
        const int left = int(batch.pixels[i][0]) - radius, top = int(batch.pixels[i][1]) - radius;
        if (i == 0 || batch.pixels[i] != at_work) {
            at_work = batch.pixels[i];
            for (int row = 0; row < side; ++row)
                for (int column = 0; column < side; ++column)
                    patch.at<std::uint8_t>(row, column) =
                        batch.reference.at<std::uint8_t>(top + step * row, left + step * column);
        }
        for (int row = 0; row < side; ++row) {
            float *x = map_x.ptr<float>(row), *y = map_y.ptr<float>(row);
            for (int column = 0; column < side; ++column) {
                const cv::Point2d at =
                    apply(batch.homographies[i], left + step * column, top + step * row);
                x[column] = float(at.x), y[column] = float(at.y);
            }
        }
        cv::remap(batch.source, seen, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
        cv::matchTemplate(seen, patch, result, cv::TM_CCOEFF_NORMED);
        ncc[i] = result.at<float>(0, 0);
    }
}

static void compare(int hypotheses, int step) {
    const Batch batch = made_batch(hypotheses);
    const skep::PackedImage reference = skep::PackedImage::create(batch.reference);
    const skep::PackedImage source = skep::PackedImage::create(batch.source);
    const double alike = std::numeric_limits<double>::infinity();
    const skep::NccWindow window =
        skep::NccWindow::create(radius, std::uint32_t(step), alike, alike);
    std::vector<float> ours(patches), theirs(patches);
    // The best of alternating rounds: other load on the machine slows single rounds of either side.
    double our_best = 1e9, their_best = 1e9;
    for (int round = 0; round < rounds; ++round) {
        our_best = std::min(our_best, seconds([&] {
                                skep::patch_ncc(window, reference, source, batch.pixels,
                                                batch.homographies, ours);
                            }));
        their_best =
            std::min(their_best, seconds([&] { correlate_with_opencv(batch, step, theirs); }));
    }
    const int side = 2 * radius / step + 1;
    std::printf("%3d samples, %2d hypotheses a pixel: %5.2f million patches/s (%s), OpenCV %.3f, "
                "ratio %.1f\n",
                side * side, hypotheses, patches / our_best / 1e6, skep::simd_level_name(),
                patches / their_best / 1e6, their_best / our_best);
    double difference = 0;
    for (std::size_t i = 0; i < patches; ++i)
        difference += std::abs(ours[i] - theirs[i]) / patches;
    CHECK(difference < 0.02); // the same work was done
    // A run samples the reference's side some 14 times a pixel for 300 to 450 comparisons, so 32
    // is what counts; fewer are printed, not checked.
    if (hypotheses == 32)
        CHECK(their_best >= 20 * our_best);
}

int main() {
    cv::setNumThreads(1);
    for (int step : {2, 1})
        for (int hypotheses : {1, 8, 32})
            compare(hypotheses, step);
}
