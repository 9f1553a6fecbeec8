// Sparse models: COLMAP's reader and writer against ours.
#include "colmap.hpp"

#include <base/pose.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <map>
#include <set>

namespace {

using check::must;
using check::Owned;

Owned<skep_scene> read_with_skep(const std::string &folder)
{
    skep_scene *scene = nullptr;
    must(skep_scene_read(folder.c_str(), nullptr, 0, 0, nullptr, nullptr, &scene));
    return {scene, skep_scene_destroy};
}

std::string name_of(const skep_scene *scene, uint32_t view)
{
    char name[100];
    must(skep_scene_get_name(scene, view, name, sizeof name, nullptr));
    return name;
}

uint32_t count_views(const skep_scene *scene)
{
    uint32_t count = 0;
    must(skep_scene_get_view_count(scene, &count));
    return count;
}

// The largest difference between the cameras of a scene and of a model, matched by name.
double camera_difference(const skep_scene *scene, const colmap::Reconstruction &model)
{
    EXPECT(count_views(scene) == model.NumRegImages());
    double largest = 0;
    for (uint32_t view = 0; view < count_views(scene); ++view) {
        uint32_t width = 0, height = 0;
        skep_camera camera;
        must(skep_scene_get_view(scene, view, &width, &height, &camera));
        const colmap::Image *image = model.FindImageWithName(name_of(scene, view));
        if (image == nullptr) {
            throw std::runtime_error("an image is missing: " + name_of(scene, view));
        }
        const colmap::Camera &theirs = model.Camera(image->CameraId());
        EXPECT(theirs.Width() == width && theirs.Height() == height);
        const double differences[] = {
            (calibration_of(theirs) - calibration_of(camera)).cwiseAbs().maxCoeff(),
            (image->RotationMatrix() - rotation_of(camera)).cwiseAbs().maxCoeff(),
            (image->Tvec() - translation_of(camera)).cwiseAbs().maxCoeff(),
        };
        largest = std::max(largest, *std::max_element(differences, differences + 3));
    }
    return largest;
}

// Positions with the names of the images that saw them: the points of a model, independent of its
// ids.
std::map<std::array<double, 3>, std::set<std::string>>
points_of(const colmap::Reconstruction &model)
{
    std::map<std::array<double, 3>, std::set<std::string>> points;
    for (const auto &point : model.Points3D()) {
        const Eigen::Vector3d &position = point.second.XYZ();
        std::set<std::string> &names = points[{position.x(), position.y(), position.z()}];
        for (const colmap::TrackElement &element : point.second.Track().Elements()) {
            names.insert(model.Image(element.image_id).Name());
        }
    }
    return points;
}

// COLMAP reads the scene from our model, bit for bit where the layout allows it.
void colmap_reads_our_model(const scene::Scene &made, const std::string &folder)
{
    std::printf("COLMAP reads our model\n");
    colmap::Reconstruction model;
    model.ReadBinary(folder + "/sparse");

    // Five views share a calibration.
    EXPECT(model.NumCameras() == 2);
    EXPECT(model.NumRegImages() == made.views.size());
    double rotation_error = 0, feature_error = 0;
    for (size_t index = 0; index < made.views.size(); ++index) {
        const scene::View &view = made.views[index];
        const colmap::Image &image = model.Image(model.RegImageIds()[index]);
        EXPECT(image.Name() == view.name);
        const colmap::Camera &camera = model.Camera(image.CameraId());
        EXPECT(camera.ModelName() == "PINHOLE");
        EXPECT(camera.Width() == view.width && camera.Height() == view.height);
        EXPECT(calibration_of(camera) == calibration_of(view.camera));
        EXPECT(image.Tvec() == translation_of(view.camera));
        const Eigen::Matrix3d difference = image.RotationMatrix() - rotation_of(view.camera);
        rotation_error = std::max(rotation_error, difference.cwiseAbs().maxCoeff());
    }
    check::expect_at_most(rotation_error, 1e-14,
                          "rotations, which the file holds as quaternions, differ by");

    EXPECT(model.NumPoints3D() == made.points.size());
    for (size_t index = 0; index < made.points.size(); ++index) {
        const scene::Point &put_in = made.points[index];
        const colmap::Point3D &point = model.Point3D(index + 1);
        EXPECT(point.XYZ() == Eigen::Vector3d(put_in.position.data()));
        std::vector<uint32_t> views;
        for (const colmap::TrackElement &element : point.Track().Elements()) {
            views.push_back(element.image_id - 1);
            const colmap::Point2D &feature =
                model.Image(element.image_id).Point2D(element.point2D_idx);
            EXPECT(feature.Point3DId() == index + 1);
            const scene::Vector pixel =
                scene::project(made.views[views.back()].camera, put_in.position);
            const Eigen::Vector2d expected(pixel[0] + half_pixel, pixel[1] + half_pixel);
            feature_error = std::max(feature_error, (feature.XY() - expected).norm());
        }
        EXPECT(views == put_in.views);
    }
    check::expect_at_most(feature_error, 1e-9,
                          "features and projections of their points differ by pixels:");
    std::printf("  %zu images, %zu points, %zu observations\n", model.NumRegImages(),
                model.NumPoints3D(), model.ComputeNumObservations());
}

// Rotations are written as quaternions: also those by nearly half a turn, about any axis, come
// back.
void poses_of_every_kind_survive()
{
    std::printf("poses of every kind\n");
    std::mt19937 random(1);
    scene::Scene made;
    for (int index = 0; index < 200; ++index) {
        scene::View view = {std::to_string(index) + ".png", 2, 3, {9, 8, 1, 1, {}, {}}, {}};
        view.rgb.resize(3 * 2 * 3);
        Eigen::Matrix3d rotation = random_rotation(random);
        if (index < 100) {
            const Eigen::Vector3d axis = rotation.col(0);
            rotation = Eigen::AngleAxisd(M_PI - std::pow(0.5, index), axis).toRotationMatrix();
        }
        place(view.camera, rotation, 1e6 * rotation.col(1));
        made.views.push_back(view);
    }
    const std::string folder = scene::empty_folder("model-poses");
    const Owned<skep_scene> scene = scene::hand_over(made);
    for (uint32_t view = 0; view < made.views.size(); ++view) {
        must(skep_scene_set_depth_range(scene.get(), view, 1, 2));
    }
    must(skep_scene_write_colmap(scene.get(), folder.c_str()));
    colmap::Reconstruction model;
    model.ReadBinary(folder + "/sparse");
    check::expect_at_most(camera_difference(scene.get(), model), 1e-14, "cameras differ by");
}

// What COLMAP writes of our model, as text and as bytes, is the same scene to us, and again to
// COLMAP.
void we_read_colmaps_model(const std::string &folder, bool as_text)
{
    std::printf("we read COLMAP's model, %s\n", as_text ? "text" : "binary");
    colmap::Reconstruction model;
    model.ReadBinary(folder + "/sparse");
    const std::string theirs = scene::empty_folder(as_text ? "model-text" : "model-binary");
    std::filesystem::create_directory(theirs + "/sparse");
    std::filesystem::create_symlink(folder + "/images", theirs + "/images");
    if (as_text) {
        model.WriteText(theirs + "/sparse");
    } else {
        model.WriteBinary(theirs + "/sparse");
    }
    const Owned<skep_scene> scene = read_with_skep(theirs);
    check::expect_at_most(camera_difference(scene.get(), model), 1e-12, "cameras differ by");

    const std::string ours =
        scene::empty_folder(as_text ? "model-text-again" : "model-binary-again");
    must(skep_scene_write_colmap(scene.get(), ours.c_str()));
    colmap::Reconstruction again;
    again.ReadBinary(ours + "/sparse");
    check::expect_at_most(camera_difference(scene.get(), again), 1e-12,
                          "and when COLMAP reads it again by");
    EXPECT(points_of(again) == points_of(model));
}

// A text model that neither of the two has written: the scene in the examples.
void both_read_the_board(const std::string &board)
{
    std::printf("both read the scene in the examples\n");
    colmap::Reconstruction model;
    model.ReadText(board + "/sparse");
    const Owned<skep_scene> scene = read_with_skep(board);
    check::expect_at_most(camera_difference(scene.get(), model), 1e-12, "cameras differ by");
    for (uint32_t view = 0; view < count_views(scene.get()); ++view) {
        EXPECT(name_of(scene.get(), view) == model.Image(model.RegImageIds()[view]).Name());
    }
}

// Models without points, and with a camera of one focal length, are models too.
void models_may_lack_points(const std::string &folder)
{
    std::printf("models without points, with one focal length\n");
    for (const bool as_text : {false, true}) {
        colmap::Reconstruction full, bare;
        full.ReadBinary(folder + "/sparse");
        colmap::Camera camera;
        camera.SetCameraId(7);
        camera.SetModelIdFromName("SIMPLE_PINHOLE");
        camera.SetParams({151.25, 80.5, 59.75});
        camera.SetWidth(160);
        camera.SetHeight(120);
        bare.AddCamera(camera);
        for (const char *name : {"upper/0.png", "upper/1.png", "lower/3.png"}) {
            const colmap::Image *known = full.FindImageWithName(name);
            colmap::Image image;
            image.SetImageId(10 * known->ImageId());
            image.SetCameraId(7);
            image.SetName(name);
            image.SetQvec(known->Qvec());
            image.SetTvec(known->Tvec());
            bare.AddImage(image);
            bare.RegisterImage(image.ImageId());
        }
        const std::string theirs = scene::empty_folder("model-bare");
        std::filesystem::create_directory(theirs + "/sparse");
        std::filesystem::create_symlink(folder + "/images", theirs + "/images");
        if (as_text) {
            bare.WriteText(theirs + "/sparse");
        } else {
            bare.WriteBinary(theirs + "/sparse");
        }
        skep_scene *scene = nullptr;
        must(skep_scene_read(theirs.c_str(), nullptr, 2, 8, nullptr, nullptr, &scene));
        const Owned<skep_scene> owned(scene, skep_scene_destroy);
        check::expect_at_most(camera_difference(scene, bare), 1e-12, "cameras differ by");
        EXPECT(skep_scene_validate(scene) == SKEP_OK);
    }
}

// Photographs of a lens that distorts become those of a pinhole camera with its focal lengths.
void distorted_cameras_are_undistorted(const std::string &folder)
{
    std::printf("distorted cameras are undistorted\n");
    colmap::Reconstruction model;
    model.ReadBinary(folder + "/sparse");
    colmap::Camera &camera = model.Camera(1);
    camera.SetModelIdFromName("OPENCV");
    camera.SetParams({150, 150, 80, 60, 0.1, 0, 0, 0});
    const std::string theirs = scene::empty_folder("model-distorted");
    std::filesystem::create_directory(theirs + "/sparse");
    std::filesystem::create_symlink(folder + "/images", theirs + "/images");
    model.WriteBinary(theirs + "/sparse");
    skep_scene *scene = nullptr;
    must(skep_scene_read(theirs.c_str(), nullptr, 0, 0, nullptr, nullptr, &scene));
    const Owned<skep_scene> owned(scene, skep_scene_destroy);
    uint32_t width = 0, height = 0;
    skep_camera pinhole;
    must(skep_scene_get_view(scene, 0, &width, &height, &pinhole));
    EXPECT(pinhole.fx == 150 && pinhole.fy == 150);
    EXPECT(width != camera.Width() || height != camera.Height());
    EXPECT(skep_scene_validate(scene) == SKEP_OK);
}

} // namespace

int main(int argument_count, char **arguments)
{
    if (argument_count != 2) {
        std::fprintf(stderr, "usage: model BOARD\n");
        return 2;
    }
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        const scene::Scene made = scene::make();
        const std::string folder = scene::empty_folder("model-ours");
        must(skep_scene_write_colmap(scene::hand_over(made).get(), folder.c_str()));
        colmap_reads_our_model(made, folder);
        poses_of_every_kind_survive();
        we_read_colmaps_model(folder, false);
        we_read_colmaps_model(folder, true);
        both_read_the_board(arguments[1]);
        models_may_lack_points(folder);
        distorted_cameras_are_undistorted(folder);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return check::finish();
}
