// Stepwise runs, estimates, and fusion.
#include "parts.hpp"
#include "test.hpp"

/// Runs all cycles of all views, as skep.h describes it.
static std::vector<skep::Estimate> run_all_cycles(const skep::Stepper &stepper) {
    const std::uint32_t views = MUST(stepper.view_count());
    std::vector<skep::Estimate> estimates(views);
    std::optional<std::uint32_t> cycle = 0;
    while (cycle) {
        const std::uint32_t pixels = [&] {
            const skep::Size size = MUST(stepper.size(*cycle, 0));
            return size.width * size.height;
        }();
        for (std::uint32_t view = 0; view < views; ++view)
            if (estimates[view] && MUST(estimates[view].info()).pixels < pixels)
                estimates[view] = MUST(stepper.upsample(*cycle, view, estimates[view]));
        std::vector<skep::Estimate> found(views), checked(views);
        for (std::uint32_t view = 0; view < views; ++view) {
            const skep::Candidates candidates = MUST(stepper.propagate(*cycle, view, estimates));
            found[view] = MUST(stepper.search(*cycle, view, estimates, candidates));
        }
        for (std::uint32_t view = 0; view < views; ++view)
            checked[view] = MUST(stepper.check(*cycle, view, found));
        estimates = std::move(checked);
        cycle = MUST(stepper.next(*cycle, estimates));
    }
    return estimates;
}

void test_stepper_equal_whole() {
    const skep::Scene scene = made_scene();
    const skep::Options options = quick_options();
    const skep::Result whole = MUST(skep::reconstruct(scene, options));
    const skep::Stepper stepper = MUST(skep::Stepper::create(scene, options));
    CHECK(MUST(stepper.cycle_count()) == 6 && MUST(stepper.cycle(0)).downscale == 2);
    CHECK(MUST(stepper.sources(0)) == MUST(whole.sources(0)));

    const std::vector<skep::Estimate> estimates = run_all_cycles(stepper);
    std::vector<skep::Result> parts;
    for (std::uint32_t view = 0; view < 5; ++view) {
        parts.push_back(MUST(stepper.finish(view, estimates)));
        const skep::Result &part = parts.back();
        for (skep::Maps which : {skep::Maps::Raw, skep::Maps::Validated}) {
            CHECK(MUST(part.depth(view, which)).data == MUST(whole.depth(view, which)).data);
            CHECK(MUST(part.normal(view, which)).data == MUST(whole.normal(view, which)).data);
        }
        CHECK(MUST(part.cost(view)).data == MUST(whole.cost(view)).data);
        CHECK(MUST(part.status(view)).data == MUST(whole.status(view)).data);
        CHECK(MUST(part.source_bits(view, 0)).data == MUST(whole.source_bits(view, 0)).data);
    }
    FAILS(SKEP_ERR_ARGUMENT, "single view", parts[0].cloud());

    // Their validated maps fuse to the same points.
    std::vector<skep::Map<float>> depths, normals, confidences;
    std::vector<std::vector<std::uint8_t>> pictures;
    std::vector<skep::FusionView> views;
    for (std::uint32_t view = 0; view < 5; ++view) {
        depths.push_back(MUST(parts[view].depth(view, skep::Maps::Validated)));
        normals.push_back(MUST(parts[view].normal(view, skep::Maps::Validated)));
        confidences.push_back(MUST(parts[view].confidence(view)));
        const skep_camera camera = MUST(scene.camera(view));
        pictures.push_back(world::picture(camera, world::width, world::height));
        views.push_back({camera, MUST(skep::map_view<float>(depths.back())),
                         MUST(skep::map_view<float>(normals.back(), 3)), MUST(scene.overlap(view)),
                         skep_image{pictures.back().data(), world::width, world::height,
                                    world::width, SKEP_FORMAT_GRAY},
                         MUST(skep::map_view<float>(confidences.back()))});
    }
    const skep::Points by_hand = MUST(MUST(skep::fuse(views, options)).points());
    const skep::Points by_run = MUST(MUST(whole.cloud()).points());
    CHECK(by_hand.positions == by_run.positions && by_hand.colors == by_run.colors);
    CHECK(by_hand.normals == by_run.normals);

    FAILS(SKEP_ERR_CANCELLED, "",
          skep::fuse(views, options, [](const skep::Progress &) { return skep::Flow::Cancel; }));
    views[2].normal.width -= 1;
    FAILS(SKEP_ERR_ARGUMENT, "views[2].normal is 55 x 42", skep::fuse(views, options));
}

void test_estimates() {
    const skep::Stepper stepper = MUST(skep::Stepper::create(made_scene(), quick_options()));
    const std::vector<skep::Estimate> none(5);
    const skep::Estimate found = MUST(stepper.search(0, 2, none));
    const skep_estimate_info info = MUST(found.info());
    CHECK(info.view == 2 && info.pixels == 28 * 21 && info.is_checked == 0);
    CHECK(MUST(stepper.search(0, 2, {})) && !none[0]);
    FAILS(SKEP_ERR_NULL, "estimate", none[0].info());
    FAILS(SKEP_ERR_CANCELLED, "",
          stepper.search(0, 2, none, skep::Candidates(),
                         [](const skep::Progress &) { return skep::Flow::Cancel; }));

    // As bytes and back: the same maps.
    const std::vector<std::uint8_t> bytes = MUST(found.save());
    const skep::Estimate::Content maps = MUST(found.maps());
    const skep::Estimate::Content loaded = MUST(MUST(stepper.load(bytes)).maps());
    CHECK(loaded.depth == maps.depth && loaded.normal == maps.normal && loaded.cost == maps.cost);
    FAILS(SKEP_ERR_ARGUMENT, "bytes", stepper.load({bytes.data(), bytes.size() - 1}));

    // From maps: they are returned unchanged, and pixels with a depth are validated by default.
    const skep::Size size = MUST(stepper.size(0, 2));
    skep::Map<float> depth(size), normal(size, 3);
    depth.at(3, 2) = 5, normal.at(3, 2, 2) = -1;
    depth.at(4, 2) = 6, normal.at(4, 2, 2) = -1;
    const std::size_t place = 2 * 28 + 3;
    const skep::Estimate given = MUST(stepper.estimate_from_maps(0, 2, depth, normal));
    const skep::Estimate::Content content = MUST(given.maps());
    CHECK(MUST(given.info()).is_checked == 1 && MUST(given.info()).validated == 2);
    CHECK(content.depth[place] == 5 && content.depth[place + 2] == 0);
    skep::Map<std::uint8_t> validated(size);
    validated.at(4, 2) = 1;
    const skep::Estimate doubted = MUST(stepper.estimate_from_maps(0, 2, depth, normal, validated));
    CHECK(MUST(doubted.maps()).validated[place] == 0 && MUST(doubted.info()).validated == 1);
    FAILS(SKEP_ERR_ARGUMENT, "normal", stepper.estimate_from_maps(0, 2, depth, depth));
    FAILS(SKEP_ERR_ARGUMENT, "28 x 21",
          stepper.estimate_from_maps(0, 2, skep::Map<float>({9, 9}), normal));
}
