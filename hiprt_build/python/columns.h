#pragma once
/// Columns of arrays of Python, read in place, whatever their strides and precision.

#include <hiprt_build/python/errors.h>
#include <hiprt_device/math/arithmetic.h>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

namespace hiprt::python {

/// An array of any type and strides that is only read. The strides may be 0 or negative.
using InputArray = nanobind::ndarray<nanobind::ro, nanobind::device::cpu>;

/// Numbers at a constant distance.
struct Column {
  const std::byte* first = nullptr;
  std::ptrdiff_t stride = 0;  ///< In bytes.
  bool is_double = false;     ///< Of floating-point numbers.

  /// A part of an array: all of one dimension, or column @p component of two dimensions.
  explicit Column(const InputArray& array, std::size_t component = 0);
};

template <class T> bool holds(const InputArray& array) { return array.dtype() == nanobind::dtype<T>(); }

/// Refuses arrays of another type or shape than size, or size x 3.
void check(const char* name, const InputArray& array, std::size_t dimensions, std::size_t size, bool fits_type);
/// The same for float32 or float64.
void check_real(const char* name, const InputArray& array, std::size_t dimensions, std::size_t size);

template <class T> T read(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// To the nearest.
template <class Real> Real rounded(float x) { return x; }
template <class Real> Real rounded(double x) {
  if constexpr (sizeof(Real) == sizeof(double))
    return x;
  else
    return nearest_float(x);
}

/// Reads @p count numbers. @param put takes the number of an entry, from 0, and its value.
template <class Real, class Put> void each(const Column& column, std::size_t first, std::size_t count, const Put& put) {
  const std::byte* from = column.first + static_cast<std::ptrdiff_t>(first) * column.stride;
  if (column.is_double)
    for (std::size_t i = 0; i < count; ++i, from += column.stride) put(i, rounded<Real>(read<double>(from)));
  else
    for (std::size_t i = 0; i < count; ++i, from += column.stride) put(i, rounded<Real>(read<float>(from)));
}

/// The same for whole numbers.
template <class Put> void each_mask(const Column& column, std::size_t first, std::size_t count, const Put& put) {
  const std::byte* from = column.first + static_cast<std::ptrdiff_t>(first) * column.stride;
  for (std::size_t i = 0; i < count; ++i, from += column.stride) put(i, read<std::uint32_t>(from));
}

}  // namespace hiprt::python
