// A run taken apart. Part of skep.hpp.
#ifndef SKEP_STEPS_HPP
#define SKEP_STEPS_HPP

#include "result.hpp"

namespace skep {
inline namespace SKEP_FLAVOUR {

/// What is known of one view between two steps; empty when nothing is.
class State : public detail::Handle<skep_state, skep_state_destroy> {
  public:
    using Handle::Handle;
    Fallible<skep_state_info> info() const {
        skep_state_info info = {};
        return detail::give(skep_state_get_info(get(), &info), info);
    }
    struct Content {
        std::vector<float> depth, normal, cost;
        std::vector<std::uint8_t> validated;
    };
    Fallible<Content> maps() const {
        Content maps;
        skep_state_info info = {};
        detail::Outcome outcome = detail::Outcome(skep_state_get_info(get(), &info)).then([&] {
            const std::size_t pixels = std::size_t(info.pixels);
            maps.depth.resize(pixels), maps.normal.resize(3 * pixels);
            maps.cost.resize(pixels), maps.validated.resize(pixels);
            return skep_state_get_maps(get(), maps.depth.data(), maps.normal.data(),
                                       maps.cost.data(), maps.validated.data(), pixels);
        });
        return detail::give(std::move(outcome), maps);
    }
    Fallible<std::vector<std::uint8_t>> save() const {
        return detail::list<std::uint8_t>(
            [&](auto... out) { return skep_state_save(get(), out...); });
    }
};

/// Planes that other views offer to the pixels of a view.
class Offers : public detail::Handle<skep_offers, skep_offers_destroy> {
  public:
    using Handle::Handle;
};

/// A run taken apart; skep.h says in which order. States are one for each view of the scene, empty
/// ones where nothing is known; an empty span knows of none.
class Steps : public detail::Handle<skep_steps, skep_steps_destroy> {
  public:
    using Handle::Handle;
    static Fallible<Steps> create(const Scene &scene, OptionsOrDefault options = {}) {
        Steps steps;
        detail::Outcome outcome = options.check().then(
            [&] { return skep_steps_create(scene.get(), options.get(), steps.put()); });
        return detail::give(std::move(outcome), steps);
    }
    Fallible<std::uint32_t> step_count() const {
        std::uint32_t count = 0;
        return detail::give(skep_steps_get_count(get(), &count, nullptr), count);
    }
    Fallible<std::uint32_t> view_count() const {
        std::uint32_t count = 0;
        return detail::give(skep_steps_get_count(get(), nullptr, &count), count);
    }
    Fallible<skep_step> step(std::uint32_t step) const {
        skep_step out = {};
        return detail::give(skep_steps_get_step(get(), step, &out), out);
    }
    Fallible<Size> size(std::uint32_t step, std::uint32_t view) const {
        Size size;
        return detail::give(skep_steps_get_size(get(), step, view, &size.width, &size.height),
                            size);
    }
    Fallible<std::vector<std::uint32_t>> sources(std::uint32_t view) const {
        return detail::list<std::uint32_t>(
            [&](auto... out) { return skep_steps_get_sources(get(), view, out...); });
    }
    Fallible<Offers> propagate(std::uint32_t step, std::uint32_t view,
                               Span<const State> states) const {
        Offers offers;
        const Raw raw(states);
        return detail::give(
            skep_steps_propagate(get(), step, view, raw.data(), raw.size(), offers.put()), offers);
    }
    /// Offers may be empty.
    Fallible<State> search(std::uint32_t step, std::uint32_t view, Span<const State> states,
                           const Offers &offers = Offers(), const Watch &watch = {}) const {
        State state;
        const Raw raw(states);
        detail::Outcome outcome = watch.follow([&](skep_progress_fn callback, void *user) {
            return skep_steps_search(get(), step, view, raw.data(), raw.size(), offers.get(),
                                     callback, user, state.put());
        });
        return detail::give(std::move(outcome), state);
    }
    Fallible<State> check(std::uint32_t step, std::uint32_t view, Span<const State> states) const {
        State state;
        const Raw raw(states);
        return detail::give(
            skep_steps_check(get(), step, view, raw.data(), raw.size(), state.put()), state);
    }
    Fallible<State> hand_up(std::uint32_t step, std::uint32_t view, const State &state) const {
        State finer;
        return detail::give(skep_steps_hand_up(get(), step, view, state.get(), finer.put()), finer);
    }
    /// Nothing after the last step.
    Fallible<std::optional<std::uint32_t>> next(std::uint32_t step,
                                                Span<const State> states) const {
        std::uint32_t next = SKEP_STEP_NONE;
        const Raw raw(states);
        detail::Outcome outcome = skep_steps_next(get(), step, raw.data(), raw.size(), &next);
        std::optional<std::uint32_t> found;
        if (next != SKEP_STEP_NONE) found = next;
        return detail::give(std::move(outcome), found);
    }
    Fallible<Result> finish(std::uint32_t view, Span<const State> states,
                            const Watch &watch = {}) const {
        Result result;
        const Raw raw(states);
        detail::Outcome outcome = watch.follow([&](skep_progress_fn callback, void *user) {
            return skep_steps_finish(get(), view, raw.data(), raw.size(), callback, user,
                                     result.put());
        });
        return detail::give(std::move(outcome), result);
    }
    /// A state from maps of one and three floats a pixel. Pass what says which solutions count as
    /// validated (bytes) and what they cost (floats), or a Map that is empty.
    template <class Depth, class Normal, class Validated = Map<std::uint8_t>,
              class Cost = Map<float>>
    Fallible<State> state_from_maps(std::uint32_t step, std::uint32_t view, const Depth &depth,
                                    const Normal &normal, const Validated &validated = {},
                                    const Cost &cost = {}) const {
        State state;
        Size size;
        MapView<const float> depths, normals, costs;
        MapView<const std::uint8_t> verdicts;
        detail::Outcome outcome =
            detail::Outcome(skep_steps_get_size(get(), step, view, &size.width, &size.height))
                .then([&] { return sized(depth, size, 1, "depth", depths); })
                .then([&] { return sized(normal, size, 3, "normal", normals); })
                .then([&] {
                    return is_none(validated) ? detail::Outcome()
                                              : sized(validated, size, 1, "validated", verdicts);
                })
                .then([&] {
                    return is_none(cost) ? detail::Outcome() : sized(cost, size, 1, "cost", costs);
                })
                .then([&] {
                    return skep_state_from_maps(get(), step, view, depths.data, depths.stride_bytes,
                                                normals.data, normals.stride_bytes, verdicts.data,
                                                verdicts.stride_bytes, costs.data,
                                                costs.stride_bytes, state.put());
                });
        return detail::give(std::move(outcome), state);
    }
    Fallible<State> load(Span<const std::uint8_t> bytes) const {
        State state;
        return detail::give(skep_state_load(get(), bytes.data(), bytes.size(), state.put()), state);
    }

  private:
    struct Raw : std::vector<const skep_state *> {
        explicit Raw(Span<const State> states) {
            for (const State &state : states)
                push_back(state.get());
        }
    };
    template <class T, class M>
    static detail::Outcome sized(const M &map, Size size, std::uint32_t channels, const char *name,
                                 MapView<T> &view) {
        return detail::look<T>(map, channels, name, view).then([&] {
            return detail::make<T>(view, size, channels, name, view);
        });
    }
    template <class M> static bool is_none(const M &map) {
        if constexpr (detail::IsMat<const M>::value) return map.data == nullptr;
        else if constexpr (std::is_pointer_v<decltype(map.data)>) return map.data == nullptr;
        else return map.data.empty();
    }
};

} // namespace SKEP_FLAVOUR
} // namespace skep

#endif // SKEP_STEPS_HPP
