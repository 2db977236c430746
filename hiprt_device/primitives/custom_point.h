#pragma once
/// What a point query asks of a custom primitive, and what the primitive tells it.

#include <hiprt_device/math/vec.h>

namespace hiprt {

/// The point of a query, as the primitive's object sees it.
struct PointInObject {
  Vec3D point;
  double limit_squared;  ///< Points whose squared distance is larger need not be found. In the object's units.
  float time;            ///< Of the query.
};

/// The closest point of a custom primitive.
struct CustomPoint {
  /// Its squared distance from the query's point, in the object's units. +inf or NaN: there is none.
  double squared = std::numeric_limits<double>::infinity();
  Vec3D point{0};           ///< In the object's space.
  double u = 0.0, v = 0.0;  ///< Two surface parameters; the primitive defines their meaning.
};

}  // namespace hiprt
