#pragma once
/// Candidates for hits: crossings of a ray's line with triangles of a leaf.

#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// A crossing of a line with a triangle.
template <class Real> struct BasicCandidate {
  Real t, u, v;  ///< u and v are the weights of the mesh's corners 1 and 2.
  /// The line comes from the side where the corners are counter-clockwise. It is as exact as the test's decision.
  bool front = true;
};
using Candidate = BasicCandidate<float>;

/// @param area of the triangle as the z axis sees it, positive if its corners are counter-clockwise.
/// @param dz the line's direction along that axis.
template <class Real> HIPRT_HD HIPRT_FORCE_INLINE bool is_front(Real area, Real dz) {
  return (area > Real(0)) != (dz > Real(0));
}

/// Chooses between values. Some compilers would choose between addresses, which puts variables into memory.
template <class T> HIPRT_HD constexpr HIPRT_FORCE_INLINE T choose(bool condition, T a, T b) {
  return condition ? +a : +b;
}

/// Sorts values per corner (weights, depths or vertices) from stored order to the mesh's order.
template <class T> HIPRT_HD constexpr HIPRT_FORCE_INLINE void to_mesh_order(T (&value)[3], std::uint32_t triangle_id) {
  const unsigned one = TriangleId::u_source(triangle_id), two = TriangleId::v_source(triangle_id);
  const T a = value[0], b = value[1], c = value[2];
  value[0] = choose(one + two == 3, a, choose(one + two == 2, b, c));
  value[1] = choose(one == 0, a, choose(one == 1, b, c));
  value[2] = choose(two == 0, a, choose(two == 1, b, c));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
