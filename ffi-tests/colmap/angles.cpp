// COLMAP's multi-view stereo on our workspace before it reads a map: order of the images, overlaps,
// and triangulation angles.
#include "colmap.hpp"

#include <base/triangulation.h>
#include <mvs/model.h>
#include <util/math.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <vector>

namespace {

using check::must;
using check::Owned;

double our_angle(const skep_scene *scene, uint32_t a, uint32_t b) {
    double degrees = 0;
    must(skep_scene_get_triangulation_angle(scene, a, b, &degrees));
    return degrees;
}

Eigen::Vector3d center_of(const scene::View &view) {
    return Eigen::Vector3d(scene::center(view.camera).data());
}

// COLMAP's angles, in degrees, at all points that both views saw.
std::vector<double> their_angles(const scene::Scene &made, uint32_t a, uint32_t b) {
    std::vector<double> angles;
    for (const scene::Point &point : made.points) {
        const auto saw = [&](uint32_t view) {
            return std::find(point.views.begin(), point.views.end(), view) != point.views.end();
        };
        if (saw(a) && saw(b)) {
            const Eigen::Vector3d position(point.position.data());
            angles.push_back(colmap::RadToDeg(colmap::CalculateTriangulationAngle(
                center_of(made.views[a]), center_of(made.views[b]), position)));
        }
    }
    return angles;
}

// The number that COLMAP gives an image in its maps, consistency graphs and visibilities is our
// view's.
void images_have_our_numbers(const scene::Scene &made, const colmap::mvs::Model &model) {
    std::printf("numbers of images\n");
    EXPECT(model.images.size() == made.views.size());
    for (uint32_t view = 0; view < made.views.size(); ++view) {
        EXPECT(model.GetImageIdx(made.views[view].name) == static_cast<int>(view));
        EXPECT(model.GetImageName(view) == made.views[view].name);
        EXPECT(model.images[view].GetWidth() == made.views[view].width);
        EXPECT(model.images[view].GetHeight() == made.views[view].height);
    }
    EXPECT(model.points.size() == made.points.size());
}

void the_same_views_overlap(const skep_scene *scene, const colmap::mvs::Model &model) {
    std::printf("overlap\n");
    const std::vector<std::vector<int>> overlapping = model.GetMaxOverlappingImages(50, 0);
    for (uint32_t view = 0; view < overlapping.size(); ++view) {
        std::vector<uint32_t> ours(overlapping.size());
        size_t count = 0;
        must(skep_scene_get_overlap(scene, view, ours.data(), ours.size(), &count));
        ours.resize(count);
        std::vector<uint32_t> theirs(overlapping[view].begin(), overlapping[view].end());
        std::sort(ours.begin(), ours.end());
        std::sort(theirs.begin(), theirs.end());
        EXPECT(ours == theirs);
    }
}

// Both take the angle of rank round(0.75 (n - 1)) of n, so that no number of points makes a
// difference. COLMAP's model computes in floats.
void angles_agree(const scene::Scene &made, const skep_scene *scene,
                  const colmap::mvs::Model &model) {
    std::printf("triangulation angles\n");
    const std::vector<std::map<int, float>> all = model.ComputeTriangulationAngles(75);
    double from_points = 0, from_model = 0, least = 180, most = 0;
    for (uint32_t a = 0; a < made.views.size(); ++a) {
        for (uint32_t b = 0; b < made.views.size(); ++b) {
            if (a == b) {
                continue;
            }
            const double ours = our_angle(scene, a, b);
            const double theirs = colmap::Percentile(their_angles(made, a, b), 75);
            from_points = std::max(from_points, std::abs(ours - theirs));
            from_model =
                std::max(from_model, std::abs(ours - colmap::RadToDeg(double(all[a].at(b)))));
            least = std::min(least, ours);
            most = std::max(most, ours);
        }
    }
    std::printf("  angles of %.2f to %.2f degrees\n", least, most);
    check::expect_at_most(from_points, 1e-9,
                          "those of CalculateTriangulationAngle differ, in degrees, by");
    check::expect_at_most(from_model, 1e-3, "those of mvs::Model, in floats, differ by");
}

// The same for all small numbers of points, where the rank must often be rounded.
void ranks_agree(const scene::Scene &made) {
    std::printf("ranks\n");
    scene::Scene few = made;
    for (size_t count = 3; count <= 20; ++count) {
        few.points.clear();
        for (const scene::Point &point : made.points) {
            if (few.points.size() < count && point.views.size() == made.views.size()) {
                few.points.push_back(point);
            }
        }
        EXPECT(few.points.size() == count);
        const Owned<skep_scene> scene = scene::hand_over(few);
        const double theirs = colmap::Percentile(their_angles(few, 0, 5), 75);
        EXPECT(std::abs(our_angle(scene.get(), 0, 5) - theirs) < 1e-9);
    }
}

// Views on opposite sides of a surface have no overlap; only they have large angles, which COLMAP
// folds to small ones.
void obtuse_angles_stay_obtuse(const scene::Scene &made) {
    std::printf("views that face each other\n");
    scene::Scene facing = made;
    facing.views.resize(2);
    place(facing.views[0].camera, Eigen::Matrix3d::Identity(), {0, 0, 5});
    place(facing.views[1].camera,
          Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY()).toRotationMatrix(), {0, 0, 5});
    facing.points.clear();
    for (int index = 0; index < 5; ++index) {
        facing.points.push_back({{0.2, 0.1 * index, 0}, {0, 1}});
    }
    const Owned<skep_scene> scene = scene::hand_over(facing);
    std::vector<double> theirs = their_angles(facing, 0, 1);
    for (double &angle : theirs) {
        EXPECT(angle < 90);
        angle = 180 - angle;
    }
    EXPECT(std::abs(our_angle(scene.get(), 0, 1) - colmap::Percentile(theirs, 75)) < 1e-9);
}

} // namespace

int main() {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        const scene::Scene made = scene::make();
        const Owned<skep_scene> scene = scene::hand_over(made);
        const std::string folder = scene::empty_folder("angles-model");
        must(skep_scene_write_colmap(scene.get(), folder.c_str()));
        colmap::mvs::Model model;
        model.ReadFromCOLMAP(folder);
        images_have_our_numbers(made, model);
        the_same_views_overlap(scene.get(), model);
        angles_agree(made, scene.get(), model);
        ranks_agree(made);
        obtuse_angles_stay_obtuse(made);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return check::finish();
}
