// Maps in COLMAP's files. Part of skep.hpp.
#ifndef SKEP_FILES_HPP
#define SKEP_FILES_HPP

#include "result.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// The view set of each pixel.
struct ConsistencyGraph {
    Size size;
    ViewLists lists;
};

/// Writes a depth map in COLMAP's layout.
template <class M> Fallible<void> write_depth_map(const std::string &file, const M &depth) {
    MapView<const float> map;
    return detail::give(detail::view_of<const float>(depth, 1, "depth", map).then([&] {
        return skep_write_depth_map(file.c_str(), map.data, map.width, map.height,
                                    map.stride_bytes);
    }));
}

/// Writes a normal map in COLMAP's layout.
template <class M> Fallible<void> write_normal_map(const std::string &file, const M &normal) {
    MapView<const float> map;
    return detail::give(detail::view_of<const float>(normal, 3, "normal", map).then([&] {
        return skep_write_normal_map(file.c_str(), map.data, map.width, map.height,
                                     map.stride_bytes);
    }));
}

inline Fallible<void> write_consistency_graph(const std::string &file,
                                              const ConsistencyGraph &graph) {
    const auto &[counts, views] = graph.lists;
    if (counts.size() != std::size_t(graph.size.width) * graph.size.height)
        return detail::give(
            detail::Status::argument("counts", std::to_string(counts.size()) + " long",
                                     detail::by(graph.size.width, graph.size.height)));
    return detail::give(skep_write_consistency_graph(file.c_str(), graph.size.width,
                                                     graph.size.height, counts.data(), views.data(),
                                                     views.size()));
}

namespace detail {
template <class Call>
Fallible<Map<float>> read_map(Call call, const std::string &file, std::uint32_t channels) {
    Map<float> map;
    Size size;
    Status status = Status(call(file.c_str(), nullptr, 0, &size.width, &size.height)).then([&] {
        map = Map<float>(size, channels);
        return call(file.c_str(), map.data.data(), map.data.size(), &size.width, &size.height);
    });
    return give(std::move(status), map);
}
} // namespace detail

inline Fallible<Map<float>> read_depth_map(const std::string &file) {
    return detail::read_map(skep_read_depth_map, file, 1);
}

inline Fallible<Map<float>> read_normal_map(const std::string &file) {
    return detail::read_map(skep_read_normal_map, file, 3);
}

inline Fallible<ConsistencyGraph> read_consistency_graph(const std::string &file) {
    ConsistencyGraph graph;
    auto &[size, lists] = graph;
    std::size_t total = 0;
    const auto call = [&, &size = size, &lists = lists] {
        return skep_read_consistency_graph(
            file.c_str(), lists.counts.empty() ? nullptr : lists.counts.data(), lists.counts.size(),
            lists.views.empty() ? nullptr : lists.views.data(), lists.views.size(), &size.width,
            &size.height, &total);
    };
    detail::Status status = detail::Status(call()).then([&, &size = size, &lists = lists] {
        lists.counts.resize(std::size_t(size.width) * size.height), lists.views.resize(total);
        return call();
    });
    return detail::give(std::move(status), graph);
}

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_FILES_HPP
