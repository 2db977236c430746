#pragma once
/// Triangles whose corners move, as custom primitives: meshes that deform.

#include <hiprt_device/instances/motion.h>
#include <hiprt_device/primitives/computed_leaf.h>
#include <hiprt_device/primitives/line.h>

namespace hiprt {

/// A mesh at several times. Vertices move linearly between the times; before the first and after the last they stand
/// still.
struct MovingMesh {
  /// Key k's vertex i: x, y, z from 3 * (k * vertices + i). Finite. A triangle with a NaN corner at a key is missed at
  /// times that use this key. A triangle with an infinite corner at any key has no box.
  const float* positions;
  const float* times;              ///< Times of the keys, each later than the one before.
  const std::uint32_t* triangles;  ///< Three vertices each.
  std::uint32_t vertices;
  std::uint32_t keys;  ///< 1 or more.
};

inline namespace HIPRT_ISA_NAMESPACE {

/// The payload of a geometry of moving triangles, numbered as in the mesh.
///
/// At a ray's time, hits and misses are those of the Watertight test on a mesh of interpolated vertices, rounded to
/// floats. No ray passes between neighbours, because they share vertices. u, v and the normal are those of a triangle
/// of a mesh. The error bound holds for the vertices before they were rounded (docs/decisions/0015-motion.md).
struct MovingTriangleSet {
  MovingMesh mesh;

  /// Calls report(CustomHit) where the ray meets triangle @p primitive at its time, inside [tmin, tmax].
  /// @return false if report did.
  template <class Real, class Report>
  HIPRT_HD bool intersect(const BasicRay<Real>& ray, std::type_identity_t<Real> tmin, std::type_identity_t<Real> tmax,
                          std::uint32_t primitive, Report&& report) const {
    primitive_detail::ComputedLeaf<float> leaf{};
    float magnitude = 0.0f;
    const std::uint32_t last = mesh.keys - 1;
    const std::uint32_t key = segment_at(last, ray.time, [&](std::uint32_t i) { return mesh.times[i]; });
    const std::uint32_t next = key < last ? key + 1 : key;
    const float s = key < last ? part_of(mesh.times[key], mesh.times[next], ray.time) : 0.0f;
    for (unsigned corner = 0; corner < 3; ++corner)
      for (unsigned axis = 0; axis < 3; ++axis) {
        const float from = coordinate(key, primitive, corner, axis);
        const float to = coordinate(next, primitive, corner, axis);
        leaf.vertex[corner][axis] = motion_detail::between(from, to, 1.0f - s, s);
        magnitude = max_of(magnitude, max_of(absolute(from), absolute(to)));
      }
    leaf.info = {{primitive, kInvalidId}, 0, TriangleId::from_rotation(0)};
    return primitive_detail::meet_computed(leaf, ray, tmin, tmax, 4.0f * 0x1p-24f * magnitude, report);
  }

  /// A box around triangle @p primitive at all times.
  HIPRT_HD Box bounds(std::uint32_t primitive) const {
    Box box = primitive_detail::empty_box();
    for (std::uint32_t key = 0; key < mesh.keys; ++key)
      for (unsigned corner = 0; corner < 3; ++corner)
        for (unsigned axis = 0; axis < 3; ++axis) {
          // An interpolated number between two equal ones may be off by 2 units.
          const float at = coordinate(key, primitive, corner, axis), slack = 0x1p-22f * absolute(at) + 0x1p-148f;
          if (at - slack < box.min[axis]) box.min[axis] = at - slack;
          if (at + slack > box.max[axis]) box.max[axis] = at + slack;
        }
    return box;
  }

 private:
  HIPRT_HD HIPRT_FORCE_INLINE float coordinate(std::uint32_t key, std::uint32_t primitive, unsigned corner,
                                               unsigned axis) const {
    const std::uint64_t vertex = mesh.triangles[3 * static_cast<std::uint64_t>(primitive) + corner];
    return mesh.positions[3 * (static_cast<std::uint64_t>(key) * mesh.vertices + vertex) + axis];
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
