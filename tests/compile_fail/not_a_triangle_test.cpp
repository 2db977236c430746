// expect: TriangleTest
// A box test where the triangle test belongs.

#include <hiprt_device/hiprt_device.h>

#if HIPRT_FAULT
using Triangle = hiprt::Conservative;
#else
using Triangle = hiprt::Fast;
#endif

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  return hiprt::closest_hit<hiprt::Policies<hiprt::PlanesLayout, Triangle>>(scene, ray);
}
