// Depth maps, normal maps, consistency graphs and clouds: COLMAP's readers and writers against
// ours.
#include "colmap.hpp"

#include <mvs/consistency_graph.h>
#include <mvs/depth_map.h>
#include <mvs/fusion.h>
#include <mvs/normal_map.h>
#include <util/ply.h>

#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <vector>

namespace {

using check::must;

bool same_bits(const std::vector<float> &a, const std::vector<float> &b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// COLMAP holds the channels one after the other, the library pixel by pixel.
std::vector<float> pixel_by_pixel(const colmap::mvs::Mat<float> &planes) {
    std::vector<float> values;
    for (size_t row = 0; row < planes.GetHeight(); ++row) {
        for (size_t column = 0; column < planes.GetWidth(); ++column) {
            for (size_t channel = 0; channel < planes.GetDepth(); ++channel) {
                values.push_back(planes.Get(row, column, channel));
            }
        }
    }
    return values;
}

// The views of each pixel, as the library has them.
using Graph = std::vector<std::vector<int>>;

Graph graph_of(const colmap::mvs::ConsistencyGraph &graph, uint32_t width, uint32_t height) {
    Graph views;
    for (uint32_t row = 0; row < height; ++row) {
        for (uint32_t column = 0; column < width; ++column) {
            int count = 0;
            const int *indices = nullptr;
            graph.GetImageIdxs(row, column, &count, &indices);
            views.emplace_back(indices, indices + count);
        }
    }
    return views;
}

// The source views that each pixel was matched with; none where it has no depth.
Graph graph_of(const skep_result *result, uint32_t view, const std::vector<float> &depth) {
    uint32_t sources[32];
    size_t count = 0;
    must(skep_result_get_sources(result, view, sources, 32, &count));
    uint32_t width = 0, height = 0;
    must(skep_result_get_size(result, view, &width, &height));
    std::vector<uint32_t> bits(depth.size());
    must(skep_result_get_source_bits(result, view, 0, bits.data(), 4 * width));
    Graph views(depth.size());
    for (size_t pixel = 0; pixel < depth.size(); ++pixel) {
        for (size_t source = 0; source < count; ++source) {
            if (depth[pixel] > 0 && (bits[pixel] >> source & 1)) {
                views[pixel].push_back(static_cast<int>(sources[source]));
            }
        }
    }
    return views;
}

// COLMAP reads what is in the result, and what it then writes is the same file.
void colmap_reads_our_maps(const scene::Workspace &workspace) {
    std::printf("COLMAP reads our maps\n");
    const std::string copy = scene::empty_folder("maps-copy") + "/copy.bin";
    size_t empty = 0, pixels = 0, listed = 0;
    for (uint32_t view = 0; view < workspace.made.views.size(); ++view) {
        const uint32_t width = workspace.made.views[view].width,
                       height = workspace.made.views[view].height;
        for (const uint32_t which : {SKEP_MAPS_RAW, SKEP_MAPS_VALIDATED}) {
            const std::string name =
                workspace.made.views[view].name +
                (which == SKEP_MAPS_RAW ? ".photometric.bin" : ".geometric.bin");
            std::vector<float> depth(size_t{width} * height), normal(3 * depth.size());
            must(skep_result_get_depth(workspace.result.get(), view, which, depth.data(),
                                       4 * width));
            must(skep_result_get_normal(workspace.result.get(), view, which, normal.data(),
                                        12 * width));

            const std::string depth_file = workspace.folder + "/stereo/depth_maps/" + name;
            colmap::mvs::DepthMap depth_map;
            depth_map.Read(depth_file);
            EXPECT(depth_map.GetWidth() == width && depth_map.GetHeight() == height);
            EXPECT(same_bits(depth_map.GetData(), depth));
            depth_map.Write(copy);
            EXPECT(bytes_of(copy) == bytes_of(depth_file));

            const std::string normal_file = workspace.folder + "/stereo/normal_maps/" + name;
            colmap::mvs::NormalMap normal_map;
            normal_map.Read(normal_file);
            EXPECT(normal_map.GetWidth() == width && normal_map.GetHeight() == height);
            EXPECT(same_bits(pixel_by_pixel(normal_map), normal));
            normal_map.Write(copy);
            EXPECT(bytes_of(copy) == bytes_of(normal_file));

            const std::string graph_file = workspace.folder + "/stereo/consistency_graphs/" + name;
            colmap::mvs::ConsistencyGraph graph;
            graph.Read(graph_file);
            const Graph views = graph_of(graph, width, height);
            EXPECT(views == graph_of(workspace.result.get(), view, depth));
            graph.Write(copy);
            EXPECT(bytes_of(copy) == bytes_of(graph_file));

            for (size_t pixel = 0; pixel < depth.size(); ++pixel) {
                pixels += 1;
                empty += depth[pixel] == 0;
                listed += !views[pixel].empty();
            }
        }
    }
    std::printf("  %zu pixels, %zu of them empty, %zu with source views\n", pixels, empty, listed);
    EXPECT(empty > 0 && listed > pixels / 2);
}

// Both write the same bytes of made-up maps and read them back, whatever the size.
void maps_are_the_same_both_ways(uint32_t width, uint32_t height) {
    std::printf("maps of %u x %u\n", width, height);
    const std::string folder = scene::empty_folder("maps-made");
    const std::string ours = folder + "/ours.bin", theirs = folder + "/theirs.bin";
    const size_t pixels = size_t{width} * height;
    std::mt19937 random(width);
    std::uniform_real_distribution<float> any(0, 10);
    // Including special values: empty pixels and numbers next to 0 and to infinity.
    std::vector<float> depth(pixels), normal(3 * pixels);
    for (size_t pixel = 0; pixel < pixels; ++pixel) {
        const float odd[] = {0, std::numeric_limits<float>::denorm_min(),
                             std::numeric_limits<float>::max()};
        depth[pixel] = pixel % 4 < 3 ? odd[pixel % 4] : any(random);
        for (int axis = 0; axis < 3 && depth[pixel] > 0; ++axis) {
            normal[3 * pixel + axis] = any(random) - 5;
        }
    }
    uint32_t read_width = 0, read_height = 0;

    colmap::mvs::DepthMap depth_map(width, height, 0, 10);
    std::memcpy(depth_map.GetPtr(), depth.data(), depth.size() * sizeof(float));
    depth_map.Write(theirs);
    must(skep_write_depth_map(ours.c_str(), depth.data(), width, height, 4 * width));
    EXPECT(bytes_of(ours) == bytes_of(theirs));
    std::vector<float> read(pixels);
    must(skep_read_depth_map(theirs.c_str(), read.data(), read.size(), &read_width, &read_height));
    EXPECT(read_width == width && read_height == height);
    EXPECT(same_bits(read, depth));
    colmap::mvs::DepthMap depth_read;
    depth_read.Read(ours);
    EXPECT(same_bits(depth_read.GetData(), depth));

    colmap::mvs::NormalMap normal_map(width, height);
    for (size_t pixel = 0; pixel < pixels; ++pixel) {
        for (int axis = 0; axis < 3; ++axis) {
            normal_map.Set(pixel / width, pixel % width, axis, normal[3 * pixel + axis]);
        }
    }
    normal_map.Write(theirs);
    must(skep_write_normal_map(ours.c_str(), normal.data(), width, height, 12 * width));
    EXPECT(bytes_of(ours) == bytes_of(theirs));
    read.assign(3 * pixels, 0);
    must(skep_read_normal_map(theirs.c_str(), read.data(), read.size(), &read_width, &read_height));
    EXPECT(read_width == width && read_height == height);
    EXPECT(same_bits(read, normal));
    colmap::mvs::NormalMap normal_read;
    normal_read.Read(ours);
    EXPECT(same_bits(pixel_by_pixel(normal_read), normal));
}

// The same of consistency graphs; COLMAP also lists pixels that no view is consistent with, which
// we read but do not write.
void graphs_are_the_same_both_ways(uint32_t width, uint32_t height) {
    std::printf("consistency graphs of %u x %u\n", width, height);
    const std::string folder = scene::empty_folder("maps-graphs");
    const std::string ours = folder + "/ours.bin", theirs = folder + "/theirs.bin";
    std::mt19937 random(height);
    Graph graph(size_t{width} * height);
    std::vector<uint32_t> counts, views;
    std::vector<int> entries, entries_and_empty;
    for (size_t pixel = 0; pixel < graph.size(); ++pixel) {
        for (int view = 0; pixel % 3 > 0 && view < 40; ++view) {
            if (random() % 4 == 0) {
                graph[pixel].push_back(view);
            }
        }
        counts.push_back(graph[pixel].size());
        views.insert(views.end(), graph[pixel].begin(), graph[pixel].end());
        std::vector<int> entry = {int(pixel % width), int(pixel / width), int(graph[pixel].size())};
        entry.insert(entry.end(), graph[pixel].begin(), graph[pixel].end());
        entries_and_empty.insert(entries_and_empty.end(), entry.begin(), entry.end());
        if (!graph[pixel].empty()) {
            entries.insert(entries.end(), entry.begin(), entry.end());
        }
    }
    must(skep_write_consistency_graph(ours.c_str(), width, height, counts.data(), views.data(),
                                      views.size()));
    colmap::mvs::ConsistencyGraph read_by_them;
    read_by_them.Read(ours);
    EXPECT(graph_of(read_by_them, width, height) == graph);
    for (const std::vector<int> *data : {&entries_and_empty, &entries}) {
        colmap::mvs::ConsistencyGraph(width, height, *data).Write(theirs);
        std::vector<uint32_t> read_counts(counts.size()), read_views(views.size());
        uint32_t read_width = 0, read_height = 0;
        size_t total = 0;
        must(skep_read_consistency_graph(theirs.c_str(), read_counts.data(), read_counts.size(),
                                         read_views.data(), read_views.size(), &read_width,
                                         &read_height, &total));
        EXPECT(read_width == width && read_height == height && total == views.size());
        EXPECT(read_counts == counts && read_views == views);
    }
    EXPECT(bytes_of(ours) == bytes_of(theirs));
}

// COLMAP reads our cloud, and writes the same two files of it.
void the_cloud_is_the_same(const scene::Workspace &workspace) {
    std::printf("the cloud\n");
    size_t count = 0, view_total = 0;
    must(skep_cloud_get_count(workspace.cloud.get(), &count, &view_total));
    std::vector<double> positions(3 * count);
    std::vector<float> normals(3 * count);
    std::vector<uint8_t> colors(3 * count);
    std::vector<uint32_t> view_counts(count), views(view_total);
    must(skep_cloud_get_points(workspace.cloud.get(), positions.data(), normals.data(),
                               colors.data(), count));
    must(skep_cloud_get_views(workspace.cloud.get(), view_counts.data(), count, views.data(),
                              view_total));

    const std::string file = workspace.folder + "/fused.ply";
    const std::vector<colmap::PlyPoint> points = colmap::ReadPly(file);
    EXPECT(points.size() == count && count > 0);
    size_t differing = 0;
    for (size_t index = 0; index < std::min(points.size(), count); ++index) {
        const colmap::PlyPoint &point = points[index];
        const float place[] = {point.x, point.y, point.z},
                    normal[] = {point.nx, point.ny, point.nz};
        const uint8_t color[] = {point.r, point.g, point.b};
        for (int axis = 0; axis < 3; ++axis) {
            differing += place[axis] != static_cast<float>(positions[3 * index + axis]) ||
                         normal[axis] != normals[3 * index + axis] ||
                         color[axis] != colors[3 * index + axis];
        }
    }
    EXPECT(differing == 0);
    const std::string copy = scene::empty_folder("maps-cloud") + "/copy";
    colmap::WriteBinaryPlyPoints(copy, points);
    EXPECT(bytes_of(copy) == bytes_of(file));

    std::vector<std::vector<int>> visibility(count);
    for (size_t index = 0, first = 0; index < count; first += view_counts[index], ++index) {
        visibility[index].assign(views.begin() + first, views.begin() + first + view_counts[index]);
    }
    colmap::mvs::WritePointsVisibility(copy, visibility);
    EXPECT(bytes_of(copy) == bytes_of(file + ".vis"));
    std::printf("  %zu points, %zu observations\n", count, view_total);
}

} // namespace

int main() {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        const scene::Workspace workspace =
            scene::reconstruct_into(scene::empty_folder("maps-workspace"));
        colmap_reads_our_maps(workspace);
        the_cloud_is_the_same(workspace);
        for (const auto &size :
             {std::array<uint32_t, 2>{1, 1}, {7, 1}, {1, 9}, {31, 17}, {16, 40}}) {
            maps_are_the_same_both_ways(size[0], size[1]);
            graphs_are_the_same_both_ways(size[0], size[1]);
        }
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return check::finish();
}
