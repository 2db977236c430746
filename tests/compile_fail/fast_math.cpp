// expect: HIPRT_ALLOW_FAST_MATH
// As -ffast-math defines it; without the fault: by one who knows what that costs.

#if !HIPRT_FAULT
#define HIPRT_ALLOW_FAST_MATH
#endif
#define __FAST_MATH__ 1

#include <hiprt_device/hiprt_device.h>

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit(scene, ray); }
