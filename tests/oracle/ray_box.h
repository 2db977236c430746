#pragma once
/// Decides exactly whether a ray touches a closed box within [tmin, tmax].

#include <tests/oracle/ray_triangle.h>

#include <optional>

namespace hiprt::oracle {

/// Computed in rationals only. @pre is_valid(ray), finite box.
inline bool touches_exact(const Ray& ray, const Box& box) {
  Rational near = exact(effective_tmin(ray));
  std::optional<Rational> far;
  if (std::isfinite(ray.tmax)) far = exact(ray.tmax);
  const Position o = position(ray.origin), d = position(ray.direction);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (box.min[axis] > box.max[axis]) return false;
    if (d[axis] == 0.0f) {
      if (o[axis] < box.min[axis] || o[axis] > box.max[axis]) return false;
      continue;
    }
    Rational enter = (exact(box.min[axis]) - exact(o[axis])) / exact(d[axis]);
    Rational leave = (exact(box.max[axis]) - exact(o[axis])) / exact(d[axis]);
    if (d[axis] < 0.0f) std::swap(enter, leave);
    near = std::max(near, enter);
    far = far ? std::min(*far, leave) : leave;
  }
  return !far || near <= *far;
}

/// The same decision, tried in double first: (plane - origin) / direction carries two roundings there, at most
/// 2^-52 relative, and can neither overflow nor underflow.
inline bool touches(const Ray& ray, const Box& box) {
  constexpr double kRelative = 0x1p-51;
  double near = effective_tmin(ray), far = ray.tmax;
  const Position o = position(ray.origin), d = position(ray.direction);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (box.min[axis] > box.max[axis]) return false;
    if (d[axis] == 0.0f) {
      if (o[axis] < box.min[axis] || o[axis] > box.max[axis]) return false;
      continue;
    }
    double enter = (static_cast<double>(box.min[axis]) - o[axis]) / d[axis];
    double leave = (static_cast<double>(box.max[axis]) - o[axis]) / d[axis];
    if (d[axis] < 0.0f) std::swap(enter, leave);
    near = std::max(near, enter);
    far = std::min(far, leave);
  }
  if (!std::isfinite(far)) return true;
  const double margin = kRelative * (std::abs(near) + std::abs(far));
  if (far - near > margin) return true;
  if (near - far > margin) return false;
  return touches_exact(ray, box);
}

}  // namespace hiprt::oracle
