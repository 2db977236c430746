// expect: hiprt: Policies::Lanes must be
// A number in place of the lanes.

#include <hiprt_device/hiprt_device.h>

struct P : hiprt::Policies {
#if HIPRT_FAULT
  using Lanes = float;
#endif
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit<P>(scene, ray); }
