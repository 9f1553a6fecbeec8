// Options, scenes, whole runs, progress, errors and clouds.
#include "parts.hpp"
#include "test.hpp"

#include <cmath>
#include <stdexcept>

skep::Scene made_scene() {
    skep::Scene scene = MUST(skep::Scene::create());
    for (double place : world::places) {
        const skep_camera camera = world::camera(place, world::width, world::height);
        const auto pixels = world::picture(camera, world::width, world::height);
        const skep_image image = {pixels.data(), world::width, world::height, world::width,
                                  SKEP_FORMAT_GRAY};
        const std::uint32_t view = MUST(scene.add_view(image, camera));
        MUST(scene.set_depth_range(view, {2, 12}));
    }
    return scene;
}

skep::Options quick_options() {
    skep::Options options = MUST(skep::Options::create());
    MUST(options.set("schedule.scales", "downscale=2 food_sources=4 iterations=4+2x1; "
                                        "downscale=1 food_sources=3 iterations=2+2x1"));
    MUST(options.set("min_changed_fraction", 0));
    return options;
}

void test_library() {
    CHECK(skep::abi_matches());
    CHECK(std::string(skep::version()).find('.') != std::string::npos);
    CHECK(!std::string(skep::simd_level_name()).empty());
}

void test_spans() {
    int array[3] = {1, 2, 3};
    std::vector<int> vector = {4, 5};
    const std::array<int, 2> fixed = {6, 7};
    CHECK(skep::Span<const int>(array).size() == 3 && skep::Span<int>(array).data() == array);
    CHECK(skep::Span<const int>(vector)[1] == 5 && skep::Span<const int>(fixed).size() == 2);
    int sum = 0;
    for (int element : skep::Span<const int>(vector))
        sum += element;
    CHECK(sum == 9 && skep::Span<int>().empty());
    // A map of constant values does not convert to a writable one.
    static_assert(!std::is_constructible_v<skep::Span<int>, const std::vector<int> &>);
    static_assert(!std::is_constructible_v<skep::Span<double>, std::vector<int> &>);
}

void test_options() {
    skep::Options options = MUST(skep::Options::create());
    MUST(options.set("threads", 2));
    CHECK(MUST(options.get("threads")) == 2);
    MUST(options.set("seed", std::to_string(std::uint64_t(1) << 63)));
    CHECK(MUST(options.text("seed")) == "9223372036854775808");
    MUST(options.set("simd", "scalar"));
    MUST(options.set("view_propagation", false));
    CHECK(MUST(options.text("search.view_propagation")) == "false");
    CHECK(MUST(quick_options().text("scales")) == "downscale=2 food_sources=4 iterations=4+2x1; "
                                                  "downscale=1 food_sources=3 iterations=2+2x1");
    // All options can be copied by their texts.
    skep::Options copy = MUST(skep::Options::create("paper"));
    for (const std::string &name : skep::Options::names())
        MUST(copy.set(name.c_str(), MUST(options.text(name.c_str()))));
    CHECK(MUST(copy.get("threads")) == 2 && MUST(copy.text("simd")) == "scalar");

    FAILS(SKEP_ERR_ARGUMENT, "thread", options.set("thread", 1));
    FAILS(SKEP_ERR_ARGUMENT, "simd", options.get("simd"));
    FAILS(SKEP_ERR_ARGUMENT, "min_changed_fraction", options.set("min_changed_fraction", 2));
    FAILS(SKEP_ERR_ARGUMENT, "quick", skep::Options::create("quick"));
    CHECK(MUST(options.get("threads")) == 2);
}

void test_scene() {
    skep::Scene scene = made_scene();
    CHECK(MUST(scene.view_count()) == 5 && MUST(scene.size(4)).width == world::width);
    CHECK(MUST(scene.camera(1)).fx == 1.1 * world::width && MUST(scene.name(3)) == "view0003.png");
    CHECK(MUST(scene.depth_range(0)).far_depth == 12);
    CHECK(MUST(scene.sources(0)).size() == 4 && MUST(scene.overlap(2)).size() == 4);
    const std::uint32_t sources[] = {2, 1};
    MUST(scene.set_sources(0, sources));
    CHECK(MUST(scene.sources(0, quick_options())) == (std::vector<std::uint32_t>{2, 1}));
    const double degrees = MUST(scene.triangulation_angle(0, 1));
    CHECK(degrees > 5 && degrees < 15);
    MUST(scene.validate());

    const double positions[] = {0, 0, 5, 0.1, 0, 5};
    const std::uint32_t counts[] = {2, 3}, views[] = {0, 1, 0, 1, 2};
    MUST(scene.add_points(positions, counts, views));
    FAILS(SKEP_ERR_ARGUMENT, "positions", scene.add_points({positions, 5}, counts, views));
    FAILS(SKEP_ERR_ARGUMENT, "view", scene.camera(5));
    FAILS(SKEP_ERR_ARGUMENT, "view", scene.set_depth_range(9, {1, 2}));
    FAILS(SKEP_ERR_ARGUMENT, "56 x 42", scene.set_mask(0, skep::Map<std::uint8_t>({5, 4})));
    FAILS(SKEP_ERR_ARGUMENT, "2 channel", scene.set_mask(0, skep::Map<std::uint8_t>({56, 42}, 2)));
    FAILS(SKEP_ERR_FILE, "nowhere", skep::Scene::read("nowhere"));
}

void test_moves() {
    static_assert(!std::is_copy_constructible_v<skep::Scene> &&
                  !std::is_copy_assignable_v<skep::Estimate>);
    static_assert(std::is_nothrow_move_constructible_v<skep::Result>);
    static_assert(std::is_nothrow_move_assignable_v<skep::Cloud>);
    skep::Scene scene = made_scene();
    skep::Scene taken = std::move(scene);
    CHECK(!scene && taken && MUST(taken.view_count()) == 5);
    FAILS(SKEP_ERR_NULL, "scene", scene.view_count());
    FAILS(SKEP_ERR_NULL, "scene", skep::reconstruct(scene));
    scene = std::move(taken);
    skep::Scene copied = MUST(scene.copy());
    MUST(copied.set_depth_range(0, {1, 77}));
    CHECK(MUST(copied.depth_range(0)).far_depth == 77 && MUST(scene.depth_range(0)).far_depth < 77);
    CHECK(MUST(scene.warnings()).empty() && MUST(copied.warnings()).empty());
    const skep::Scene empty = MUST(skep::Scene::create());
    FAILS(SKEP_ERR_ARGUMENT, "views", empty.warnings());
    skep::Scene &itself = scene;
    scene = std::move(itself);
    CHECK(scene && !taken);
    // Options that were moved from are not the default options.
    skep::Options options = quick_options(), kept = std::move(options);
    FAILS(SKEP_ERR_ARGUMENT, "options", skep::reconstruct(scene, options));
    FAILS(SKEP_ERR_NULL, "options", options.set("threads", 1));
    // An object handed over is destroyed by the caller, and can be taken back.
    skep::Scene back(scene.release());
    CHECK(!scene && MUST(back.view_count()) == 5);
}

/// Share of the pixels with a depth within 1 % of the wall.
double share_right(std::uint32_t view, const skep::Map<float> &depth) {
    const skep_camera camera = world::camera(world::places[view], world::width, world::height);
    int right = 0;
    for (std::uint32_t y = 0; y < world::height; ++y)
        for (std::uint32_t x = 0; x < world::width; ++x)
            right += std::abs(depth.at(x, y) / world::depth(camera, x, y) - 1) < 0.01;
    return double(right) / (world::width * world::height);
}

void test_run(const std::string &folder) {
    const skep::Scene scene = made_scene();
    double last = 0;
    const skep::Result result =
        MUST(skep::reconstruct(scene, quick_options(), [&](const skep::Progress &progress) {
            CHECK(progress.done >= last && progress.done <= 1 && progress.view_count == 5);
            last = progress.done;
        }));
    CHECK(last == 1 && MUST(result.warnings()).empty());

    const skep::Map<float> depth = MUST(result.depth(0, skep::Maps::Raw));
    CHECK(share_right(0, depth) > 0.9);
    CHECK(share_right(0, MUST(result.depth(0, skep::Maps::Validated))) > 0.8);
    const auto borrowed = MUST(result.borrow_depth(0));
    CHECK(borrowed.at(7, 9) == depth.at(7, 9) && borrowed.width == world::width);

    // Into a map with gaps between its rows, which stay as they are.
    std::vector<float> wide(60 * 42, -1);
    skep::MapView<float> view = {wide.data(), 56, 42, 1, 60 * sizeof(float)};
    MUST(result.depth(0, skep::Maps::Raw, view));
    CHECK(view.at(55, 41) == depth.at(55, 41) && wide[56] == -1 && wide[60] == depth.at(0, 1));
    view.height = 41;
    FAILS(SKEP_ERR_ARGUMENT, "56 x 41; expected 56 x 42", result.depth(0, skep::Maps::Raw, view));

    const skep::Map<float> normal = MUST(result.normal(0, skep::Maps::Raw));
    const world::Vector wall = world::normal(MUST(scene.camera(0)));
    CHECK(normal.channels == 3 && MUST(result.borrow_normal(0)).at(9, 9, 2) == normal.at(9, 9, 2));
    CHECK(normal.at(28, 21, 2) * wall[2] > 0.7);
    CHECK(MUST(result.cost(0)).at(28, 21) == MUST(result.borrow_cost(0)).at(28, 21));
    const skep::Map<std::uint8_t> status = MUST(result.status(0));
    CHECK(status.at(28, 21) == MUST(result.borrow_status(0)).at(28, 21));

    const skep_statistics statistics = MUST(result.statistics(0));
    std::uint64_t validated = 0;
    for (std::uint8_t value : status.data)
        validated += value == SKEP_PIXEL_VALIDATED;
    CHECK(statistics.status_counts[SKEP_PIXEL_VALIDATED] == validated &&
          statistics.ncc_evaluations > 0);
    CHECK(MUST(result.cycles(0)).size() == 6 && MUST(result.sources(0)).size() == 4);
    std::uint32_t bits = MUST(result.source_bits(0, 0)).at(28, 21);
    int count = 0;
    for (; bits != 0; bits &= bits - 1)
        ++count;
    CHECK(MUST(result.source_count(0)).at(28, 21) == count && MUST(result.size(2)).height == 42);

    const skep::Cloud cloud = MUST(result.cloud());
    const skep::Points points = MUST(cloud.points());
    const skep::ViewLists lists = MUST(cloud.views());
    const std::size_t size = MUST(cloud.size());
    CHECK(size > 500 && points.normals.size() == 3 * size && points.colors.size() == 3 * size);
    std::size_t total = 0, near_wall = 0;
    for (std::uint32_t of_point : lists.counts)
        total += of_point;
    for (std::size_t i = 0; i < size; ++i) {
        const double *p = &points.positions[3 * i];
        near_wall += std::abs(world::dot(world::wall_normal(), {p[0], p[1], p[2] - 5})) < 0.05;
    }
    CHECK(total == lists.views.size() && near_wall > size * 9 / 10);
    MUST(cloud.write_ply(folder + "/cloud.ply"));
    MUST(scene.write_colmap(folder));
    MUST(result.write_workspace(scene, folder));
    CHECK(MUST(MUST(skep::Scene::read(folder, {2, 12})).view_count()) == 5);
    FAILS(SKEP_ERR_ARGUMENT, "view", result.depth(5, skep::Maps::Raw));
}

void test_progress() {
    const skep::Scene scene = made_scene();
    const skep::Options options = quick_options();
    FAILS(SKEP_ERR_CANCELLED, "", skep::reconstruct(scene, options, [](const skep::Progress &) {
              return skep::Flow::Cancel;
          }));
    int calls = 0;
    const skep::ProgressCallback watch = [&](const skep::Progress &) {
        return ++calls, skep::Flow::Continue;
    };
    CHECK(MUST(skep::reconstruct(scene, options, watch)) && calls > 0);
#ifndef SKEP_NO_EXCEPTIONS
    // The exception passes through the library to the caller, once, and the run ends early.
    struct OwnException : std::runtime_error {
        using std::runtime_error::runtime_error;
    };
    int thrown = 0;
    try {
        skep::reconstruct(scene, options, [&](const skep::Progress &) {
            ++thrown;
            throw OwnException("enough");
        });
        CHECK(false);
    } catch (const OwnException &exception) {
        CHECK(std::string(exception.what()) == "enough" && thrown == 1);
    }
    // Also at the end, when the result exists already.
    try {
        skep::reconstruct(scene, options, [](const skep::Progress &progress) {
            if (progress.done >= 1)
                throw 7;
        });
        CHECK(false);
    } catch (int seven) {
        CHECK(seven == 7);
    }
    // With exceptions objects have constructors.
    skep::Scene empty;
    skep::Options defaults, literal("paper");
    CHECK(empty.view_count() == 0 && literal.get("best_views") == 0 &&
          defaults.get("best_views") > 0);
#else
    skep::Expected<skep::Scene> expected = skep::Scene::create();
    CHECK(expected && expected->view_count().value() == 0);
    CHECK(!expected->validate() && expected->validate().error().status() == SKEP_ERR_ARGUMENT);
#endif
}
