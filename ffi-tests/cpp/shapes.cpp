// Pictures, maps and matrices of OpenCV and Eigen, which skep.hpp does not include.
#include "test.hpp"
#include "world.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

static skep_camera exact() { return world::camera(0.8, world::width, world::height); }

static bool same(const skep_camera &a, const skep_camera &b, double tolerance) {
    double most = std::max({std::abs(a.fx - b.fx), std::abs(a.fy - b.fy), std::abs(a.cx - b.cx),
                            std::abs(a.cy - b.cy)});
    for (int i = 0; i < 9; ++i)
        most = std::max(most, std::abs(a.rotation[i] - b.rotation[i]));
    for (int i = 0; i < 3; ++i)
        most = std::max(most, std::abs(a.translation[i] - b.translation[i]));
    return most <= tolerance;
}

static void test_cameras() {
    const skep_camera camera = exact();
    const double *r = camera.rotation, *t = camera.translation;
    const double k[3][3] = {{camera.fx, 0, camera.cx}, {0, camera.fy, camera.cy}, {0, 0, 1}};

    Eigen::Matrix3d eigen_k, eigen_r;
    for (int i = 0; i < 9; ++i)
        eigen_k(i / 3, i % 3) = k[i / 3][i % 3], eigen_r(i / 3, i % 3) = r[i];
    const Eigen::Vector3d eigen_t(t[0], t[1], t[2]);
    CHECK(same(MUST(skep::camera(eigen_k, eigen_r, eigen_t)), camera, 0));
    // Expressions, single precision, blocks and quaternions' matrices too.
    CHECK(same(MUST(skep::camera(eigen_k.cast<float>(), eigen_r, eigen_t)), camera, 1e-5));
    CHECK(same(MUST(skep::camera(2 * eigen_k - eigen_k, eigen_r, eigen_t.transpose())), camera,
               1e-12));
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    pose.topLeftCorner<3, 3>() = eigen_r, pose.topRightCorner<3, 1>() = eigen_t;
    CHECK(same(MUST(skep::camera(eigen_k, pose.block<3, 3>(0, 0), pose.col(3).head<3>())), camera,
               0));
    const Eigen::Quaterniond turn(eigen_r);
    CHECK(same(MUST(skep::camera(eigen_k, turn.toRotationMatrix(), eigen_t)), camera, 1e-12));

    const cv::Mat mat_k(3, 3, CV_64F, const_cast<double *>(&k[0][0]));
    const cv::Mat mat_r = cv::Mat(3, 3, CV_64F, const_cast<double *>(r)).clone();
    const cv::Mat mat_t = (cv::Mat_<double>(3, 1) << t[0], t[1], t[2]);
    CHECK(same(MUST(skep::camera(mat_k, mat_r, mat_t)), camera, 0));
    cv::Mat float_k;
    mat_k.convertTo(float_k, CV_32F);
    CHECK(same(MUST(skep::camera(float_k, mat_r, cv::Mat(mat_t.t()))), camera, 1e-5));
    const cv::Matx33d matx_r(r);
    const cv::Mat_<double> typed_k = mat_k;
    CHECK(same(MUST(skep::camera(typed_k, matx_r, cv::Vec3d(t[0], t[1], t[2]))), camera, 0));
    // A part of a larger matrix, with its stride.
    cv::Mat wide = cv::Mat::zeros(3, 4, CV_64F);
    mat_r.copyTo(wide(cv::Rect(0, 0, 3, 3))), mat_t.copyTo(wide.col(3));
    CHECK(same(MUST(skep::camera(k, wide(cv::Rect(0, 0, 3, 3)), wide.col(3))), camera, 0));

    FAILS(SKEP_ERR_ARGUMENT, "R is 3 x 4; expected 3 x 3", skep::camera(k, wide, mat_t));
    FAILS(SKEP_ERR_ARGUMENT, "t is 4 x 4", skep::camera(k, matx_r, pose));
    FAILS(SKEP_ERR_ARGUMENT, "R is a matrix of another type",
          skep::camera(k, cv::Mat(3, 3, CV_8U), eigen_t));
    eigen_k(0, 1) = 0.5;
    FAILS(SKEP_ERR_ARGUMENT, "K", skep::camera(eigen_k, eigen_r, eigen_t));
}

static void test_homographies() {
    const skep::Homography numbers = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    Eigen::MatrixXd eigen;
    cv::Mat mat;
    cv::Matx33f matx;
    skep::assign(numbers, eigen), skep::assign(numbers, mat), skep::assign(numbers, matx);
    CHECK(eigen.rows() == 3 && eigen(1, 2) == 6 && mat.at<double>(2, 0) == 7 && matx(0, 1) == 2.0f);
    CHECK(MUST(skep::homography(eigen)) == numbers && MUST(skep::homography(mat)) == numbers);
    CHECK(MUST(skep::homography(matx)) == numbers);
    const Eigen::Vector3d normal(0, 0, -1);
    const skep_plane plane = MUST(skep::plane_through(exact(), 3, 4, 2, normal));
    CHECK(std::abs(plane.distance - 2) < 1e-12 && plane.normal[2] == -1);
}

/// The same picture in every type of cv::Mat gives the same correlation with itself in gray.
static void test_pictures() {
    const auto pixels = world::picture(exact(), world::width, world::height);
    const cv::Mat gray(world::height, world::width, CV_8U,
                       const_cast<std::uint8_t *>(pixels.data()));
    cv::Mat bgr(gray.size(), CV_8UC3), bgra(gray.size(), CV_8UC4), deep, real, wide;
    cv::merge(std::vector<cv::Mat>{gray, gray, gray}, bgr);
    cv::merge(std::vector<cv::Mat>{gray, gray, gray, cv::Mat::zeros(gray.size(), CV_8U)}, bgra);
    gray.convertTo(deep, CV_16U, 257), gray.convertTo(real, CV_32F, 1 / 255.0);
    cv::hconcat(gray, gray, wide);
    const cv::Mat part =
        wide(cv::Rect(int(world::width), 0, int(world::width), int(world::height)));

    const skep::NccWindow window = MUST(skep::NccWindow::create(5, 2, 3, 0.1));
    const skep::PackedImage reference = MUST(skep::PackedImage::create(gray));
    const std::vector<skep::Pixel> pixel = {{20, 17}};
    const std::vector<skep::Homography> shift = {{1, 0, 1.25, 0, 1, 0.5, 0, 0, 1}};
    std::vector<float> expected(1), ncc(1);
    MUST(skep::patch_ncc(window, reference, reference, pixel, shift, expected));
    CHECK(expected[0] < 0.999f);
    for (const cv::Mat &picture : {bgr, bgra, deep, real, part}) {
        const skep::PackedImage source = MUST(skep::PackedImage::create(picture));
        MUST(skep::patch_ncc(window, reference, source, pixel, shift, ncc));
        CHECK(ncc[0] == expected[0]);
    }
    // Colors come in OpenCV's order unless told otherwise.
    const cv::Mat colored(9, 9, CV_8UC3, cv::Scalar(255, 0, 0));
    CHECK(MUST(skep::image(colored)).format == SKEP_FORMAT_BGR);
    CHECK(MUST(skep::image(bgra, skep::Order::Rgb)).format == SKEP_FORMAT_RGBA);
    CHECK(MUST(skep::image(part)).stride_bytes == 2 * world::width);
    FAILS(SKEP_ERR_ARGUMENT, "picture", skep::image(cv::Mat()));
    FAILS(SKEP_ERR_ARGUMENT, "picture", skep::PackedImage::create(cv::Mat(9, 9, CV_64F)));
}

static void test_maps(const std::string &folder) {
    skep::Scene scene = MUST(skep::Scene::create());
    for (double place : {0.0, 0.8, -0.8}) {
        const skep_camera camera = world::camera(place, world::width, world::height);
        const auto pixels = world::picture(camera, world::width, world::height);
        const cv::Mat picture(world::height, world::width, CV_8U,
                              const_cast<std::uint8_t *>(pixels.data()));
        MUST(scene.set_depth_range(MUST(scene.add_view(picture, camera, nullptr)), {2, 12}));
    }
    cv::Mat mask(world::height, world::width, CV_8U, cv::Scalar(255));
    mask.at<std::uint8_t>(5, 6) = 0;
    MUST(scene.set_mask(0, mask));
    FAILS(SKEP_ERR_ARGUMENT, "mask", scene.set_mask(0, cv::Mat(5, 5, CV_8U)));
    skep::Options options = MUST(skep::Options::create());
    MUST(options.set("schedule.scales", "downscale=1 food_sources=3 iterations=3+0x1"));
    const skep::Result result = MUST(skep::reconstruct(scene, options));

    const skep::Map<float> own_depth = MUST(result.depth(0, skep::Maps::Raw));
    const skep::Map<float> own_normal = MUST(result.normal(0, skep::Maps::Raw));
    cv::Mat depth, normal, cost, status, count, bits;
    MUST(result.depth(0, skep::Maps::Raw, depth)), MUST(result.normal(0, skep::Maps::Raw, normal));
    MUST(result.cost(0, cost)), MUST(result.status(0, status));
    MUST(result.source_count(0, count)), MUST(result.source_bits(0, 0, bits));
    CHECK(depth.type() == CV_32F && normal.type() == CV_32FC3 && cost.type() == CV_32F);
    CHECK(status.type() == CV_8U && count.type() == CV_16U && bits.type() == CV_32S);
    CHECK(depth.at<float>(20, 30) == own_depth.at(30, 20));
    CHECK(normal.at<cv::Vec3f>(20, 30)[1] == own_normal.at(30, 20, 1));
    CHECK(status.at<std::uint8_t>(5, 6) == SKEP_PIXEL_MASKED && count.rows == int(world::height));

    // A part of a larger matrix stays where it is; cv::Mat_ must have the size.
    cv::Mat wide(world::height, world::width + 9, CV_32F, cv::Scalar(-1));
    MUST(result.depth(0, skep::Maps::Raw,
                      wide(cv::Rect(4, 0, int(world::width), int(world::height)))));
    CHECK(wide.at<float>(20, 34) == own_depth.at(30, 20) && wide.at<float>(20, 3) == -1);
    cv::Mat_<float> typed(int(world::height), int(world::width)), small(3, 3);
    MUST(result.depth(0, skep::Maps::Raw, typed));
    CHECK(typed(20, 30) == own_depth.at(30, 20));
    FAILS(SKEP_ERR_ARGUMENT, "3 x 3; expected 56 x 42", result.depth(0, skep::Maps::Raw, small));

    // Back in: files, fusion and estimates take the same matrices.
    MUST(skep::write_depth_map(folder + "/depth.bin", depth));
    CHECK(MUST(skep::read_depth_map(folder + "/depth.bin")).data == own_depth.data);
    const skep::FusionView view = {MUST(scene.camera(0)),
                                   MUST(skep::map_view<float>(depth)),
                                   MUST(skep::map_view<float>(normal, 3)),
                                   {},
                                   std::nullopt};
    MUST(options.set("fusion.min_agreeing_views", 0));
    const skep::Cloud cloud =
        MUST(skep::fuse(skep::Span<const skep::FusionView>(&view, 1), options));
    CHECK(MUST(cloud.size()) == std::size_t(cv::countNonZero(depth)));
    const skep::Stepper stepper = MUST(skep::Stepper::create(scene, options));
    const skep::Estimate estimate =
        MUST(stepper.estimate_from_maps(0, 0, depth, normal, mask, cost));
    CHECK(MUST(estimate.maps()).depth == own_depth.data);
    FAILS(SKEP_ERR_ARGUMENT, "depth", stepper.estimate_from_maps(0, 0, status, normal));
}

int main(int argc, char **argv) {
    CHECK(argc == 2);
    test_cameras();
    test_homographies();
    test_pictures();
    test_maps(argv[1]);
}
