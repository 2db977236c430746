#pragma once
/// The triangle test of double rays.

#include <hiprt_device/intersect/watertight.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The Watertight test in double. The ray and the vertices are not rounded; t, u and v have the rounding of double.
///
/// Sheared vertices that are rounded once decide each sign. They are the same for all triangles that share the
/// vertices, so no ray passes between neighbours. A ray through a shared edge meets both triangles.
struct WatertightDouble : ShearedTriangleTest<WatertightDouble> {
  /// @tparam Lanes of the box test.
  template <class Lanes> struct PreparedRay : ShearedRay<DoubleLanes> {
    double dz;
    HIPRT_HD HIPRT_FORCE_INLINE explicit PreparedRay(const RayD& ray)
        : ShearedRay<DoubleLanes>(ray), dz(component(ray.direction, z)) {}
  };

  /// See ShearedTriangleTest::meet().
  template <class Lanes, class Leaf, class Accept>
  HIPRT_HD static HIPRT_FORCE_INLINE bool intersect(const Leaf& leaf, const LeafInfo& info,
                                                    const PreparedRay<Lanes>& ray, Accept&& accept) {
    return meet<DoubleLanes>(leaf, info, ray, accept);
  }

 private:
  friend ShearedTriangleTest;

  /// In the range of double rays, underflow loses a sign only if a vertex is within 2^-480 of the ray. The vertex then
  /// counts as on the ray.
  template <class Lanes, class Prepared>
  HIPRT_HD static constexpr double uncertainty(const ShearedVertices<Lanes>&, const Prepared&) {
    return 0.0;
  }

  template <class Lanes, class Leaf, class Prepared>
  HIPRT_HD static HIPRT_FORCE_INLINE bool finish(const TriangleCorners<double>& corners, const Leaf&,
                                                 const Prepared& ray, bool, std::uint32_t id,
                                                 BasicCandidate<double>& result) {
    if (!(corners.weight[0] + corners.weight[1] + corners.weight[2] != 0.0)) return false;
    finish_quickly(corners, id, ray.dz, result);
    return true;
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
