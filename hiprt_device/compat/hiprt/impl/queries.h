#pragma once
/// HIPRT's transform queries: functions of an instance's number or of a hit's instanceIDs, and of a time.
///
/// In HIPRT a "vector" is a normal: transformed by the inverse transpose to the world, by the transpose to the object.

#include <hiprt/impl/transforms.h>

#define HIPRT_COMPAT_QUERY(Name, function)                                                                           \
  HIPRT_HD inline hiprtFloat3 Name(const hiprtFloat3& v, hiprtScene scene, uint32_t instanceID, float time = 0.0f) { \
    using namespace hiprt::compat_detail;                                                                            \
    return to_float3(PlacedPath(scene, instanceID, time).function(to_vec3(v)));                                      \
  }                                                                                                                  \
  HIPRT_HD inline hiprtFloat3 Name(const hiprtFloat3& v, hiprtScene scene,                                           \
                                   const uint32_t(&instanceIDs)[hiprtMaxInstanceLevels], float time = 0.0f) {        \
    using namespace hiprt::compat_detail;                                                                            \
    return to_float3(PlacedPath(scene, instanceIDs, time).function(to_vec3(v)));                                     \
  }
HIPRT_COMPAT_QUERY(hiprtPointObjectToWorld, point_to_scene)
HIPRT_COMPAT_QUERY(hiprtPointWorldToObject, point_to_object)
HIPRT_COMPAT_QUERY(hiprtVectorObjectToWorld, normal_to_scene)
HIPRT_COMPAT_QUERY(hiprtVectorWorldToObject, normal_to_object)
#undef HIPRT_COMPAT_QUERY

/// Frames of an instance at a time. The forms with all numbers are those of HIPRT 2.
HIPRT_HD inline hiprtFrameMatrix hiprtGetObjectToWorldFrameMatrix(hiprtScene scene, uint32_t instanceID, float time) {
  using namespace hiprt::compat_detail;
  return world_frame(PlacedPath(scene, instanceID, time)).matrix(time);
}
HIPRT_HD inline hiprtFrameMatrix hiprtGetObjectToWorldFrameMatrix(hiprtScene scene,
                                                                  const uint32_t (&instanceIDs)[hiprtMaxInstanceLevels],
                                                                  float time) {
  using namespace hiprt::compat_detail;
  return world_frame(PlacedPath(scene, instanceIDs, time)).matrix(time);
}
HIPRT_HD inline hiprtFrameMatrix hiprtGetWorldToObjectFrameMatrix(hiprtScene scene, uint32_t instanceID, float time) {
  using namespace hiprt::compat_detail;
  return object_frame(PlacedPath(scene, instanceID, time)).matrix(time);
}
HIPRT_HD inline hiprtFrameMatrix hiprtGetWorldToObjectFrameMatrix(hiprtScene scene,
                                                                  const uint32_t (&instanceIDs)[hiprtMaxInstanceLevels],
                                                                  float time) {
  using namespace hiprt::compat_detail;
  return object_frame(PlacedPath(scene, instanceIDs, time)).matrix(time);
}
/// The same without shear, as scale, rotation and translation.
HIPRT_HD inline hiprtFrameSRT hiprtGetObjectToWorldFrameSRT(hiprtScene scene, uint32_t instanceID, float time) {
  using namespace hiprt::compat_detail;
  return without_shear(world_frame(PlacedPath(scene, instanceID, time)), time);
}
HIPRT_HD inline hiprtFrameSRT hiprtGetWorldToObjectFrameSRT(hiprtScene scene, uint32_t instanceID, float time) {
  using namespace hiprt::compat_detail;
  return without_shear(object_frame(PlacedPath(scene, instanceID, time)), time);
}
