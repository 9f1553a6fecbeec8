// Photographs in, a point cloud and a picture of depths out: reconstruct SCENE CLOUD.ply DEPTH.png
//
// SCENE holds images/ and a COLMAP model in sparse/, as `colmap image_undistorter` writes it. The
// pictures are read by OpenCV, as a program would that has them in memory anyway.
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <skep.hpp>

#include <cstdio>

/// Near is red, far is blue, black is unknown.
static cv::Mat colored(const cv::Mat &depth) {
    cv::Mat inverse, gray, colors;
    const cv::Mat known = depth > 0;
    cv::divide(1.0, depth, inverse);
    cv::normalize(inverse, gray, 0, 255, cv::NORM_MINMAX, CV_8U, known);
    cv::applyColorMap(gray, colors, cv::COLORMAP_TURBO);
    colors.setTo(0, ~known);
    return colors;
}

int main(int argc, char **argv) try {
    if (argc != 4) {
        std::fprintf(stderr, "usage: %s SCENE CLOUD.ply DEPTH.png\n", argv[0]);
        return 2;
    }
    // The model's cameras and depth ranges, with pictures that OpenCV reads.
    const std::string folder = argv[1];
    const skep::Scene model = skep::Scene::read(folder);
    skep::Scene scene;
    for (std::uint32_t view = 0; view < model.view_count(); ++view) {
        const std::string name = model.name(view);
        const cv::Mat picture =
            cv::imread(folder + "/images/" + name); // BGR, as skep takes cv::Mat
        scene.add_view(picture, model.camera(view), name.c_str());
        scene.set_depth_range(view, model.depth_range(view));
        scene.set_sources(view, model.sources(view));
    }

    const skep::Result result = skep::reconstruct(scene, {}, [](const skep::Progress &progress) {
        std::printf("\r%3.0f %%", 100 * progress.done);
        std::fflush(stdout);
    });
    // What the user should know: depth ranges that no point supports, views without source views.
    for (const auto &warnings : {model.warnings(), result.warnings()})
        for (const std::string &warning : warnings)
            std::printf("\n%s", warning.c_str());

    const skep::Cloud cloud = result.cloud();
    cloud.write_ply(argv[2]);
    cv::Mat depth;
    result.depth(0, skep::Maps::Validated, depth);
    cv::imwrite(argv[3], colored(depth));
    std::printf("\n%zu points in %s, depths of %s in %s\n", cloud.size(), argv[2],
                model.name(0).c_str(), argv[3]);
} catch (const skep::Error &error) {
    std::fprintf(stderr, "\n%s\n", error.what());
    return 1;
}
