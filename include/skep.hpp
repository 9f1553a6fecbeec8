// skep for C++17 and later: skep.h with objects, exceptions and containers. Header only; link with
// libskep.
//
//     skep::Scene scene;
//     for (const Photograph &own : photographs) // cv::Mat pictures; K, R, t of OpenCV or Eigen
//         scene.add_view(own.picture, skep::camera(own.K, own.R, own.t));
//     scene.add_points(positions, view_counts, views); // or scene.set_depth_range for each view
//     skep::Options options;
//     options.set("threads", 4);
//     skep::Result result = skep::reconstruct(scene, options, [](const skep::Progress &progress) {
//         std::printf("%.0f %%\n", 100 * progress.done);
//     });
//     cv::Mat depth;
//     result.depth(0, skep::Maps::Validated, depth);
//     result.cloud().write_ply("fused.ply");
//
// What skep.h says of each function holds here; this file only says what is different.
//
// Objects (Options, Scene, Result, Cloud, Job, Stepper, Estimate, Candidates, PackedImage, NccWindow)
// own what they stand for, can be moved and not copied, and get() is the C object, for calls that
// are not wrapped. Using an object that was moved from is an error, not a crash.
//
// Errors are exceptions of type skep::Error. With SKEP_NO_EXCEPTIONS defined, or exceptions turned
// off in the compiler, every function whose type below is Fallible<T> returns a skep::Expected<T>
// instead, and objects that have a constructor here are made with create():
//
//     skep::Expected<skep::Scene> scene = skep::Scene::create();
//     if (!scene) return complain(scene.error().what());
//     skep::Expected<skep::Result> result = skep::reconstruct(*scene);
//
// Progress callbacks take a const skep::Progress & and return nothing, or skep::Flow::Cancel to
// stop the call. They come from other threads, one at a time, and may throw: the call is cancelled,
// and throws the same exception to whom made it.
//
// Pictures, maps and matrices of other libraries are known by their shape, nothing of them is
// included:
//   - a picture or map is a skep_image or skep::Map, or has data, rows, cols, step, depth() and
//     channels(), as cv::Mat. One that receives a map is made by its create(rows, cols, type) if it
//     has that, else it must have the size;
//   - a matrix is called with (row, column) and has rows() and cols() or rows and cols, as in Eigen
//     and cv::Matx, or is subscripted twice, as double[3][3], or is a cv::Mat of floats or doubles;
//   - a vector is such a matrix of one column or row, or is subscripted, as std::array and cv::Vec.
#ifndef SKEP_HPP
#define SKEP_HPP

#include "skep/error.hpp"
#include "skep/files.hpp"
#include "skep/job.hpp"
#include "skep/kernels.hpp"
#include "skep/object.hpp"
#include "skep/options.hpp"
#include "skep/result.hpp"
#include "skep/scene.hpp"
#include "skep/shapes.hpp"
#include "skep/stepper.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// The library's version, such as "0.1.0".
inline const char *version() noexcept { return skep_version(); }
/// The instruction set that a run uses unless option "simd" says otherwise: "scalar", "baseline" or
/// "v3".
inline const char *simd_level_name() noexcept { return skep_simd_level_name(); }
/// Whether the library is the one this header was made for.
inline bool abi_matches() noexcept { return skep_abi_version() == SKEP_ABI_VERSION; }

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_HPP
