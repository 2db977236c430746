#pragma once
/// Rays in arrays of Python: read in place, whatever their strides and precision.

#include <hiprt_build/python/columns.h>
#include <hiprt_device/ray.h>

#include <nanobind/nanobind.h>

#include <array>
#include <cstddef>

namespace hiprt::python {

/// Views of the arrays of a batch of rays. They are kept alive.
class Rays {
 public:
  /// @param origins, directions n x 3, float32 or float64. @param tmin, tmax n, float32 or float64.
  /// @param mask n, uint32. @param time n, float32.
  Rays(const InputArray& origins, const InputArray& directions, const InputArray& tmin, const InputArray& tmax,
       const InputArray& mask, const InputArray& time);

  std::size_t size() const { return size_; }
  /// Copies rays. Conversion to float rounds to the nearest.
  template <class Real> void gather(std::size_t first, std::size_t count, BasicRay<Real>* to) const;

 private:
  std::array<InputArray, 6> arrays_;
  std::array<Column, 3> origin_, direction_;
  Column tmin_, tmax_, mask_, time_;
  std::size_t size_;
};

extern template void Rays::gather(std::size_t, std::size_t, Ray*) const;
extern template void Rays::gather(std::size_t, std::size_t, RayD*) const;

/// Adds Rays to the module.
void add_rays(nanobind::module_& module);

}  // namespace hiprt::python
