// expect: hiprt: Policies::Triangle needs
// A box test in place of the triangle test.

#include <hiprt_device/hiprt_device.h>

#if HIPRT_FAULT
using Triangle = hiprt::Conservative;
#else
using Triangle = hiprt::Fast;
#endif

struct P : hiprt::Policies {
  using Triangle = ::Triangle;
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit<P>(scene, ray); }
