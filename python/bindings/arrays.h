// SPDX-License-Identifier: Apache-2.0
// Arguments that are arrays, and arrays as results.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "ewa/image.h"

namespace ewa::python {

namespace nb = nanobind;

/// A length of an expected shape: any, under this letter in messages.
constexpr ptrdiff_t any(char letter) {
    return -ptrdiff_t(letter);
}

/// The first length of an expected shape: any number of lengths, "..." in messages.
constexpr ptrdiff_t kLeading = any('.');

using Shape = std::vector<ptrdiff_t>;

/// The argument as a numpy array of numbers, C-contiguous, of this dtype ("float32"). A copy only where it must be one.
/// Throws TypeError if it holds no numbers. Throws ValueError that names argument and shape if no shape fits.
nb::object numpy_argument(nb::handle value, const std::string& name, const char* dtype,
                          std::initializer_list<Shape> shapes);

template <class T>
constexpr const char* dtype_of() {
    if constexpr (std::is_same_v<T, float>) return "float32";
    if constexpr (std::is_same_v<T, double>) return "float64";
    if constexpr (std::is_same_v<T, int64_t>) return "int64";
    if constexpr (std::is_same_v<T, int32_t>) return "int32";
    if constexpr (std::is_same_v<T, uint8_t>) return "uint8";
}

/// The values of an argument that is an array. They live as long as this does.
template <class T>
class Array {
  public:
    Array(nb::handle value, const std::string& name, std::initializer_list<Shape> shapes)
        : numpy_(numpy_argument(value, name, dtype_of<T>(), shapes)), array_(nb::cast<View>(numpy_)) {}
    Array(nb::handle value, const std::string& name, const Shape& shape) : Array(value, name, {shape}) {}

    const T* data() const { return array_.data(); }
    size_t size() const { return array_.size(); }
    size_t dimensions() const { return array_.ndim(); }
    size_t length(size_t dimension) const { return array_.shape(dimension); }
    std::vector<T> values() const { return std::vector<T>(data(), data() + size()); }
    /// The shape without its last `count` lengths.
    Shape leading(size_t count) const {
        return Shape(array_.shape_ptr(), array_.shape_ptr() + dimensions() - count);
    }
    const nb::object& numpy() const { return numpy_; }

  private:
    using View = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
    nb::object numpy_;
    View array_;
};

/// The vector as a numpy array, without a copy.
template <class T>
nb::ndarray<nb::numpy, T> to_numpy(std::vector<T>&& values, const std::vector<size_t>& shape) {
    auto* kept = new std::vector<T>(std::move(values));
    const nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.data(), owner);
}

/// [height, width, channels]
inline nb::ndarray<nb::numpy, float> to_numpy(Image&& image) {
    return to_numpy(std::move(image.pixels),
                    {size_t(image.height), size_t(image.width), size_t(image.channels)});
}

}  // namespace ewa::python
