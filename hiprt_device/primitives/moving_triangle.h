#pragma once
/// Triangles whose corners move, as custom primitives: meshes that deform.

#include <hiprt_device/instances/motion.h>
#include <hiprt_device/intersect/point_triangle.h>
#include <hiprt_device/primitives/computed_leaf.h>
#include <hiprt_device/primitives/custom_point.h>
#include <hiprt_device/primitives/line.h>

namespace hiprt {

/// A mesh at several times. Vertices move linearly between the times; before the first and after the last they stand
/// still.
struct MovingMesh {
  /// Key k's vertex i: x, y, z from stride * (k * vertices + i). Finite. A triangle with a NaN corner at a key is
  /// missed at times that use this key. A triangle with an infinite corner at any key has no box.
  const float* positions;
  const float* times;              ///< Of key k: times[time_stride * k]. Each later than the one before.
  const std::uint32_t* triangles;  ///< Three vertices each.
  std::uint32_t vertices;
  std::uint32_t keys;        ///< 1 or more.
  std::uint32_t stride = 3;  ///< Floats from a position to the next: 3 or more.
  std::uint32_t time_stride = 1;
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
    const float magnitude = place(primitive, moment_at(ray.time), leaf.vertex);
    leaf.info = {{primitive, kInvalidId}, 0, TriangleId::from_rotation(0)};
    return primitive_detail::meet_computed(leaf, ray, tmin, tmax, 4.0f * 0x1p-24f * magnitude, report);
  }

  /// A box around triangle @p primitive at all times.
  HIPRT_HD Box bounds(std::uint32_t primitive) const {
    Box box = primitive_detail::empty_box();
    for (std::uint32_t key = 0; key < mesh.keys; ++key)
      for (unsigned corner = 0; corner < 3; ++corner)
        shape_detail::grow_by_corner(box, position(key, primitive, corner));
    return box;
  }

  /// The closest point of triangle @p primitive at the time of the query. u and v are the weights of corners 1 and 2.
  HIPRT_HD CustomPoint closest(const PointInObject& at, std::uint32_t primitive) const {
    float vertex[3][3];
    place(primitive, moment_at(at.time), vertex);
    Vec3D corner[3];
    for (unsigned k = 0; k < 3; ++k) corner[k] = Vec3D(vertex[k][0], vertex[k][1], vertex[k][2]);
    const TrianglePoint near = closest_on_triangle(corner, at.point);
    return {near.squared, near.point, near.u, near.v};
  }

 private:
  /// A time between two keys.
  struct Moment {
    std::uint32_t key, next;
    float s;  ///< 0 at key, 1 at next.
  };

  HIPRT_HD HIPRT_FORCE_INLINE Moment moment_at(float time) const {
    const std::uint32_t last = mesh.keys - 1;
    const auto time_of = [&](std::uint32_t key) { return mesh.times[std::uint64_t{key} * mesh.time_stride]; };
    const std::uint32_t key = segment_at(last, time, time_of);
    if (key >= last) return {last, last, 0.0f};
    return {key, key + 1, part_of(time_of(key), time_of(key + 1), time)};
  }

  /// Sets the corners at a moment. @return the largest magnitude of a coordinate at either key.
  HIPRT_HD HIPRT_FORCE_INLINE float place(std::uint32_t primitive, const Moment& moment, float (&vertex)[3][3]) const {
    float magnitude = 0.0f;
    for (unsigned corner = 0; corner < 3; ++corner) {
      const float* const from = position(moment.key, primitive, corner);
      const float* const to = position(moment.next, primitive, corner);
      for (unsigned axis = 0; axis < 3; ++axis) {
        vertex[corner][axis] = motion_detail::between(from[axis], to[axis], 1.0f - moment.s, moment.s);
        magnitude = max_of(magnitude, max_of(absolute(from[axis]), absolute(to[axis])));
      }
    }
    return magnitude;
  }

  HIPRT_HD HIPRT_FORCE_INLINE const float* position(std::uint32_t key, std::uint32_t primitive, unsigned corner) const {
    const std::uint64_t vertex = mesh.triangles[3 * static_cast<std::uint64_t>(primitive) + corner];
    return mesh.positions + mesh.stride * (static_cast<std::uint64_t>(key) * mesh.vertices + vertex);
  }
};

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
