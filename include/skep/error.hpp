// Errors as exceptions or as values, and the few words that all other parts use. Part of skep.hpp.
#ifndef SKEP_ERROR_HPP
#define SKEP_ERROR_HPP

#include "../skep.h"

#include <cstdlib>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#if !defined(SKEP_NO_EXCEPTIONS) && !defined(__cpp_exceptions) && !defined(_CPPUNWIND)
#define SKEP_NO_EXCEPTIONS
#endif

// Parts of a program that handle errors differently, or are compiled as another C++, may be linked
// together.
#if defined(SKEP_NO_EXCEPTIONS) && __cplusplus >= 202002L
#define SKEP_FLAVOR expected_20
#elif defined(SKEP_NO_EXCEPTIONS)
#define SKEP_FLAVOR expected_17
#elif __cplusplus >= 202002L
#define SKEP_FLAVOR throwing_20
#else
#define SKEP_FLAVOR throwing_17
#endif

namespace skep {
inline namespace SKEP_FLAVOR {

/// Why a call failed.
class Error : public std::exception {
  public:
    Error(skep_status status, std::string text) : status_(status), text_(std::move(text)) {}
    /// One of the SKEP_ERR_ codes.
    skep_status status() const noexcept { return status_; }
    /// Which argument was wrong, its value, and what would have been right.
    const char *what() const noexcept override { return text_.c_str(); }

  private:
    skep_status status_;
    std::string text_;
};

/// A value, or the reason why there is none. Asking for the one that is not there ends the program.
template <class T> class [[nodiscard]] Expected {
  public:
    Expected(T value) : content_(std::move(value)) {}
    Expected(Error error) : content_(std::move(error)) {}
    explicit operator bool() const noexcept { return std::holds_alternative<T>(content_); }
    T &value() & { return there(std::get_if<T>(&content_)); }
    const T &value() const & { return there(std::get_if<T>(&content_)); }
    T value() && { return std::move(value()); }
    T &operator*() & { return value(); }
    const T &operator*() const & { return value(); }
    T operator*() && { return std::move(value()); }
    T *operator->() { return &value(); }
    const T *operator->() const { return &value(); }
    const Error &error() const { return there(std::get_if<Error>(&content_)); }

  private:
    template <class U> static U &there(U *found) { return found ? *found : (std::abort(), *found); }
    std::variant<T, Error> content_;
};

template <> class [[nodiscard]] Expected<void> {
  public:
    Expected() = default;
    Expected(Error error) : error_(std::move(error)) {}
    explicit operator bool() const noexcept { return !error_; }
    const Error &error() const { return error_ ? *error_ : (std::abort(), *error_); }

  private:
    std::optional<Error> error_;
};

/// T where errors are exceptions, else Expected<T>.
#ifdef SKEP_NO_EXCEPTIONS
template <class T> using Fallible = Expected<T>;
#else
template <class T> using Fallible = T;
#endif

namespace detail {
/// The status and the text of a call, before they become an exception or an Expected.
struct Status {
    skep_status status = SKEP_OK;
    std::string text;

    Status() = default;
    Status(skep_status of_call) : status(of_call) {
        if (status == SKEP_OK)
            return;
        text.resize(skep_last_error(nullptr, 0));
        skep_last_error(text.data(), text.size());
        if (!text.empty())
            text.pop_back(); // the NUL
    }
    /// Something this header finds, in the words of the library.
    static Status argument(const std::string &name, const std::string &value,
                           const std::string &expected) {
        Status status;
        status.status = SKEP_ERR_ARGUMENT;
        status.text = name + " is " + value + "; expected " + expected;
        return status;
    }
    explicit operator bool() const noexcept { return status == SKEP_OK; }
    /// Calls `next` unless something failed before.
    template <class Next> Status then(Next next) && {
        return *this ? Status(next()) : std::move(*this);
    }
};

#ifdef SKEP_NO_EXCEPTIONS
template <class T> Fallible<T> give(Status status, T &value) {
    if (!status)
        return Error(status.status, std::move(status.text));
    return std::move(value);
}
inline Fallible<void> give(Status status) {
    if (!status)
        return Error(status.status, std::move(status.text));
    return {};
}
#else
inline void give(Status status) {
    if (!status)
        throw Error(status.status, std::move(status.text));
}
template <class T> T give(Status status, T &value) {
    give(std::move(status));
    return std::move(value);
}
#endif

/// A list of the C interface: asks for its length, then for its items. `call(items, capacity,
/// &count)`.
template <class T, class Call> Fallible<std::vector<T>> list(Call call) {
    std::vector<T> items;
    std::size_t count = 0;
    Status status = call(nullptr, 0, &count);
    if (status) {
        items.resize(count);
        status = call(items.data(), items.size(), &count);
    }
    return give(std::move(status), items);
}
/// A text of the C interface, likewise.
template <class Call> Status text(std::string &out, Call call) {
    std::size_t needed = 0;
    return Status(call(nullptr, 0, &needed)).then([&] {
        out.resize(needed);
        const skep_status status = call(out.data(), out.size(), &needed);
        if (status == SKEP_OK && !out.empty())
            out.pop_back(); // the NUL
        return status;
    });
}
} // namespace detail

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_ERROR_HPP
