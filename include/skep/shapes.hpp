// Spans, maps, and the pictures, maps and matrices of other libraries. Part of skep.hpp.
#ifndef SKEP_SHAPES_HPP
#define SKEP_SHAPES_HPP

#include "error.hpp"

#include <array>
#include <cstdint>
#include <iterator>
#include <type_traits>

#if __cplusplus >= 202002L
#include <span>
#endif

namespace skep {
inline namespace SKEP_FLAVOR {

#if __cplusplus >= 202002L
template <class T> using Span = std::span<T>;
#else
/// Elements that follow each other in somebody else's memory: what std::span is from C++20 on.
template <class T> class Span {
  public:
    constexpr Span() = default;
    constexpr Span(T *data, std::size_t size) : data_(data), size_(size) {}
    template <std::size_t N> constexpr Span(T (&array)[N]) : data_(array), size_(N) {}
    template <
        class Container,
        class = std::enable_if_t<std::is_convertible_v<
            std::remove_pointer_t<decltype(std::declval<Container &>().data())> (*)[], T (*)[]>>,
        class = decltype(std::declval<Container &>().size())>
    constexpr Span(Container &&container) : data_(container.data()), size_(container.size()) {}
    constexpr T *data() const noexcept { return data_; }
    constexpr std::size_t size() const noexcept { return size_; }
    constexpr bool empty() const noexcept { return size_ == 0; }
    constexpr T &operator[](std::size_t index) const { return data_[index]; }
    constexpr T *begin() const noexcept { return data_; }
    constexpr T *end() const noexcept { return data_ + size_; }

  private:
    T *data_ = nullptr;
    std::size_t size_ = 0;
};
#endif

struct Size {
    std::uint32_t width = 0, height = 0;
};

/// A map of `channels` numbers a pixel in somebody else's memory.
template <class T> struct MapView {
    T *data = nullptr;
    std::uint32_t width = 0, height = 0, channels = 1;
    std::size_t stride_bytes = 0;

    T &at(std::size_t x, std::size_t y, std::size_t channel = 0) const {
        using Byte = std::conditional_t<std::is_const_v<T>, const char, char>;
        return reinterpret_cast<T *>(reinterpret_cast<Byte *>(data) +
                                     y * stride_bytes)[x * channels + channel];
    }
};

/// A map that holds its own memory, without gaps.
template <class T> struct Map {
    std::uint32_t width = 0, height = 0, channels = 1;
    std::vector<T> data;

    Map() = default;
    Map(Size size, std::uint32_t channel_count = 1)
        : width(size.width), height(size.height), channels(channel_count),
          data(std::size_t(width) * height * channels) {}
    T &at(std::size_t x, std::size_t y, std::size_t channel = 0) {
        return data[(y * width + x) * channels + channel];
    }
    const T &at(std::size_t x, std::size_t y, std::size_t channel = 0) const {
        return data[(y * width + x) * channels + channel];
    }
};

namespace detail {
template <class...> using Sink = void;
template <class M> using Plain = std::remove_cv_t<std::remove_reference_t<M>>;

// The shapes of other libraries' types.
template <class M, class = void> struct IsMat : std::false_type {};
template <class M>
struct IsMat<
    M,
    Sink<decltype(*std::declval<M &>().data), decltype(std::size_t(std::declval<M &>().step)),
         decltype(int(std::declval<M &>().rows)), decltype(int(std::declval<M &>().cols)),
         decltype(int(std::declval<M &>().depth())), decltype(int(std::declval<M &>().channels()))>>
    : std::true_type {};
template <class M, class = void> struct CanCreate : std::false_type {};
template <class M>
struct CanCreate<M, Sink<decltype(std::declval<M &>().create(1, 1, 1))>> : std::true_type {};
template <class M, class = void> struct IsCalled : std::false_type {};
template <class M>
struct IsCalled<
    M, Sink<decltype(double(std::declval<M &>()(std::declval<int>(), std::declval<int>())))>>
    : std::true_type {};
template <class M, class = void> struct HasRowsFunction : std::false_type {};
template <class M>
struct HasRowsFunction<M, Sink<decltype(std::declval<M &>().rows())>> : std::true_type {};
template <class M, class = void> struct CanResize : std::false_type {};
template <class M>
struct CanResize<M, Sink<decltype(std::declval<M &>().resize(1, 1))>> : std::true_type {};
template <class M, class = void> struct IsSubscripted : std::false_type {};
template <class M>
struct IsSubscripted<M, Sink<decltype(double(std::declval<M &>()[0]))>> : std::true_type {};
template <class M, class = void> struct IsSubscriptedTwice : std::false_type {};
template <class M>
struct IsSubscriptedTwice<M, Sink<decltype(double(std::declval<M &>()[0][0]))>> : std::true_type{};
template <class M, class = void> struct HasSize : std::false_type {};
template <class M>
struct HasSize<M, Sink<decltype(std::size(std::declval<M &>()))>> : std::true_type {};

/// OpenCV's number for a type of elements; unsigned 32-bit numbers go where it has signed ones.
template <class T> constexpr int cv_depth() {
    using U = std::remove_cv_t<T>;
    if constexpr (std::is_same_v<U, std::uint8_t>)
        return 0;
    else if constexpr (std::is_same_v<U, std::uint16_t>)
        return 2;
    else if constexpr (std::is_same_v<U, std::uint32_t>)
        return 4;
    else if constexpr (std::is_same_v<U, float>)
        return 5;
    else
        return 6;
}

inline std::string by(long long a, long long b) {
    return std::to_string(a) + " x " + std::to_string(b);
}

/// A view of a map of any kind, of `channels` numbers of type T a pixel.
template <class T, class M>
Status view_of(M &map, std::uint32_t channels, const char *name, MapView<T> &view) {
    std::uint32_t found = 0;
    bool fits = true;
    if constexpr (IsMat<M>::value) {
        if (map.rows <= 0 || map.cols <= 0)
            return Status::argument(name, by(map.cols, map.rows),
                                    "a matrix of two dimensions that is not empty");
        view.data = reinterpret_cast<T *>(map.data);
        view.width = std::uint32_t(map.cols), view.height = std::uint32_t(map.rows);
        view.stride_bytes = std::size_t(map.step);
        found = std::uint32_t(map.channels());
        fits = map.depth() == cv_depth<T>();
    } else if constexpr (std::is_pointer_v<decltype(map.data)>) {
        view = MapView<T>{map.data, map.width, map.height, map.channels, map.stride_bytes};
        found = map.channels;
    } else {
        view = MapView<T>{map.data.data(), map.width, map.height, map.channels, 0};
        view.stride_bytes = std::size_t(map.width) * map.channels * sizeof(T);
        found = map.channels;
        fits = map.data.size() == std::size_t(map.width) * map.height * map.channels;
    }
    view.channels = channels;
    if (fits && found == channels)
        return {};
    return Status::argument(
        name, "a map of " + std::to_string(found) + " channel(s) of another type or length",
        std::to_string(channels) + " channel(s) of " + std::to_string(sizeof(T)) + " bytes");
}

/// Resizes a map of any kind, or checks its size where it cannot be resized; gives a view of it.
template <class T, class M>
Status make(M &map, Size size, std::uint32_t channels, const char *name, MapView<T> &view) {
    if constexpr (IsMat<M>::value) {
        if constexpr (CanCreate<M>::value)
            map.create(int(size.height), int(size.width),
                       cv_depth<T>() + ((int(channels) - 1) << 3));
    } else if constexpr (!std::is_pointer_v<decltype(map.data)>) {
        map = Map<T>(size, channels);
    }
    return view_of<T>(map, channels, name, view).then([&]() -> Status {
        if (view.width == size.width && view.height == size.height)
            return {};
        return Status::argument(name, by(view.width, view.height),
                                by(size.width, size.height) + ", as the view");
    });
}

/// Reads a matrix, row by row.
template <class M>
Status read(const M &matrix, int rows, int columns, const char *name, double *out) {
    static_assert(IsCalled<const M>::value || IsMat<const M>::value ||
                      IsSubscriptedTwice<const M>::value,
                  "a matrix is called with (row, column), subscripted twice, or a cv::Mat");
    long long has_rows = rows, has_columns = columns;
    if constexpr (HasRowsFunction<const M>::value)
        has_rows = matrix.rows(), has_columns = matrix.cols();
    else if constexpr (IsCalled<const M>::value || IsMat<const M>::value)
        has_rows = matrix.rows, has_columns = matrix.cols;
    else
        has_rows = (long long)std::size(matrix), has_columns = (long long)std::size(matrix[0]);
    if (has_rows != rows || has_columns != columns)
        return Status::argument(name, by(has_rows, has_columns), by(rows, columns));
    for (int i = 0; i < rows * columns; ++i) {
        const int row = i / columns, column = i % columns;
        if constexpr (IsCalled<const M>::value) {
            out[i] = double(matrix(row, column));
        } else if constexpr (!IsMat<const M>::value) {
            out[i] = double(matrix[std::size_t(row)][std::size_t(column)]);
        } else {
            const auto *start = matrix.data + std::size_t(matrix.step) * std::size_t(row);
            if (matrix.channels() != 1 || (matrix.depth() != 5 && matrix.depth() != 6))
                return Status::argument(name, "a matrix of another type",
                                        "one channel of float or double");
            if (matrix.depth() == 5)
                out[i] = double(reinterpret_cast<const float *>(start)[column]);
            else
                out[i] = reinterpret_cast<const double *>(start)[column];
        }
    }
    return {};
}

/// Reads a vector of three.
template <class V> Status read_vector(const V &vector, const char *name, double *out) {
    if constexpr (IsCalled<const V>::value || IsMat<const V>::value) {
        const Status column = read(vector, 3, 1, name, out);
        return column ? column : read(vector, 1, 3, name, out) ? Status() : column;
    } else {
        static_assert(IsSubscripted<const V>::value, "a vector is a matrix or subscripted");
        if constexpr (HasSize<const V>::value)
            if (std::size(vector) != 3)
                return Status::argument(name, std::to_string(std::size(vector)) + " long", "3");
        for (int i = 0; i < 3; ++i)
            out[i] = double(vector[i]);
        return {};
    }
}

template <class Image>
Status image_of(const Image &image, bool is_rgb, const char *name, skep_image &out) {
    if constexpr (std::is_same_v<Image, skep_image>) {
        out = image;
        return {};
    } else {
        static_assert(IsMat<const Image>::value,
                      "a picture is a skep_image or has the shape of cv::Mat");
        const int depth = image.depth(), channels = image.channels();
        if (image.rows <= 0 || image.cols <= 0)
            return Status::argument(name, by(image.cols, image.rows),
                                    "a picture that is not empty");
        if ((depth != 0 && depth != 2 && depth != 5) ||
            (channels != 1 && channels != 3 && channels != 4))
            return Status::argument(name, "of another type",
                                    "8, 16 or float bits of 1, 3 or 4 channels");
        const int layout = channels == 1   ? SKEP_FORMAT_GRAY
                           : channels == 3 ? (is_rgb ? SKEP_FORMAT_RGB : SKEP_FORMAT_BGR)
                                           : (is_rgb ? SKEP_FORMAT_RGBA : SKEP_FORMAT_BGRA);
        const int bits = depth == 0 ? 0 : depth == 2 ? SKEP_FORMAT_16 : SKEP_FORMAT_FLOAT;
        out = skep_image{image.data, std::uint32_t(image.cols), std::uint32_t(image.rows),
                         std::size_t(image.step), std::uint32_t(layout + bits)};
        return {};
    }
}
} // namespace detail

enum class Order { Bgr, Rgb };

/// A skep_image of a picture of the shape of cv::Mat, without a copy; colors are in OpenCV's order
/// unless told otherwise. Floats are 0 to 1, 16 bits 0 to 65535: scale others, as with convertTo.
template <class Image> Fallible<skep_image> image(const Image &picture, Order order = Order::Bgr) {
    skep_image out = {};
    detail::Status status = detail::image_of(picture, order == Order::Rgb, "picture", out);
    return detail::give(std::move(status), out);
}

/// A view of any map, of `channels` numbers of type T a pixel, without a copy:
/// map_view<float>(depth) or map_view<float>(normals, 3).
template <class T, class M>
Fallible<MapView<const T>> map_view(const M &map, std::uint32_t channels = 1) {
    MapView<const T> view;
    detail::Status status = detail::view_of<const T>(map, channels, "map", view);
    return detail::give(std::move(status), view);
}

/// A camera from its matrices: K has no skew, and x_cam = R X + t.
template <class K, class R, class T>
Fallible<skep_camera> camera(const K &k, const R &rotation, const T &translation) {
    skep_camera camera = {};
    double m[9] = {};
    detail::Status status =
        detail::read(k, 3, 3, "K", m)
            .then([&] { return detail::read(rotation, 3, 3, "R", camera.rotation); })
            .then([&] { return detail::read_vector(translation, "t", camera.translation); })
            .then([&]() -> detail::Status {
                if (m[1] == 0 && m[3] == 0 && m[6] == 0 && m[7] == 0 && m[8] == 1)
                    return {};
                return detail::Status::argument("K", "another matrix", "[fx 0 cx; 0 fy cy; 0 0 1]");
            });
    camera.fx = m[0], camera.cx = m[2], camera.fy = m[4], camera.cy = m[5];
    return detail::give(std::move(status), camera);
}

} // namespace SKEP_FLAVOR
} // namespace skep

#endif // SKEP_SHAPES_HPP
