#pragma once
/// Triangles that custom primitives compute. The tests of a scene's leaves intersect them.

#include <hiprt_device/intersect/double_triangle_test.h>
#include <hiprt_device/intersect/hit_surface.h>
#include <hiprt_device/primitives/primitive.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {
namespace primitive_detail {

/// A leaf of one triangle in registers. The leaves of a scene are in global memory.
/// @tparam Number of its coordinates.
template <class Number> struct ComputedLeaf {
  Number vertex[3][3];
  LeafInfo info;
};

template <class Lanes, class Number>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float load_coordinates(const ComputedLeaf<Number>& leaf, unsigned axis) {
  const auto of = [&](const Number(&vertex)[3]) HIPRT_FORCE_INLINE_LAMBDA {
    const Number x = vertex[0], y = vertex[1], z = vertex[2];
    return axis == 0 ? x : axis == 1 ? y : z;
  };
  const Number last = of(leaf.vertex[2]);
  return Lanes::set(of(leaf.vertex[0]), of(leaf.vertex[1]), last, last);
}
template <class Number>
HIPRT_HD HIPRT_FORCE_INLINE const ComputedLeaf<Number>& read_again(const ComputedLeaf<Number>& leaf) {
  return leaf;
}

/// The part of a layout that complete() needs.
template <class Number> struct ComputedLeaves {
  using Leaf = ComputedLeaf<Number>;
  HIPRT_HD static HIPRT_FORCE_INLINE Number coordinate(const Leaf& leaf, unsigned vertex, unsigned axis) {
    return leaf.vertex[vertex][axis];
  }
};

/// Reports the hit of the leaf's triangle if it is in [tmin, tmax].
/// @param more added to Hit::error.
/// @return false if report did.
template <class Number, class Real, class Report>
HIPRT_HD HIPRT_FORCE_INLINE bool meet_computed(const ComputedLeaf<Number>& leaf, const BasicRay<Real>& ray, Real tmin,
                                               Real tmax, float more, Report&& report) {
  using Test = std::conditional_t<std::is_same_v<Real, float>, Watertight, WatertightDouble>;
  const typename Test::template PreparedRay<ArrayLanes> prepared(ray);
  return Test::template intersect<ArrayLanes>(
      leaf, leaf.info, prepared, [&](const BasicCandidate<Real>& at, unsigned triangle) {
        if (triangle != 0 || !(at.t >= tmin && at.t <= tmax)) return true;
        BasicHit<Real> hit;
        hit.t = at.t;
        complete<ComputedLeaves<Number>>(hit, ray, leaf, 0);
        return report(BasicCustomHit<Real>{at.t, at.u, at.v, hit.normal, hit.error + more});
      });
}

}  // namespace primitive_detail
}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
