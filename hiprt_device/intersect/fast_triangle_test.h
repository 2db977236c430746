#pragma once
/// The triangle test of Moeller and Trumbore: fast, and not watertight.

#include <hiprt_device/intersect/candidate.h>
#include <hiprt_device/intersect/node_lanes.h>
#include <hiprt_device/ray.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The test of Moeller and Trumbore 1997, in float. The compiler may contract operations. Rays leak through shared
/// edges and vertices.
struct Fast {
  template <class Lanes> struct PreparedRay {
    Vec3 origin, direction;
    HIPRT_HD HIPRT_FORCE_INLINE explicit PreparedRay(const Ray& ray) : origin(ray.origin), direction(ray.direction) {}
  };

  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_FORCE_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info,
                                                    const PreparedRay<Lanes>& ray, Accept&& accept) {
    using Float = typename Lanes::Float;
    // Lanes 0 and 1 are triangles 0 and 1: corners (v0, v1, v2) and (v1, v3, v2).
    const Vec<Lanes> vertex{load_coordinates<Lanes>(leaf, 0), load_coordinates<Lanes>(leaf, 1),
                            load_coordinates<Lanes>(leaf, 2)};
    const Vec<Lanes> corner = shuffle<Lanes, 0, 1>(vertex);
    const Vec<Lanes> edge1 = sub(shuffle<Lanes, 1, 3>(vertex), corner);
    const Vec<Lanes> edge2 = sub(shuffle<Lanes, 2, 2>(vertex), corner);
    const Vec<Lanes> from = sub(all<Lanes>(ray.origin), corner), d = all<Lanes>(ray.direction);
    const Vec<Lanes> p = cross(d, edge2), q = cross(from, edge1);
    const Float one = Lanes::all(1.0f), zero = Lanes::all(0.0f);
    const Float reciprocal = Lanes::div(one, dot(edge1, p));
    const Float weight1 = Lanes::mul(dot(from, p), reciprocal), weight2 = Lanes::mul(dot(d, q), reciprocal);
    const std::uint32_t triangles = info.primitive[1] == kInvalidId ? 0b01 : 0b11;
    const std::uint32_t met = triangles & Lanes::less_equal(zero, weight1) & Lanes::less_equal(zero, weight2) &
                              Lanes::less_equal(Lanes::add(weight1, weight2), one);
    if (met == 0) return true;
    const Float distance = Lanes::mul(dot(edge2, q), reciprocal);
    for (unsigned triangle = 0; triangle < 2; ++triangle) {
      if ((met >> triangle & 1u) == 0) continue;
      const float w1 = Lanes::get(weight1, triangle), w2 = Lanes::get(weight2, triangle);
      float weight[3] = {max_of(1.0f - w1 - w2, 0.0f), w1, w2};
      to_mesh_order(weight, info.triangle_ids >> (8 * triangle));
      // The determinant is -dot(direction, normal).
      const bool front = Lanes::get(reciprocal, triangle) > 0.0f;
      if (!accept(Candidate{Lanes::get(distance, triangle), weight[1], weight[2], front}, triangle)) return false;
    }
    return true;
  }

 private:
  /// A vector per lane.
  template <class Lanes> struct Vec {
    typename Lanes::Float x, y, z;

    HIPRT_HD HIPRT_FORCE_INLINE friend Vec sub(const Vec& a, const Vec& b) {
      return {Lanes::sub(a.x, b.x), Lanes::sub(a.y, b.y), Lanes::sub(a.z, b.z)};
    }
    HIPRT_HD HIPRT_FORCE_INLINE friend Vec cross(const Vec& a, const Vec& b) {
      return {Lanes::sub(Lanes::mul(a.y, b.z), Lanes::mul(a.z, b.y)),
              Lanes::sub(Lanes::mul(a.z, b.x), Lanes::mul(a.x, b.z)),
              Lanes::sub(Lanes::mul(a.x, b.y), Lanes::mul(a.y, b.x))};
    }
    HIPRT_HD HIPRT_FORCE_INLINE friend typename Lanes::Float dot(const Vec& a, const Vec& b) {
      return Lanes::madd(a.x, b.x, Lanes::madd(a.y, b.y, Lanes::mul(a.z, b.z)));
    }
  };
  template <class Lanes> HIPRT_HD static HIPRT_FORCE_INLINE Vec<Lanes> all(const Vec3& a) {
    return {Lanes::all(a.x), Lanes::all(a.y), Lanes::all(a.z)};
  }
  template <class Lanes, int A, int B> HIPRT_HD static HIPRT_FORCE_INLINE Vec<Lanes> shuffle(const Vec<Lanes>& a) {
    return {Lanes::template shuffle<A, B, A, B>(a.x), Lanes::template shuffle<A, B, A, B>(a.y),
            Lanes::template shuffle<A, B, A, B>(a.z)};
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
