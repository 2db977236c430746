#pragma once
/// Where the box of an instance is at a ray's time: what format/moving_box.h makes room for.

#include <hiprt_device/math/lanes.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// @return 0 at the begin of the scene's shutter and before, 1 at its end and behind. @param time may be infinite.
HIPRT_HD HIPRT_INLINE float shutter_fraction(const SceneView& scene, float time) {
  const float fraction = (time - scene.shutter_begin) * scene.shutter_rate;
  return fraction > 0.0f ? (fraction < 1.0f ? fraction : 1.0f) : 0.0f;
}

/// @param box of a leaf, at the begin and the end.
HIPRT_HD HIPRT_INLINE Box box_at(const Box (&box)[2], float fraction) {
  Box result;
  for (unsigned axis = 0; axis < 3; ++axis) {
    result.min[axis] = multiply_add(fraction, box[1].min[axis] - box[0].min[axis], box[0].min[axis]);
    result.max[axis] = multiply_add(fraction, box[1].max[axis] - box[0].max[axis], box[0].max[axis]);
  }
  return result;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
