// Whole runs, their maps and clouds, and fusion. Part of skep.hpp.
#ifndef SKEP_RESULT_HPP
#define SKEP_RESULT_HPP

#include "scene.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// Three numbers a point each, and three bytes of red, green and blue.
struct Points {
    std::vector<double> positions;
    std::vector<float> normals;
    std::vector<std::uint8_t> colors;
};

/// Numbers of views, element after element, and how many of them each element has.
struct ViewLists {
    std::vector<std::uint32_t> counts, views;
};

/// Fused points.
class Cloud : public detail::Handle<skep_cloud, skep_cloud_destroy> {
  public:
    using Handle::Handle;
    Fallible<std::size_t> size() const {
        std::size_t count = 0;
        return detail::give(skep_cloud_get_count(get(), &count, nullptr), count);
    }
    Fallible<Points> points() const {
        Points points;
        std::size_t count = 0;
        detail::Status status =
            detail::Status(skep_cloud_get_count(get(), &count, nullptr)).then([&] {
                points.positions.resize(3 * count), points.normals.resize(3 * count),
                    points.colors.resize(3 * count);
                return skep_cloud_get_points(get(), points.positions.data(), points.normals.data(),
                                             points.colors.data(), count);
            });
        return detail::give(std::move(status), points);
    }
    /// The views each point was fused from.
    Fallible<ViewLists> views() const {
        ViewLists lists;
        std::size_t count = 0, total = 0;
        detail::Status status =
            detail::Status(skep_cloud_get_count(get(), &count, &total)).then([&] {
                lists.counts.resize(count), lists.views.resize(total);
                return skep_cloud_get_views(get(), lists.counts.data(), count, lists.views.data(),
                                            total);
            });
        return detail::give(std::move(status), lists);
    }
    Fallible<void> write_ply(const std::string &file) const {
        return detail::give(skep_cloud_write_ply(get(), file.c_str()));
    }
};

enum class Maps : std::uint32_t { Raw = SKEP_MAPS_RAW, Validated = SKEP_MAPS_VALIDATED };

/// Maps of views, and the cloud when they come from a whole run.
///
/// Maps are copied into what the caller passes, which may be a cv::Mat, or are returned as a
/// skep::Map. The borrow_ functions return views of the result's own memory, valid as long as it
/// lives.
class Result : public detail::Handle<skep_result, skep_result_destroy> {
  public:
    using Handle::Handle;
    Fallible<Size> size(std::uint32_t view) const {
        Size size;
        return detail::give(skep_result_get_size(get(), view, &size.width, &size.height), size);
    }
    template <class M> Fallible<void> depth(std::uint32_t view, Maps which, M &&map) const {
        return detail::give(copy<float>(skep_result_get_depth, 1, map, view, std::uint32_t(which)));
    }
    Fallible<Map<float>> depth(std::uint32_t view, Maps which) const {
        return copied<float>(skep_result_get_depth, 1, view, std::uint32_t(which));
    }
    template <class M> Fallible<void> normal(std::uint32_t view, Maps which, M &&map) const {
        return detail::give(
            copy<float>(skep_result_get_normal, 3, map, view, std::uint32_t(which)));
    }
    Fallible<Map<float>> normal(std::uint32_t view, Maps which) const {
        return copied<float>(skep_result_get_normal, 3, view, std::uint32_t(which));
    }
    template <class M> Fallible<void> cost(std::uint32_t view, M &&map) const {
        return detail::give(copy<float>(skep_result_get_cost, 1, map, view));
    }
    Fallible<Map<float>> cost(std::uint32_t view) const {
        return copied<float>(skep_result_get_cost, 1, view);
    }
    template <class M> Fallible<void> confidence(std::uint32_t view, M &&map) const {
        return detail::give(copy<float>(skep_result_get_confidence, 1, map, view));
    }
    Fallible<Map<float>> confidence(std::uint32_t view) const {
        return copied<float>(skep_result_get_confidence, 1, view);
    }
    /// SKEP_PIXEL_ values.
    template <class M> Fallible<void> status(std::uint32_t view, M &&map) const {
        return detail::give(copy<std::uint8_t>(skep_result_get_status, 1, map, view));
    }
    Fallible<Map<std::uint8_t>> status(std::uint32_t view) const {
        return copied<std::uint8_t>(skep_result_get_status, 1, view);
    }
    template <class M> Fallible<void> source_count(std::uint32_t view, M &&map) const {
        return detail::give(copy<std::uint16_t>(skep_result_get_source_count, 1, map, view));
    }
    Fallible<Map<std::uint16_t>> source_count(std::uint32_t view) const {
        return copied<std::uint16_t>(skep_result_get_source_count, 1, view);
    }
    /// A cv::Mat receives them as CV_32S.
    template <class M>
    Fallible<void> source_bits(std::uint32_t view, std::uint32_t word, M &&map) const {
        return detail::give(copy<std::uint32_t>(skep_result_get_source_bits, 1, map, view, word));
    }
    Fallible<Map<std::uint32_t>> source_bits(std::uint32_t view, std::uint32_t word) const {
        return copied<std::uint32_t>(skep_result_get_source_bits, 1, view, word);
    }
    Fallible<MapView<const float>> borrow_depth(std::uint32_t view) const {
        return borrowed<float>(skep_result_borrow_depth, 1, view);
    }
    Fallible<MapView<const float>> borrow_normal(std::uint32_t view) const {
        return borrowed<float>(skep_result_borrow_normal, 3, view);
    }
    Fallible<MapView<const float>> borrow_cost(std::uint32_t view) const {
        return borrowed<float>(skep_result_borrow_cost, 1, view);
    }
    Fallible<MapView<const float>> borrow_confidence(std::uint32_t view) const {
        return borrowed<float>(skep_result_borrow_confidence, 1, view);
    }
    Fallible<MapView<const std::uint8_t>> borrow_status(std::uint32_t view) const {
        return borrowed<std::uint8_t>(skep_result_borrow_status, 1, view);
    }
    Fallible<std::vector<std::uint32_t>> views() const {
        return detail::list<std::uint32_t>(
            [&](auto... out) { return skep_result_get_views(get(), out...); });
    }
    Fallible<std::vector<std::uint32_t>> sources(std::uint32_t view) const {
        return detail::list<std::uint32_t>(
            [&](auto... out) { return skep_result_get_sources(get(), view, out...); });
    }
    Fallible<std::vector<skep_cycle_record>> cycles(std::uint32_t view) const {
        return detail::list<skep_cycle_record>(
            [&](auto... out) { return skep_result_get_cycles(get(), view, out...); });
    }
    Fallible<skep_statistics> statistics(std::uint32_t view) const {
        skep_statistics statistics = {};
        return detail::give(skep_result_get_statistics(get(), view, &statistics), statistics);
    }
    /// Warnings of the run for its user, such as views without any source view.
    Fallible<std::vector<std::string>> warnings() const {
        std::vector<std::string> warnings;
        if (!*this)
            return detail::give(skep_result_get_warning(get(), 0, nullptr, 0, nullptr), warnings);
        std::string warning;
        while (detail::text(warning, [&](auto... out) {
            return skep_result_get_warning(get(), warnings.size(), out...);
        }))
            warnings.push_back(std::move(warning));
        return detail::give(SKEP_OK, warnings);
    }
    Fallible<Cloud> cloud() const {
        Cloud cloud;
        return detail::give(skep_result_get_cloud(get(), cloud.put()), cloud);
    }
    Fallible<void> write_workspace(const Scene &scene, const std::string &folder) const {
        return detail::give(skep_result_write_workspace(get(), scene.get(), folder.c_str()));
    }

  private:
    template <class T, class Call, class M, class... Where>
    detail::Status copy(Call call, std::uint32_t channels, M &map, std::uint32_t view,
                        Where... where) const {
        Size size;
        MapView<T> into;
        return detail::Status(skep_result_get_size(get(), view, &size.width, &size.height))
            .then([&] { return detail::make<T>(map, size, channels, "map", into); })
            .then([&] { return call(get(), view, where..., into.data, into.stride_bytes); });
    }
    template <class T, class Call, class... Where>
    Fallible<Map<T>> copied(Call call, std::uint32_t channels, std::uint32_t view,
                            Where... where) const {
        Map<T> map;
        detail::Status status = copy<T>(call, channels, map, view, where...);
        return detail::give(std::move(status), map);
    }
    template <class T, class Call>
    Fallible<MapView<const T>> borrowed(Call call, std::uint32_t channels,
                                        std::uint32_t view) const {
        MapView<const T> map;
        detail::Status status =
            detail::Status(skep_result_get_size(get(), view, &map.width, &map.height)).then([&] {
                return call(get(), view, &map.data);
            });
        map.channels = channels;
        map.stride_bytes = std::size_t(map.width) * channels * sizeof(T);
        return detail::give(std::move(status), map);
    }
};

/// A whole run.
inline Fallible<Result> reconstruct(const Scene &scene, OptionsOrDefault options = {},
                                    const ProgressCallback &progress = {}) {
    Result result;
    detail::Status status = options.check().then([&] {
        return progress.run([&](skep_progress_fn callback, void *user) {
            return skep_reconstruct(scene.get(), options.get(), callback, user, result.put());
        });
    });
    return detail::give(std::move(status), result);
}

/// A view to be fused: skep::map_view gives the maps, skep::image the picture.
struct FusionView {
    skep_camera camera;
    MapView<const float> depth;
    MapView<const float> normal;
    std::vector<std::uint32_t> overlap;
    std::optional<skep_image> image = std::nullopt;
    /// 1 for all pixels without.
    MapView<const float> confidence = {};
};

/// Fuses any maps.
inline Fallible<Cloud> fuse(Span<const FusionView> views, OptionsOrDefault options = {},
                            const ProgressCallback &progress = {}) {
    Cloud cloud;
    std::vector<skep_fusion_view> raw;
    detail::Status status = options.check();
    for (const FusionView &view : views) {
        const MapView<const float> &depth = view.depth, &normal = view.normal;
        const MapView<const float> &sure = view.confidence;
        if (status && sure.data && (depth.width != sure.width || depth.height != sure.height))
            status = detail::Status::argument(
                "views[" + std::to_string(raw.size()) + "].confidence",
                detail::by(sure.width, sure.height),
                detail::by(depth.width, depth.height) + ", as the depth");
        if (status && (depth.width != normal.width || depth.height != normal.height))
            status =
                detail::Status::argument("views[" + std::to_string(raw.size()) + "].normal",
                                         detail::by(normal.width, normal.height),
                                         detail::by(depth.width, depth.height) + ", as the depth");
        raw.push_back({&view.camera, depth.width, depth.height, depth.data, depth.stride_bytes,
                       normal.data, normal.stride_bytes, view.image ? &*view.image : nullptr,
                       view.overlap.data(), view.overlap.size(), view.confidence.data,
                       view.confidence.stride_bytes});
    }
    status = std::move(status).then([&] {
        return progress.run([&](skep_progress_fn callback, void *user) {
            return skep_fuse(raw.data(), raw.size(), options.get(), callback, user, cloud.put());
        });
    });
    return detail::give(std::move(status), cloud);
}

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_RESULT_HPP
