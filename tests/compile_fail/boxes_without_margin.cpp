// expect: hiprt: Policies::Boxes needs
// A triangle test in place of the box test.

#include <hiprt_device/hiprt_device.h>

struct P : hiprt::Policies {
#if HIPRT_FAULT
  using Boxes = hiprt::Watertight;
#endif
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::any_hit<P>(scene, ray); }
