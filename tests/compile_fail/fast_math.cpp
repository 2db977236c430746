// expect: HIPRT_ALLOW_FAST_MATH
// -ffast-math defines this macro. Without the fault the program accepts fast-math.

#if !HIPRT_FAULT
#define HIPRT_ALLOW_FAST_MATH
#endif
#define __FAST_MATH__ 1

#include <hiprt_device/hiprt_device.h>

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit(scene, ray); }
