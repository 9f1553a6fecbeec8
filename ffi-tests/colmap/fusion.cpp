// COLMAP's fusion of our workspace, in process, against our cloud and the exact surfaces.
#include "colmap.hpp"

#include <mvs/fusion.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <vector>

namespace {

using check::must;
using scene::Vector;
using Cloud = std::vector<Vector>;

Cloud our_cloud(const skep_cloud *cloud) {
    size_t count = 0;
    must(skep_cloud_get_count(cloud, &count, nullptr));
    Cloud points(count);
    must(skep_cloud_get_points(cloud, points.empty() ? nullptr : points[0].data(), nullptr, nullptr,
                               count));
    return points;
}

Cloud fuse_with_colmap(const std::string &folder, const colmap::mvs::StereoFusionOptions &options) {
    colmap::mvs::StereoFusion fusion(options, folder, "COLMAP", "", "geometric");
    // Its log is long and not used here.
    std::cout.setstate(std::ios::failbit);
    fusion.Start();
    fusion.Wait();
    std::cout.clear();
    EXPECT(fusion.GetFusedPointsVisibility().size() == fusion.GetFusedPoints().size());
    Cloud points;
    for (const colmap::PlyPoint &point : fusion.GetFusedPoints()) {
        points.push_back({point.x, point.y, point.z});
    }
    return points;
}

// A distance, of each of many points: the one that half of them stay below, and the one that 99 %
// do.
struct Spread {
    double half;
    double most;
};

Spread spread_of(std::vector<double> distances) {
    if (distances.empty()) {
        return {HUGE_VAL, HUGE_VAL};
    }
    std::sort(distances.begin(), distances.end());
    return {distances[distances.size() / 2], distances[distances.size() * 99 / 100]};
}

// All are relative to the distance from the middle of the cameras, which is about 0.
double depth_of(const Vector &point) {
    return std::sqrt(point[0] * point[0] + point[1] * point[1] + point[2] * point[2]);
}

// From a sample of the points of one cloud to the nearest point of the other.
Spread nearest(const Cloud &from, const Cloud &to) {
    std::vector<double> distances;
    for (size_t index = 0; index < from.size(); index += 5) {
        const Vector &point = from[index];
        double square = HUGE_VAL;
        for (const Vector &other : to) {
            const double x = other[0] - point[0], y = other[1] - point[1], z = other[2] - point[2];
            square = std::min(square, x * x + y * y + z * z);
        }
        distances.push_back(std::sqrt(square) / depth_of(point));
    }
    return spread_of(distances);
}

Spread to_surface(const Cloud &points) {
    std::vector<double> distances;
    for (const Vector &point : points) {
        distances.push_back(scene::distance_to_surface(point) / depth_of(point));
    }
    return spread_of(distances);
}

// The workspace with a model shifted by half a pixel, as COLMAP's fusion puts pixel centers at
// integers.
std::string with_whole_pixels(const std::string &folder) {
    const std::string moved = scene::empty_folder("fusion-whole-pixels");
    for (const char *part : {"/images", "/stereo"}) {
        std::filesystem::create_symlink(folder + part, moved + part);
    }
    std::filesystem::create_directory(moved + "/sparse");
    colmap::Reconstruction model;
    model.ReadBinary(folder + "/sparse");
    for (const auto &camera : model.Cameras()) {
        std::vector<double> &parameters = model.Camera(camera.first).Params();
        parameters[2] -= half_pixel;
        parameters[3] -= half_pixel;
    }
    model.WriteBinary(moved + "/sparse");
    return moved;
}

void print(const char *what, const Spread &spread) {
    std::printf("  %-44s half within %.5f, 99 %% within %.5f\n", what, spread.half, spread.most);
}

// Of the number of points, as shares of ours, and of distances relative to depth, of which a pixel
// is 0.0066.
struct Bounds {
    double least_points;
    double most_points;
    Spread nearest;
    Spread surface;
};

bool within(const Spread &spread, const Spread &bound) {
    return spread.half <= bound.half && spread.most <= bound.most;
}

void compare(const char *what, const Cloud &ours, const Cloud &theirs, const Bounds &bounds) {
    const double share = double(theirs.size()) / ours.size();
    std::printf("%s: %zu points, %.3f of ours\n", what, theirs.size(), share);
    EXPECT(share >= bounds.least_points && share <= bounds.most_points);
    const Spread forth = nearest(theirs, ours), back = nearest(ours, theirs),
                 surface = to_surface(theirs);
    print("from theirs to the nearest of ours:", forth);
    print("from ours to the nearest of theirs:", back);
    print("from theirs to the surface:", surface);
    EXPECT(within(forth, bounds.nearest) && within(back, bounds.nearest));
    EXPECT(within(surface, bounds.surface));
}

} // namespace

int main() {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        const scene::Workspace workspace =
            scene::reconstruct_into(scene::empty_folder("fusion-workspace"));
        const Cloud ours = our_cloud(workspace.cloud.get());
        std::printf("our cloud: %zu points\n", ours.size());
        const Spread surface = to_surface(ours);
        print("from ours to the surface:", surface);
        EXPECT(within(surface, {0.0015, 0.012}));

        // With its own settings COLMAP makes one point of all that lies within two pixels: fewer
        // points, far apart. It follows chains of pixels from view to view, so some of its points
        // have no reference that enough views agree with.
        colmap::mvs::StereoFusionOptions defaults;
        defaults.num_threads = 1;
        const Bounds coarse = {0.12, 1, {0.008, 0.035}, {0.002, 0.012}};
        compare("COLMAP's settings", ours, fuse_with_colmap(workspace.folder, defaults), coarse);

        // With settings equivalent to ours the clouds differ by little more than the half pixel by
        // which its fusion is off: it puts the centers of pixels at whole numbers, against COLMAP's
        // own convention.
        colmap::mvs::StereoFusionOptions like_ours = defaults;
        like_ours.min_num_pixels = 4;
        like_ours.max_normal_error = 30;
        like_ours.max_reproj_error = 0.75;
        const Bounds fine = {0.6, 1.1, {0.005, 0.01}, {0.002, 0.012}};
        compare("settings like ours", ours, fuse_with_colmap(workspace.folder, like_ours), fine);

        // With a model that compensates for it, its cloud is as near to the surface as ours.
        const std::string moved = with_whole_pixels(workspace.folder);
        const Bounds finest = {0.6, 1.1, {0.0025, 0.008}, {1.2 * surface.half, 1.2 * surface.most}};
        compare("settings like ours, whole pixels", ours, fuse_with_colmap(moved, like_ours),
                finest);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return check::finish();
}
