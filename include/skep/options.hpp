// Options. Part of skep.hpp.
//
// BEGIN OPTIONS
// END OPTIONS
#ifndef SKEP_OPTIONS_HPP
#define SKEP_OPTIONS_HPP

#include "object.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// Every number the method depends on, by name. The list at the top of this file explains each.
class Options : public detail::Handle<skep_options, skep_options_destroy> {
  public:
    using Handle::Handle;
#ifndef SKEP_NO_EXCEPTIONS
    /// Presets: "default", "fast" and "paper".
    explicit Options(const char *preset = "default") : Options(create(preset)) {}
#endif
    static Fallible<Options> create(const char *preset = "default") {
        Options options(static_cast<skep_options *>(nullptr));
        return detail::give(skep_options_create(preset, options.put()), options);
    }
    /// Sets an option that is a number, a whole number or a switch.
    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    Fallible<void> set(const char *name, Number value) {
        return detail::give(skep_options_set(get(), name, double(value)));
    }
    /// Sets any option from its text.
    Fallible<void> set(const char *name, const std::string &text) {
        return detail::give(skep_options_set_text(get(), name, text.c_str()));
    }
    /// The value of an option that is a number, a whole number or a switch (1 or 0).
    Fallible<double> get(const char *name) const {
        double value = 0;
        return detail::give(skep_options_get(get(), name, &value), value);
    }
    /// The text of any option, which set() takes.
    Fallible<std::string> text(const char *name) const {
        std::string text;
        detail::Status status = detail::text(
            text, [&](auto... out) { return skep_options_get_text(get(), name, out...); });
        return detail::give(std::move(status), text);
    }
    /// The names of all options.
    static std::vector<std::string> names() {
        std::vector<std::string> names;
        while (const char *name = skep_option_name(names.size()))
            names.emplace_back(name);
        return names;
    }
    using Handle::get;
};

/// Options, or none for the default.
class OptionsOrDefault {
  public:
    OptionsOrDefault() = default;
    OptionsOrDefault(const Options &options) : raw_(options.get()), is_empty_(!options) {}
    const skep_options *get() const noexcept { return raw_; }
    /// Options that were moved from are not the default.
    detail::Status check() const {
        return is_empty_ ? detail::Status::argument("options", "empty",
                                                    "options that were not moved from")
                         : detail::Status();
    }

  private:
    const skep_options *raw_ = nullptr;
    bool is_empty_ = false;
};

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_OPTIONS_HPP
