#pragma once
/// What a custom primitive reports.

#include <hiprt_device/vec.h>

namespace hiprt {

struct CustomHit {
  float t;      ///< In units of the direction.
  float u, v;   ///< Surface parameters, as the primitive likes.
  Vec3 normal;  ///< Outward geometric normal, any length but 0.
  /// Bound, in scene units and per axis, of the distance between origin + t * direction and the surface, as Hit::error.
  float error;
};

}  // namespace hiprt
