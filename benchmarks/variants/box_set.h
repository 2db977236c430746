#pragma once
/// Axis-aligned boxes as custom primitives. They are cheap, so that the measurement shows the cost of custom primitives
/// themselves.

#include <hiprt_device/hiprt_device.h>

namespace hiprt::bench {
inline namespace HIPRT_ISA_NAMESPACE {

/// Intersects the surfaces of boxes. Subtractions, divisions, products and comparisons have the same bits on every
/// machine, because compilers can contract none of them.
struct BoxSet {
  const Box* boxes = nullptr;

  template <class Report>
  HIPRT_HD HIPRT_FORCE_INLINE bool intersect(const Ray& ray, float tmin, float tmax, std::uint32_t primitive,
                                             Report&& report) const {
    const Box& box = boxes[primitive];
    float enter = -std::numeric_limits<float>::infinity(), leave = -enter;
    unsigned enter_axis = 0, leave_axis = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const int i = static_cast<int>(axis);
      const float inverse = 1.0f / ray.direction[i];
      const float a = (box.min[axis] - ray.origin[i]) * inverse, b = (box.max[axis] - ray.origin[i]) * inverse;
      const float low = smaller(a, b), high = larger(a, b);
      if (low > enter) {
        enter = low;
        enter_axis = axis;
      }
      if (high < leave) {
        leave = high;
        leave_axis = axis;
      }
    }
    if (!(enter <= leave)) return true;
    const bool outside = enter >= tmin;
    const float t = outside ? enter : leave;
    if (!(t >= tmin && t <= tmax)) return true;
    return report(CustomHit{t, 0.0f, 0.0f, normal(ray, outside ? enter_axis : leave_axis, outside), 1e-6f * t});
  }

 private:
  HIPRT_HD static HIPRT_FORCE_INLINE Vec3 normal(const Ray& ray, unsigned axis, bool outside) {
    Vec3 result(0.0f);
    const int i = static_cast<int>(axis);
    result[i] = (ray.direction[i] < 0.0f) == outside ? 1.0f : -1.0f;
    return result;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt::bench
