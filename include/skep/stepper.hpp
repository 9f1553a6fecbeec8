// The stepwise level: the stages of a run on single views. Part of skep.hpp.
#ifndef SKEP_STEPPER_HPP
#define SKEP_STEPPER_HPP

#include "result.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// The maps of one view after skep_stepper_search or skep_stepper_check; empty: no estimate yet.
class Estimate : public detail::Handle<skep_estimate, skep_estimate_destroy> {
  public:
    using Handle::Handle;
    Fallible<skep_estimate_info> info() const {
        skep_estimate_info info = {};
        return detail::give(skep_estimate_get_info(get(), &info), info);
    }
    struct Content {
        std::vector<float> depth, normal, cost;
        std::vector<std::uint8_t> validated;
    };
    Fallible<Content> maps() const {
        Content maps;
        skep_estimate_info info = {};
        detail::Status status = detail::Status(skep_estimate_get_info(get(), &info)).then([&] {
            const std::size_t pixels = std::size_t(info.pixels);
            maps.depth.resize(pixels), maps.normal.resize(3 * pixels);
            maps.cost.resize(pixels), maps.validated.resize(pixels);
            return skep_estimate_get_maps(get(), maps.depth.data(), maps.normal.data(),
                                          maps.cost.data(), maps.validated.data(), pixels);
        });
        return detail::give(std::move(status), maps);
    }
    Fallible<std::vector<std::uint8_t>> save() const {
        return detail::list<std::uint8_t>(
            [&](auto... out) { return skep_estimate_save(get(), out...); });
    }
};

/// Planes of other views, transferred to the pixels of a view.
class Candidates : public detail::Handle<skep_candidates, skep_candidates_destroy> {
  public:
    using Handle::Handle;
};

/// The stages of a run on single views; skep.h lists their order, what each changes and what each
/// reads. Spans of estimates hold one for each view of the scene, empty where there is none yet; an
/// empty span stands for no estimates at all.
class Stepper : public detail::Handle<skep_stepper, skep_stepper_destroy> {
  public:
    using Handle::Handle;
    static Fallible<Stepper> create(const Scene &scene, OptionsOrDefault options = {}) {
        Stepper stepper;
        detail::Status status = options.check().then(
            [&] { return skep_stepper_create(scene.get(), options.get(), stepper.put()); });
        return detail::give(std::move(status), stepper);
    }
    Fallible<std::uint32_t> cycle_count() const {
        std::uint32_t count = 0;
        return detail::give(skep_stepper_get_count(get(), &count, nullptr), count);
    }
    Fallible<std::uint32_t> view_count() const {
        std::uint32_t count = 0;
        return detail::give(skep_stepper_get_count(get(), nullptr, &count), count);
    }
    Fallible<skep_cycle> cycle(std::uint32_t cycle) const {
        skep_cycle out = {};
        return detail::give(skep_stepper_get_cycle(get(), cycle, &out), out);
    }
    Fallible<Size> size(std::uint32_t cycle, std::uint32_t view) const {
        Size size;
        return detail::give(skep_stepper_get_size(get(), cycle, view, &size.width, &size.height),
                            size);
    }
    Fallible<std::vector<std::uint32_t>> sources(std::uint32_t view) const {
        return detail::list<std::uint32_t>(
            [&](auto... out) { return skep_stepper_get_sources(get(), view, out...); });
    }
    Fallible<Candidates> propagate(std::uint32_t cycle, std::uint32_t view,
                                   Span<const Estimate> estimates) const {
        Candidates candidates;
        const Raw raw(estimates);
        return detail::give(
            skep_stepper_propagate(get(), cycle, view, raw.data(), raw.size(), candidates.put()),
            candidates);
    }
    /// Candidates may be empty. The estimate is to be checked before anything else.
    Fallible<Estimate> search(std::uint32_t cycle, std::uint32_t view,
                              Span<const Estimate> estimates,
                              const Candidates &candidates = Candidates(),
                              const ProgressCallback &progress = {}) const {
        Estimate estimate;
        const Raw raw(estimates);
        detail::Status status = progress.run([&](skep_progress_fn callback, void *user) {
            return skep_stepper_search(get(), cycle, view, raw.data(), raw.size(), candidates.get(),
                                       callback, user, estimate.put());
        });
        return detail::give(std::move(status), estimate);
    }
    Fallible<Estimate> check(std::uint32_t cycle, std::uint32_t view,
                             Span<const Estimate> estimates) const {
        Estimate estimate;
        const Raw raw(estimates);
        return detail::give(
            skep_stepper_check(get(), cycle, view, raw.data(), raw.size(), estimate.put()),
            estimate);
    }
    Fallible<Estimate> upsample(std::uint32_t cycle, std::uint32_t view,
                                const Estimate &estimate) const {
        Estimate finer;
        return detail::give(skep_stepper_upsample(get(), cycle, view, estimate.get(), finer.put()),
                            finer);
    }
    /// The cycle after this one; nothing after the last.
    Fallible<std::optional<std::uint32_t>> next(std::uint32_t cycle,
                                                Span<const Estimate> estimates) const {
        std::uint32_t next = SKEP_CYCLE_NONE;
        const Raw raw(estimates);
        detail::Status status = skep_stepper_next(get(), cycle, raw.data(), raw.size(), &next);
        std::optional<std::uint32_t> found;
        if (next != SKEP_CYCLE_NONE)
            found = next;
        return detail::give(std::move(status), found);
    }
    Fallible<Result> finish(std::uint32_t view, Span<const Estimate> estimates,
                            const ProgressCallback &progress = {}) const {
        Result result;
        const Raw raw(estimates);
        detail::Status status = progress.run([&](skep_progress_fn callback, void *user) {
            return skep_stepper_finish(get(), view, raw.data(), raw.size(), callback, user,
                                       result.put());
        });
        return detail::give(std::move(status), result);
    }
    /// An estimate from maps of one and three floats a pixel; optionally with a map of bytes, not 0
    /// where the plane counts as validated, and a map of costs. An empty Map stands for none.
    template <class Depth, class Normal, class Validated = Map<std::uint8_t>,
              class Cost = Map<float>>
    Fallible<Estimate> estimate_from_maps(std::uint32_t cycle, std::uint32_t view,
                                          const Depth &depth, const Normal &normal,
                                          const Validated &validated = {},
                                          const Cost &cost = {}) const {
        Estimate estimate;
        Size size;
        MapView<const float> depths, normals, costs;
        MapView<const std::uint8_t> verdicts;
        detail::Status status =
            detail::Status(skep_stepper_get_size(get(), cycle, view, &size.width, &size.height))
                .then([&] { return sized(depth, size, 1, "depth", depths); })
                .then([&] { return sized(normal, size, 3, "normal", normals); })
                .then([&] {
                    return is_none(validated) ? detail::Status()
                                              : sized(validated, size, 1, "validated", verdicts);
                })
                .then([&] {
                    return is_none(cost) ? detail::Status() : sized(cost, size, 1, "cost", costs);
                })
                .then([&] {
                    return skep_estimate_from_maps(
                        get(), cycle, view, depths.data, depths.stride_bytes, normals.data,
                        normals.stride_bytes, verdicts.data, verdicts.stride_bytes, costs.data,
                        costs.stride_bytes, estimate.put());
                });
        return detail::give(std::move(status), estimate);
    }
    /// An estimate from the bytes of Estimate::save.
    Fallible<Estimate> load(Span<const std::uint8_t> bytes) const {
        Estimate estimate;
        return detail::give(skep_estimate_load(get(), bytes.data(), bytes.size(), estimate.put()),
                            estimate);
    }

  private:
    struct Raw : std::vector<const skep_estimate *> {
        explicit Raw(Span<const Estimate> estimates) {
            for (const Estimate &estimate : estimates)
                push_back(estimate.get());
        }
    };
    template <class T, class M>
    static detail::Status sized(const M &map, Size size, std::uint32_t channels, const char *name,
                                MapView<T> &view) {
        return detail::view_of<T>(map, channels, name, view).then([&] {
            return detail::make<T>(view, size, channels, name, view);
        });
    }
    template <class M> static bool is_none(const M &map) {
        if constexpr (detail::IsMat<const M>::value)
            return map.data == nullptr;
        else if constexpr (std::is_pointer_v<decltype(map.data)>)
            return map.data == nullptr;
        else
            return map.data.empty();
    }
};

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_STEPPER_HPP
