// expect: hiprt: Policies::ClosestOrder needs
// A number in place of the order of closest hits.

#include <hiprt_device/hiprt_device.h>

struct P : hiprt::Policies {
#if HIPRT_FAULT
  using ClosestOrder = int;
#endif
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit<P>(scene, ray); }
