// Homographies of planes, and patch correlation. Part of skep.hpp.
#ifndef SKEP_KERNELS_HPP
#define SKEP_KERNELS_HPP

#include "object.hpp"
#include "shapes.hpp"

namespace skep {
inline namespace SKEP_FLAVOR {

/// Row by row, so that (x', y', 1) ~ H (x, y, 1).
using Homography = std::array<double, 9>;
/// Column and row.
using Pixel = std::array<std::uint32_t, 2>;
static_assert(sizeof(Homography) == 72 && sizeof(Pixel) == 8,
              "arrays without gaps, as the kernels take them");

/// A homography from a matrix of Eigen or OpenCV.
template <class M> Fallible<Homography> homography(const M &matrix) {
    Homography out = {};
    detail::Status status = detail::read(matrix, 3, 3, "homography", out.data());
    return detail::give(std::move(status), out);
}

/// Writes a homography into a matrix of Eigen or OpenCV; a cv::Mat becomes one of doubles.
template <class M> void assign(const Homography &homography, M &matrix) {
    if constexpr (detail::CanResize<M>::value && detail::IsCalled<M>::value)
        matrix.resize(3, 3);
    else if constexpr (detail::CanCreate<M>::value)
        matrix.create(3, 3, detail::cv_depth<double>());
    for (int i = 0; i < 9; ++i) {
        if constexpr (detail::IsCalled<M>::value)
            matrix(i / 3, i % 3) =
                static_cast<detail::Plain<decltype(matrix(0, 0))>>(homography[std::size_t(i)]);
        else
            reinterpret_cast<double *>(matrix.data +
                                       std::size_t(matrix.step) * std::size_t(i / 3))[i % 3] =
                homography[std::size_t(i)];
    }
}

/// The plane with this unit normal, a vector of three, through the point of a pixel at `depth`.
template <class Normal>
Fallible<skep_plane> plane_through(const skep_camera &camera, double x, double y, double depth,
                                   const Normal &normal) {
    skep_plane plane = {};
    double unit[3] = {};
    detail::Status status = detail::read_vector(normal, "normal", unit).then([&] {
        return skep_plane_through(&camera, x, y, depth, unit, &plane);
    });
    return detail::give(std::move(status), plane);
}

/// The homographies that planes of the reference camera induce from its pixels to the source's.
inline Fallible<std::vector<Homography>> plane_homographies(const skep_camera &reference,
                                                            const skep_camera &source,
                                                            Span<const skep_plane> planes) {
    std::vector<Homography> out(planes.size());
    return detail::give(skep_plane_homographies(&reference, &source, planes.data(), planes.size(),
                                                out.empty() ? nullptr : out.front().data()),
                        out);
}

/// A gray image in the layout the kernels sample.
class PackedImage : public detail::Handle<skep_packed_image, skep_packed_image_destroy> {
  public:
    using Handle::Handle;
    template <class Image> static Fallible<PackedImage> create(const Image &picture) {
        PackedImage packed;
        skep_image image = {};
        detail::Status status = detail::image_of(picture, false, "picture", image).then([&] {
            return skep_packed_image_create(&image, packed.put());
        });
        return detail::give(std::move(status), packed);
    }
};

/// The sample positions of a patch and their weights; skep_ncc_window_create explains the
/// arguments.
class NccWindow : public detail::Handle<skep_ncc_window, skep_ncc_window_destroy> {
  public:
    using Handle::Handle;
    static Fallible<NccWindow> create(std::uint32_t radius, std::uint32_t step,
                                      double sigma_spatial, double sigma_color,
                                      double min_variance = 1e-5) {
        NccWindow window;
        return detail::give(skep_ncc_window_create(radius, step, sigma_spatial, sigma_color,
                                                   min_variance, window.put()),
                            window);
    }
};

/// NCC of the reference patch at pixels[i] with the source patch that homographies[i] maps it to,
/// into ncc[i]: three spans of the same size. Allocates nothing.
inline Fallible<void> patch_ncc(const NccWindow &window, const PackedImage &reference,
                                const PackedImage &source, Span<const Pixel> pixels,
                                Span<const Homography> homographies, Span<float> ncc) {
    if (homographies.size() != pixels.size() || ncc.size() != pixels.size())
        return detail::give(detail::Status::argument(
            "homographies and ncc",
            std::to_string(homographies.size()) + " and " + std::to_string(ncc.size()) + " long",
            std::to_string(pixels.size()) + " as the pixels"));
    const bool any = !pixels.empty();
    return detail::give(skep_patch_ncc(
        window.get(), reference.get(), source.get(), any ? pixels.data()->data() : nullptr,
        any ? homographies.data()->data() : nullptr, pixels.size(), ncc.data()));
}

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_KERNELS_HPP
