// Makes a tiny scene for the example in C++, or checks what the example made of it:
//   program FOLDER [CLOUD PICTURE]
#include "../cpp/world.hpp"
#include "pictures.hpp"

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

static void make(const std::string &folder) {
    skep::Scene scene;
    for (double place : world::places) {
        const skep_camera camera = world::camera(place, world::width, world::height);
        const auto pixels = world::picture(camera, world::width, world::height);
        scene.add_view(
            skep_image{pixels.data(), world::width, world::height, world::width, SKEP_FORMAT_GRAY},
            camera);
    }
    // Points of the wall, which all cameras saw: the example takes its depth ranges from them.
    const skep_camera first = scene.camera(0);
    std::vector<double> positions;
    std::vector<std::uint32_t> counts, views;
    for (double y : {8.0, 20.0, 32.0}) {
        for (double x : {16.0, 28.0, 40.0}) {
            const double depth = world::depth(first, x, y);
            for (double along : world::ray(first, x, y))
                positions.push_back(depth * along);
            counts.push_back(std::uint32_t(world::places.size()));
            for (std::uint32_t view = 0; view < world::places.size(); ++view)
                views.push_back(view);
        }
    }
    scene.add_points(positions, counts, views);
    std::filesystem::create_directories(folder);
    scene.write_colmap(folder);
}

static void check(const std::string &cloud, const std::string &picture) {
    std::ifstream ply(cloud, std::ios::binary);
    std::string line, points;
    while (std::getline(ply, line) && line != "end_header")
        if (line.rfind("element vertex ", 0) == 0)
            points = line.substr(15);
    CHECK(line == "end_header" && std::stoi(points) > 500);
    const cv::Mat colors = cv::imread(picture);
    CHECK(colors.cols == int(world::width) && colors.rows == int(world::height));
    cv::Scalar mean, deviation;
    cv::meanStdDev(colors, mean, deviation);
    CHECK(deviation[0] + deviation[1] + deviation[2] > 50); // a color map, not a blank
}

int main(int argc, char **argv) {
    CHECK(argc == 2 || argc == 4);
    if (argc == 2)
        make(argv[1]);
    else
        check(argv[2], argv[3]);
}
