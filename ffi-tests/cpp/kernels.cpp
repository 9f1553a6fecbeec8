// Kernels and files.
#include "parts.hpp"
#include "test.hpp"

#include <cmath>
#include <limits>

void test_kernels() {
    const skep_camera reference = world::camera(0, world::width, world::height);
    const skep_camera source = world::camera(0.8, world::width, world::height);
    const double depth = world::depth(reference, 20, 17);
    const skep_plane wall =
        MUST(skep::plane_through(reference, 20, 17, depth, world::normal(reference)));
    CHECK(std::abs(wall.distance - world::dot(world::wall_normal(), {0, 0, -5})) < 1e-12);

    // The wall's homography takes pixels to where the source sees the same point of the wall.
    const auto homographies =
        MUST(skep::plane_homographies(reference, source, skep::Span<const skep_plane>(&wall, 1)));
    CHECK(homographies.size() == 1 &&
          MUST(skep::plane_homographies(reference, source, {})).empty());
    const skep::Homography &h = homographies[0];
    const auto there = [&](int row) {
        return h[3 * row] * 11 + h[3 * row + 1] * 30 + h[3 * row + 2];
    };
    const double x = there(0) / there(2), y = there(1) / there(2);
    const world::Vector at_reference = world::ray(reference, 11, 30);
    const world::Vector at_source = world::ray(source, x, y);
    const double far = world::depth(reference, 11, 30), farther = world::depth(source, x, y);
    for (std::size_t i = 0; i < 3; ++i) {
        const double point = world::center(reference)[i] + far * at_reference[i];
        CHECK(std::abs(world::center(source)[i] + farther * at_source[i] - point) < 1e-9);
    }

    const auto image = [](const std::vector<std::uint8_t> &pixels) {
        return skep_image{pixels.data(), world::width, world::height, world::width,
                          SKEP_FORMAT_GRAY};
    };
    const auto reference_picture = world::picture(reference, world::width, world::height);
    const auto source_picture = world::picture(source, world::width, world::height);
    const skep::PackedImage reference_samples =
        MUST(skep::PackedImage::create(image(reference_picture)));
    const skep::PackedImage source_samples = MUST(skep::PackedImage::create(image(source_picture)));
    const double all_alike = std::numeric_limits<double>::infinity();
    const skep::NccWindow window = MUST(skep::NccWindow::create(5, 1, all_alike, all_alike));
    const skep::Homography identity = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const std::vector<skep::Pixel> pixels = {{20, 17}, {20, 17}};
    const skep::Homography shift = {1, 0, 4, 0, 1, 0, 0, 0, 1};
    const std::vector<skep::Homography> ways = {h, shift};
    std::vector<float> ncc(2);
    MUST(skep::patch_ncc(window, reference_samples, source_samples, pixels, ways, ncc));
    CHECK(ncc[0] > 0.99f && ncc[1] < 0.5f);
    const std::vector<skep::Homography> same = {identity, identity};
    MUST(skep::patch_ncc(window, reference_samples, reference_samples, pixels, same, ncc));
    CHECK(std::abs(ncc[0] - 1) < 1e-5f && ncc[0] == ncc[1]);
    MUST(skep::patch_ncc(window, reference_samples, source_samples, {}, {}, {}));

    FAILS(
        SKEP_ERR_ARGUMENT, "2 as the pixels",
        skep::patch_ncc(window, reference_samples, source_samples, pixels, ways, {ncc.data(), 1}));
    FAILS(SKEP_ERR_ARGUMENT, "radius", skep::NccWindow::create(99, 1, 1, 1));
    FAILS(SKEP_ERR_ARGUMENT, "depth is -2",
          skep::plane_through(reference, 1, 1, -2, world::Vector{0, 0, -1}));
    FAILS(SKEP_ERR_ARGUMENT, "normal is 2 long; expected 3",
          skep::plane_through(reference, 1, 1, 2, std::vector<double>{0, -1}));
}

void test_files(const std::string &folder) {
    skep::Map<float> depth({5, 4}), normal({5, 4}, 3);
    for (std::size_t i = 0; i < depth.data.size(); ++i)
        depth.data[i] = float(i) + 0.5f;
    for (std::size_t i = 0; i < normal.data.size(); ++i)
        normal.data[i] = 1 / float(i + 1);
    MUST(skep::write_depth_map(folder + "/depth.bin", depth));
    MUST(skep::write_normal_map(folder + "/normal.bin", normal));
    const skep::Map<float> read = MUST(skep::read_depth_map(folder + "/depth.bin"));
    CHECK(read.width == 5 && read.height == 4 && read.data == depth.data);
    const skep::Map<float> normals = MUST(skep::read_normal_map(folder + "/normal.bin"));
    CHECK(normals.channels == 3 && normals.data == normal.data);

    skep::ConsistencyGraph graph = {{2, 2}, {{1, 0, 2, 0}, {7, 1, 3}}};
    MUST(skep::write_consistency_graph(folder + "/graph.bin", graph));
    const skep::ConsistencyGraph again = MUST(skep::read_consistency_graph(folder + "/graph.bin"));
    CHECK(again.size.width == 2 && again.lists.counts == graph.lists.counts);
    CHECK(again.lists.views == graph.lists.views);

    graph.lists.counts.pop_back();
    FAILS(SKEP_ERR_ARGUMENT, "counts is 3 long",
          skep::write_consistency_graph(folder + "/graph.bin", graph));
    FAILS(SKEP_ERR_FILE, "nothing.bin", skep::read_depth_map(folder + "/nothing.bin"));
    FAILS(SKEP_ERR_ARGUMENT, "1 channel", skep::write_normal_map(folder + "/normal.bin", depth));
}
