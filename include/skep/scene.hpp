// Scenes. Part of skep.hpp.
#ifndef SKEP_SCENE_HPP
#define SKEP_SCENE_HPP

#include "options.hpp"
#include "shapes.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// Depths in world units; {0, 0} stands for the range that the sparse points suggest.
struct DepthRange {
    double near_depth = 0, far_depth = 0;
};

/// Calibrated photographs and sparse points.
class Scene : public detail::Handle<skep_scene, skep_scene_destroy> {
  public:
    using Handle::Handle;
#ifndef SKEP_NO_EXCEPTIONS
    Scene() : Scene(create()) {}
#endif
    static Fallible<Scene> create() {
        Scene scene(nullptr);
        return detail::give(skep_scene_create(scene.put()), scene);
    }
    /// Later changes of one scene do not affect the other; pictures are shared.
    Fallible<Scene> copy() const {
        Scene scene(nullptr);
        return detail::give(skep_scene_copy(get(), scene.put()), scene);
    }
    /// A scene of any format that skep_scene_read reads; (0, 0) takes the depth ranges from it. Of the
    /// options input.*, threads and memory count; `progress` is told of the photographs that are read.
    static Fallible<Scene> read(const std::string &path, DepthRange range = {},
                                const skep_options *options = nullptr,
                                const ProgressCallback &progress = {}) {
        Scene scene(nullptr);
        return detail::give(progress.run([&](skep_progress_fn callback, void *user) {
            return skep_scene_read(path.c_str(), options, range.near_depth, range.far_depth, callback, user,
                                   scene.put());
        }),
                            scene);
    }
    Fallible<void> write_colmap(const std::string &folder) const {
        return detail::give(skep_scene_write_colmap(get(), folder.c_str()));
    }

    /// Adds a picture, which is copied, and returns its number. Colors are in OpenCV's order
    /// unless skep::image says otherwise.
    template <class Image>
    Fallible<std::uint32_t> add_view(const Image &picture, const skep_camera &camera,
                                     const char *name = nullptr) {
        std::uint32_t view = 0;
        skep_image image = {};
        detail::Status status = detail::image_of(picture, false, "picture", image).then([&] {
            return skep_scene_add_view(get(), name, &image, &camera, &view);
        });
        return detail::give(std::move(status), view);
    }
    /// A mask of the view's size, 8 bits a pixel, 0 where no depth is wanted.
    template <class Mask> Fallible<void> set_mask(std::uint32_t view, const Mask &mask) {
        MapView<const std::uint8_t> map;
        Size size;
        return detail::give(
            detail::view_of<const std::uint8_t>(mask, 1, "mask", map)
                .then([&] {
                    return skep_scene_get_view(get(), view, &size.width, &size.height, nullptr);
                })
                .then([&] { return detail::make<const std::uint8_t>(map, size, 1, "mask", map); })
                .then(
                    [&] { return skep_scene_set_mask(get(), view, map.data, map.stride_bytes); }));
    }
    Fallible<void> clear_mask(std::uint32_t view) {
        return detail::give(skep_scene_set_mask(get(), view, nullptr, 0));
    }
    Fallible<void> set_depth_range(std::uint32_t view, DepthRange range) {
        return detail::give(
            skep_scene_set_depth_range(get(), view, range.near_depth, range.far_depth));
    }
    Fallible<void> set_sources(std::uint32_t view, Span<const std::uint32_t> sources) {
        return detail::give(skep_scene_set_sources(get(), view, sources.data(), sources.size()));
    }
    /// x, y, z of each point; how many views saw it; and which, point after point.
    Fallible<void> add_points(Span<const double> positions, Span<const std::uint32_t> view_counts,
                              Span<const std::uint32_t> views) {
        if (positions.size() != 3 * view_counts.size())
            return detail::give(detail::Status::argument("positions",
                                                         std::to_string(positions.size()) + " long",
                                                         std::to_string(3 * view_counts.size())));
        return detail::give(skep_scene_add_points(get(), positions.data(), view_counts.size(),
                                                  view_counts.data(), views.data(), views.size()));
    }
    Fallible<void> validate() const { return detail::give(skep_scene_validate(get())); }
    /// Warnings about the scene for its user, such as depth ranges that no sparse point supports.
    Fallible<std::vector<std::string>> warnings() const {
        std::vector<std::string> warnings;
        // An invalid scene has none to list, and an error of its own.
        detail::Status status(skep_scene_validate(get()));
        if (!status)
            return detail::give(std::move(status), warnings);
        std::string warning;
        while (detail::text(warning, [&](auto... out) {
            return skep_scene_get_warning(get(), warnings.size(), out...);
        }))
            warnings.push_back(std::move(warning));
        return detail::give(SKEP_OK, warnings);
    }
    Fallible<std::uint32_t> view_count() const {
        std::uint32_t count = 0;
        return detail::give(skep_scene_get_view_count(get(), &count), count);
    }
    Fallible<Size> size(std::uint32_t view) const {
        Size size;
        return detail::give(skep_scene_get_view(get(), view, &size.width, &size.height, nullptr),
                            size);
    }
    Fallible<skep_camera> camera(std::uint32_t view) const {
        skep_camera camera = {};
        return detail::give(skep_scene_get_view(get(), view, nullptr, nullptr, &camera), camera);
    }
    Fallible<std::string> name(std::uint32_t view) const {
        std::string name;
        detail::Status status = detail::text(
            name, [&](auto... out) { return skep_scene_get_name(get(), view, out...); });
        return detail::give(std::move(status), name);
    }
    Fallible<DepthRange> depth_range(std::uint32_t view) const {
        DepthRange range;
        return detail::give(
            skep_scene_get_depth_range(get(), view, &range.near_depth, &range.far_depth), range);
    }
    Fallible<std::vector<std::uint32_t>> sources(std::uint32_t view,
                                                 OptionsOrDefault options = {}) const {
        return detail::list<std::uint32_t>([&](auto... out) {
            return options.check().then(
                [&] { return skep_scene_get_sources(get(), options.get(), view, out...); });
        });
    }
    Fallible<std::vector<std::uint32_t>> overlap(std::uint32_t view) const {
        return detail::list<std::uint32_t>(
            [&](auto... out) { return skep_scene_get_overlap(get(), view, out...); });
    }
    /// In degrees; -1 when the views see nothing together.
    Fallible<double> triangulation_angle(std::uint32_t reference, std::uint32_t source) const {
        double degrees = 0;
        return detail::give(skep_scene_get_triangulation_angle(get(), reference, source, &degrees),
                            degrees);
    }
};

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_SCENE_HPP
