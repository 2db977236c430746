#pragma once
/// The box of a moving instance at a ray's time. format/moving_box.h makes the boxes large enough for the rounding
/// here.

#include <hiprt_device/math/lanes.h>
#include <hiprt_device/scene_view.h>

namespace hiprt {
inline namespace HIPRT_ISA_NAMESPACE {

/// The fraction of the scene's shutter that has passed.
/// @return 0 at the begin of the shutter and before, 1 at its end and after.
/// @param time may be infinite.
HIPRT_HD HIPRT_FORCE_INLINE float shutter_fraction(const SceneView& scene, float time) {
  const float fraction = (time - scene.shutter_begin) * scene.shutter_rate;
  return fraction > 0.0f ? (fraction < 1.0f ? fraction : 1.0f) : 0.0f;
}

/// The box of a leaf at a fraction of the shutter.
/// @param box of the leaf at the begin and at the end.
HIPRT_HD HIPRT_FORCE_INLINE Box box_at(const Box (&box)[2], float fraction) {
  Box result;
  for (unsigned axis = 0; axis < 3; ++axis) {
    result.min[axis] = multiply_add(fraction, box[1].min[axis] - box[0].min[axis], box[0].min[axis]);
    result.max[axis] = multiply_add(fraction, box[1].max[axis] - box[0].max[axis], box[0].max[axis]);
  }
  return result;
}

}  // namespace HIPRT_ISA_NAMESPACE
}  // namespace hiprt
