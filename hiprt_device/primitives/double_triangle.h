#pragma once
/// Triangles with double vertices, as custom primitives: meshes with detail that floats cannot hold.

#include <hiprt_device/primitives/computed_leaf.h>
#include <hiprt_device/primitives/line.h>

namespace hiprt {

/// A mesh of double vertices.
struct MeshD {
  const double* positions;         ///< Vertex i: x, y, z from 3 * i. Below 2^126.
  const std::uint32_t* triangles;  ///< Three vertices each.
};

inline namespace HIPRT_ISA_NAMESPACE {

/// The payload of a geometry of triangles with double vertices, numbered as in the mesh.
///
/// Double rays (DoubleRays) find the hits and misses of the WatertightDouble test on the double vertices. No ray
/// passes between neighbours, because they share vertices. Float rays meet the same triangles at the same points, with
/// t, u and v rounded to floats. u, v, the normal and the error bound are those of a triangle of a mesh.
///
/// Boxes are floats. Far from the origin they are as large as the spacing of floats there, and a ray tests all
/// triangles in them. Then store the vertices relative to a point near them, and put the mesh there by an instance.
/// (The difference of two doubles of about the same size is exact.)
struct DoubleTriangleSet {
  MeshD mesh;

  /// Calls report() where the ray meets triangle @p primitive inside [tmin, tmax].
  /// @return false if report did.
  template <class Real, class Report>
  HIPRT_HD bool intersect(const BasicRay<Real>& ray, std::type_identity_t<Real> tmin, std::type_identity_t<Real> tmax,
                          std::uint32_t primitive, Report&& report) const {
    primitive_detail::ComputedLeaf<double> leaf{};
    for (unsigned corner = 0; corner < 3; ++corner)
      for (unsigned axis = 0; axis < 3; ++axis) leaf.vertex[corner][axis] = coordinate(primitive, corner, axis);
    leaf.info = {{primitive, kInvalidId}, 0, TriangleId::from_rotation(0)};
    const RayD wide = convert<double>(ray);
    if constexpr (std::is_same_v<Real, double>)
      return primitive_detail::meet_computed(leaf, wide, tmin, tmax, 0.0f, report);
    else
      // t is rounded after the test.
      return primitive_detail::meet_computed(
          leaf, wide, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max(), 0.0f,
          [&](const CustomHitD& hit) {
            const auto t = static_cast<float>(hit.t);
            if (!(t >= tmin && t <= tmax)) return true;
            // The same terms, in units of 2^-24.
            return report(CustomHit{t, static_cast<float>(hit.u), static_cast<float>(hit.v), Vec3(hit.normal),
                                    0x1p29f * hit.error});
          });
  }

  /// The smallest box of floats around triangle @p primitive.
  HIPRT_HD Box bounds(std::uint32_t primitive) const {
    Box box = primitive_detail::empty_box();
    for (unsigned corner = 0; corner < 3; ++corner)
      for (unsigned axis = 0; axis < 3; ++axis) {
        const double at = coordinate(primitive, corner, axis);
        const float nearest = nearest_float(at);
        const float below = nearest > at ? shape_detail::next_after(nearest, false) : nearest;
        const float above = nearest < at ? shape_detail::next_after(nearest, true) : nearest;
        if (below < box.min[axis]) box.min[axis] = below;
        if (above > box.max[axis]) box.max[axis] = above;
      }
    return box;
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE double coordinate(std::uint32_t primitive, unsigned corner, unsigned axis) const {
    const std::uint64_t vertex = mesh.triangles[3 * static_cast<std::uint64_t>(primitive) + corner];
    return mesh.positions[3 * vertex + axis];
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
