#pragma once
/// Which triangles of a leaf are certainly farther from a point than a limit, in float.
///
/// For every direction m a triangle is at least min(m . (p - corner)) / |m| away. The direction from about the closest
/// point gives nearly the distance. Only the last steps need care with rounding: a bad direction gives a small bound,
/// never a wrong one. docs/proofs/closest-points.md has the constants.

#include <hiprt_device/intersect/node_lanes.h>
#include <hiprt_device/math/affine.h>
#include <hiprt_device/math/vec.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

namespace filter_detail {

/// Three coordinates; lane i is a triangle's or a vertex's.
template <class Lanes> struct LaneVector {
  using Float = typename Lanes::Float;
  Float x, y, z;

  HIPRT_HD HIPRT_FORCE_INLINE friend LaneVector operator-(const LaneVector& a, const LaneVector& b) {
    return {Lanes::sub(a.x, b.x), Lanes::sub(a.y, b.y), Lanes::sub(a.z, b.z)};
  }
  /// this - t * b
  HIPRT_HD HIPRT_FORCE_INLINE LaneVector minus(const Float& t, const LaneVector& b) const {
    return {Lanes::sub(x, Lanes::mul(t, b.x)), Lanes::sub(y, Lanes::mul(t, b.y)), Lanes::sub(z, Lanes::mul(t, b.z))};
  }
  template <int A, int B> HIPRT_HD HIPRT_FORCE_INLINE LaneVector of_lanes() const {
    return {Lanes::template shuffle<A, B, A, B>(x), Lanes::template shuffle<A, B, A, B>(y),
            Lanes::template shuffle<A, B, A, B>(z)};
  }
};

template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE typename Lanes::Float dot(const LaneVector<Lanes>& a, const LaneVector<Lanes>& b) {
  return Lanes::madd(a.x, b.x, Lanes::madd(a.y, b.y, Lanes::mul(a.z, b.z)));
}
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE LaneVector<Lanes> cross(const LaneVector<Lanes>& a, const LaneVector<Lanes>& b) {
  return {Lanes::sub(Lanes::mul(a.y, b.z), Lanes::mul(a.z, b.y)),
          Lanes::sub(Lanes::mul(a.z, b.x), Lanes::mul(a.x, b.z)),
          Lanes::sub(Lanes::mul(a.x, b.y), Lanes::mul(a.y, b.x))};
}
/// Lane i is a[i] < b[i] ? x[i] : y[i], of each component.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE LaneVector<Lanes> if_less(const typename Lanes::Float& a, const typename Lanes::Float& b,
                                                      const LaneVector<Lanes>& x, const LaneVector<Lanes>& y) {
  return {Lanes::if_less(a, b, x.x, y.x), Lanes::if_less(a, b, x.y, y.y), Lanes::if_less(a, b, x.z, y.z)};
}

/// From about the closest point of an edge to the point that its ends see at @p a and @p b.
template <class Lanes>
HIPRT_HD HIPRT_FORCE_INLINE LaneVector<Lanes> from_edge(const LaneVector<Lanes>& a, const LaneVector<Lanes>& b) {
  const LaneVector<Lanes> edge = a - b;
  const auto share = Lanes::div(dot(edge, a), dot(edge, edge));
  return a.minus(Lanes::min(Lanes::max(share, Lanes::all(0.0f)), Lanes::all(1.0f)), edge);
}

}  // namespace filter_detail

/// @param point rounded to float.
/// @param limit squared, with its share for rounding; see filter_limit().
/// @return bit i: triangle i of the leaf is farther. NaN: no bit.
template <class Lanes, class Leaf>
HIPRT_HD HIPRT_FORCE_INLINE std::uint32_t farther_triangles(const Leaf& leaf, const Vec3& point, float limit) {
  using namespace filter_detail;
  using Vector = LaneVector<Lanes>;
  const auto from = [&](unsigned axis, float x) HIPRT_FORCE_INLINE_LAMBDA {
    return Lanes::sub(Lanes::all(x), load_coordinates<Lanes>(leaf, axis));
  };
  const Vector vertex{from(0, point.x), from(1, point.y), from(2, point.z)};
  const Vector a = vertex.template of_lanes<0, 1>(), b = vertex.template of_lanes<1, 3>(),
               c = vertex.template of_lanes<2, 2>();
  const Vector ab = from_edge(a, b), bc = from_edge(b, c), ca = from_edge(c, a);
  const auto to_ab = dot(ab, ab), to_bc = dot(bc, bc), to_ca = dot(ca, ca);
  const Vector two = if_less(to_bc, to_ab, bc, ab);
  const Vector edges = if_less(to_ca, Lanes::min(to_ab, to_bc), ca, two);

  // Above the face its normal is the direction.
  const Vector normal = cross(a - b, b - c);
  const auto zero = Lanes::all(0.0f);
  const auto inside =
      Lanes::min(Lanes::min(dot(normal, cross(a, b)), dot(normal, cross(b, c))), dot(normal, cross(c, a)));
  const auto height = dot(normal, a);
  const Vector up = if_less(height, zero, Vector{zero, zero, zero} - normal, normal);
  const Vector direction = if_less(zero, inside, up, edges);

  const auto least = Lanes::min(Lanes::min(dot(direction, a), dot(direction, b)), dot(direction, c));
  const auto squared = dot(vertex, vertex);
  const auto far =
      Lanes::max(Lanes::max(Lanes::template shuffle<0, 1, 0, 1>(squared), Lanes::template shuffle<1, 3, 1, 3>(squared)),
                 Lanes::template shuffle<2, 2, 2, 2>(squared));
  const auto length = dot(direction, direction), bound = Lanes::max(least, zero);
  const auto allowed = Lanes::mul(length, Lanes::madd(far, Lanes::all(0x1p-26f), Lanes::all(limit)));
  // Below that length the products may have lost their bits.
  return Lanes::greater(Lanes::mul(bound, bound), allowed) & Lanes::greater(length, Lanes::all(0x1p-100f));
}

/// @return +inf, which lets all triangles pass, if floats cannot hold the limit.
/// @param squared the largest squared distance that counts.
/// @param margin how far the point may be from its rounded place, with the rounding of distances.
HIPRT_HD HIPRT_FORCE_INLINE float filter_limit(double squared, double margin) {
  // (d + e)^2 <= (1 + h) d^2 + (1 + 1 / h) e^2 with h = 2^-12, and e^2 for three axes and two causes.
  const double limit = fused_multiply_add(squared, 1.0 + 0x1p-11, 0x1p15 * margin * margin);
  constexpr double kLargest = std::numeric_limits<float>::max();
  return limit < kLargest ? affine_detail::round_up(limit) : std::numeric_limits<float>::infinity();
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
