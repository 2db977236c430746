#pragma once
/// Points in arrays of Python: read in place, whatever their strides and precision.

#include <hiprt_build/python/columns.h>
#include <hiprt_device/query/point_search.h>

#include <nanobind/nanobind.h>

#include <array>
#include <cstddef>

namespace hiprt::python {

/// Views of the arrays of a batch of points. They are kept alive.
class Points {
 public:
  /// @param points n x 3, float32 or float64. @param max_distance n, float32 or float64.
  /// @param mask n, uint32. @param time n, float32.
  Points(const InputArray& points, const InputArray& max_distance, const InputArray& mask, const InputArray& time);

  std::size_t size() const { return size_; }
  /// Copies points. @tparam Real float: numbers are rounded to the nearest float first.
  template <class Real> void gather(std::size_t first, std::size_t count, PointQueryD* to) const;

 private:
  std::array<InputArray, 4> arrays_;
  std::array<Column, 3> point_;
  Column max_distance_, mask_, time_;
  std::size_t size_;
};

extern template void Points::gather<float>(std::size_t, std::size_t, PointQueryD*) const;
extern template void Points::gather<double>(std::size_t, std::size_t, PointQueryD*) const;

/// Adds Points to the module.
void add_points(nanobind::module_& module);

}  // namespace hiprt::python
