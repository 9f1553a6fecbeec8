// What all objects and all long calls have in common. Part of skep.hpp.
#ifndef SKEP_OBJECT_HPP
#define SKEP_OBJECT_HPP

#include "error.hpp"

#include <functional>
#include <type_traits>

namespace skep {
inline namespace SKEP_FLAVOR {

using Progress = skep_progress;
enum class Flow { Continue, Cancel };

/// A callback that receives the progress of a call and may cancel it, or none.
class ProgressCallback {
  public:
    ProgressCallback() = default;
    template <class Callback, class Answer = std::invoke_result_t<Callback &, const Progress &>>
    ProgressCallback(Callback callback) {
        static_assert(std::is_void_v<Answer> || std::is_same_v<Answer, Flow>,
                      "callbacks return nothing or a skep::Flow");
        callback_ = [callback = std::move(callback)](const Progress &progress) mutable {
            if constexpr (std::is_void_v<Answer>)
                return callback(progress), Flow::Continue;
            else
                return callback(progress);
        };
    }

    /// Makes a call of the C interface that takes a callback: `call(callback, user)`.
    template <class Call> detail::Status run(Call call) const {
        Running running{callback_, nullptr};
        detail::Status status =
            call(callback_ ? &Running::report : nullptr, static_cast<void *>(&running));
        if (running.thrown)
            std::rethrow_exception(running.thrown);
        return status;
    }

  private:
    struct Running {
        const std::function<Flow(const Progress &)> &callback;
        std::exception_ptr thrown;

        static std::int32_t report(void *user, const skep_progress *progress) noexcept {
            auto &self = *static_cast<Running *>(user);
            if (self.thrown)
                return 1;
#ifdef SKEP_NO_EXCEPTIONS
            return self.callback(*progress) == Flow::Cancel;
#else
            try {
                return self.callback(*progress) == Flow::Cancel;
            } catch (...) {
                self.thrown = std::current_exception();
                return 1;
            }
#endif
        }
    };
    std::function<Flow(const Progress &)> callback_;
};

namespace detail {
/// Owns an object of the C interface, or nothing.
template <class Raw, void (*destroy)(Raw *)> class Handle {
  public:
    Handle() = default;
    /// Takes over an object.
    explicit Handle(Raw *raw) noexcept : raw_(raw) {}
    Handle(Handle &&other) noexcept : raw_(other.release()) {}
    Handle &operator=(Handle &&other) noexcept {
        if (this != &other)
            destroy(std::exchange(raw_, other.release()));
        return *this;
    }
    ~Handle() { destroy(raw_); }
    Raw *get() noexcept { return raw_; }
    const Raw *get() const noexcept { return raw_; }
    /// Hands the object over to the caller, who destroys it.
    Raw *release() noexcept { return std::exchange(raw_, nullptr); }
    explicit operator bool() const noexcept { return raw_ != nullptr; }
    /// Where a ..._create function puts an object; only for a handle that is empty.
    Raw **put() noexcept { return &raw_; }

  private:
    Raw *raw_ = nullptr;
};
} // namespace detail

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_OBJECT_HPP
