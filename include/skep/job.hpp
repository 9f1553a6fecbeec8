// Runs in a folder. Part of skep.hpp.
#ifndef SKEP_JOB_HPP
#define SKEP_JOB_HPP

#include "options.hpp"
#include "result.hpp"
#include "scene.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// What a task of a run does.
enum class Task : std::uint32_t {
    Search = SKEP_TASK_SEARCH,
    Check = SKEP_TASK_CHECK,
    Next = SKEP_TASK_NEXT,
    Finish = SKEP_TASK_FINISH,
    Fuse = SKEP_TASK_FUSE
};

/// A run in a folder.
class Job : public detail::Handle<skep_job, skep_job_destroy> {
  public:
    using Handle::Handle;
    /// Plans the run of a COLMAP scene, or goes on with the one in the folder.
    static Fallible<Job> plan(const std::string &scene, const std::string &folder,
                              OptionsOrDefault options = {}, DepthRange range = {0, 0},
                              bool fresh = false, const ProgressCallback &progress = {}) {
        Job job;
        detail::Status status = options.check().then([&] {
            return progress.run([&](skep_progress_fn callback, void *user) {
                return skep_job_plan(scene.c_str(), range.near_depth, range.far_depth, options.get(),
                                     folder.c_str(), fresh, callback, user, job.put());
            });
        });
        return detail::give(std::move(status), job);
    }
    /// Opens a run that was planned, for some of its tasks.
    static Fallible<Job> open(const std::string &folder, OptionsOrDefault options = {}) {
        Job job;
        detail::Status status = options.check().then(
            [&] { return skep_job_open(folder.c_str(), options.get(), job.put()); });
        return detail::give(std::move(status), job);
    }
    Fallible<std::uint32_t> cycle_count() const {
        std::uint32_t count = 0;
        return detail::give(skep_job_get_count(get(), &count, nullptr), count);
    }
    Fallible<std::uint32_t> view_count() const {
        std::uint32_t count = 0;
        return detail::give(skep_job_get_count(get(), nullptr, &count), count);
    }
    Fallible<skep_job_needs> needs() const {
        skep_job_needs needs = {};
        return detail::give(skep_job_get_needs(get(), &needs), needs);
    }
    Fallible<std::vector<std::uint32_t>> views_read(std::uint32_t view) const {
        return detail::list<std::uint32_t>(
            [&](auto... out) { return skep_job_get_views_read(get(), view, out...); });
    }
    /// Does all tasks that are not done; returns the number of points.
    Fallible<std::uint64_t> run(const ProgressCallback &progress = {}) const {
        std::uint64_t points = 0;
        detail::Status status = progress.run([&](skep_progress_fn callback, void *user) {
            return skep_job_run(get(), callback, user, &points);
        });
        return detail::give(std::move(status), points);
    }
    Fallible<void> run_task(Task task, std::uint32_t cycle, std::uint32_t view,
                            const ProgressCallback &progress = {}) const {
        return detail::give(progress.run([&](skep_progress_fn callback, void *user) {
            return skep_job_run_task(get(), static_cast<std::uint32_t>(task), cycle, view, callback,
                                     user);
        }));
    }
    Fallible<bool> is_done(Task task, std::uint32_t cycle, std::uint32_t view) const {
        std::int32_t done = 0;
        detail::Status status =
            skep_job_is_done(get(), static_cast<std::uint32_t>(task), cycle, view, &done);
        bool found = done != 0;
        return detail::give(std::move(status), found);
    }
};

} // namespace SKEP_FLAVOR
} // namespace skep

#endif
