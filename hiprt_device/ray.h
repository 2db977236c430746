#pragma once
/// Rays and hits.

#include <hiprt_device/format/node.h>
#include <hiprt_device/vec.h>

#include <limits>

namespace hiprt {

/// The points origin + t * direction with tmin <= t <= tmax, t in units of the direction's length.
///
/// - direction: any length; not normalised by the library. Components may be 0 or -0.
/// - tmin, tmax: both ends belong to the ray. A negative tmin counts as 0. tmax may be +inf.
/// - A ray that is not finite (tmax excepted), has a zero direction, or tmin > tmax, misses everything.
/// - Guarantees (docs/decisions/0003-conservative-boxes.md) hold while the largest coordinate of scene bounds and of
///   the origin is in [2^-100, 2^60], the largest direction component in [2^-100, 2^126], and their ratio in
///   [2^-100, 2^90]. A hit whose t is beyond the largest float is a miss.
struct Ray {
  Vec3 origin{0.0f};
  float tmin = 0.0f;
  Vec3 direction{0.0f, 0.0f, 1.0f};
  float tmax = std::numeric_limits<float>::infinity();
  std::uint32_t mask = 0xffffffffu;  ///< Sees the geometries with (mask & geometry mask) != 0.
  float time = 0.0f;                 ///< When: for scenes that move, in the units of their keys. Any number.
};

/// The answer to a closest-hit query. Of hits at the same t the one with the lowest geometry, then the lowest primitive
/// number is reported, so that hits do not depend on the tree, its builder or its layout.
struct Hit {
  float t = std::numeric_limits<float>::infinity();  ///< +inf: a miss. NaN: see failed().
  float u = 0.0f;  ///< Weight of the triangle's corner 1; the point is (1 - u - v) * p0 + u * p1 + v * p2.
  float v = 0.0f;  ///< Weight of the triangle's corner 2.
  std::uint32_t geometry = kInvalidId;
  std::uint32_t primitive = kInvalidId;  ///< Within the geometry.
  /// cross(p1 - p0, p2 - p0): not normalised, length = 2 * area; but times a power of two if its largest component is
  /// not in [2^-100, 2^127), which a float could not hold, or not to the last bit.
  Vec3 normal{0.0f};
  /// Bound, in scene units and per axis, of the distance between the computed point origin + t * direction and the
  /// triangle, with room for the rounding of a ray that starts there (spawn.h).
  float error = 0.0f;

  HIPRT_HD bool found() const { return primitive != kInvalidId; }
  /// The policies do not cover the scene (covers()), or the stack was too small: not known whether there is a hit.
  HIPRT_HD bool failed() const { return t != t; }
};

}  // namespace hiprt
