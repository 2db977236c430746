#pragma once
/// Candidates for hits: where a ray's line meets a triangle of a leaf.

#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// Where a line meets a triangle; u, v are weights of the mesh's corners 1 and 2.
template <class Real> struct BasicCandidate { Real t, u, v; };
using Candidate = BasicCandidate<float>;

/// Values, not variables: some compilers choose between addresses, which puts the variables into memory.
template <class T> HIPRT_HD HIPRT_INLINE T choose(bool condition, T a, T b) { return condition ? +a : +b; }

/// A weight, depth or vertex per corner of the mesh's triangle, from values in stored order.
template <class T> HIPRT_HD HIPRT_INLINE void to_mesh_order(T (&value)[3], std::uint32_t triangle_id) {
  const unsigned one = TriangleId::u_source(triangle_id), two = TriangleId::v_source(triangle_id);
  const T a = value[0], b = value[1], c = value[2];
  value[0] = choose(one + two == 3, a, choose(one + two == 2, b, c));
  value[1] = choose(one == 0, a, choose(one == 1, b, c));
  value[2] = choose(two == 0, a, choose(two == 1, b, c));
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
