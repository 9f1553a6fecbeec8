// Assertions. A test continues after a failure, and the exit status is the number of failures.
#pragma once

#include <skep.h>

#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

namespace check {

inline int failures = 0;

inline void expect(bool holds, const char *what, const char *file, int line)
{
    if (!holds) {
        std::fprintf(stderr, "%s:%d: expected %s\n", file, line, what);
        failures += 1;
    }
}

// Prints the measured value, so that a log has its distance from the bound.
inline void expect_at_most(double measured, double bound, const char *what)
{
    std::printf("  %-72s %.4g (at most %.4g)\n", what, measured, bound);
    if (!(measured <= bound)) {
        std::fprintf(stderr, "expected at most %g for %s, measured %g\n", bound, what, measured);
        failures += 1;
    }
}

inline int finish()
{
    std::printf("%s\n", failures == 0 ? "passed" : "FAILED");
    return failures == 0 ? 0 : 1;
}

// The text of the last call of the library that failed.
inline std::string last_error()
{
    std::string text(skep_last_error(nullptr, 0), '\0');
    skep_last_error(&text[0], text.size());
    return text.c_str();
}

// For calls without whose success the test cannot continue.
inline void must(skep_status status)
{
    if (status != SKEP_OK) {
        throw std::runtime_error(last_error());
    }
}

template <typename T> using Owned = std::unique_ptr<T, void (*)(T *)>;

} // namespace check

#define EXPECT(condition) check::expect((condition), #condition, __FILE__, __LINE__)
