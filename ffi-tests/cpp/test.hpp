// Helpers of the tests of skep.hpp: checks and macros that work with and without exceptions.
#pragma once

#include <skep.hpp>

#include <cstdio>
#include <cstdlib>
#include <string>

/// Ends the program unless the condition holds.
#define CHECK(condition)                                                                           \
    ((condition) ? void() : complain(__FILE__, __LINE__, "does not hold: " #condition, ""))

/// The value of a call that must succeed.
#ifdef SKEP_NO_EXCEPTIONS
#define MUST(...) must(__FILE__, __LINE__, __VA_ARGS__)
#else
#define MUST(...) (__VA_ARGS__)
#endif

/// A call that must fail with this status and these words in its text.
#define FAILS(status, words, ...)                                                                  \
    fails(__FILE__, __LINE__, status, words, [&]() { return __VA_ARGS__; })

[[noreturn]] inline void complain(const char *file, int line, const char *what, const char *text) {
    std::fprintf(stderr, "%s:%d: %s %s\n", file, line, what, text);
    std::exit(1);
}

inline void check_failure(const char *file, int line, skep_status status, const char *words,
                          const skep::Error &error) {
    if (error.status() != status) complain(file, line, "another status:", error.what());
    if (std::string(error.what()).find(words) == std::string::npos)
        complain(file, line, "another text:", error.what());
}

#ifdef SKEP_NO_EXCEPTIONS
template <class T> T must(const char *file, int line, skep::Expected<T> found) {
    if (!found) complain(file, line, "failed:", found.error().what());
    if constexpr (!std::is_void_v<T>) return *std::move(found);
}

template <class Call>
void fails(const char *file, int line, skep_status status, const char *words, Call call) {
    const auto found = call();
    if (found) complain(file, line, "did not fail", "");
    check_failure(file, line, status, words, found.error());
}
#else
template <class Call>
void fails(const char *file, int line, skep_status status, const char *words, Call call) {
    try {
        call();
    } catch (const skep::Error &error) {
        check_failure(file, line, status, words, error);
        return;
    }
    complain(file, line, "did not fail", "");
}
#endif
