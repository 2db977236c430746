// expect: hiprt: DoubleRays must be inside Instanced
// Levels of instances inside double rays: their stack would hold float rays.

#include <hiprt_device/hiprt_device.h>

#if HIPRT_FAULT
using Tracer = hiprt::DoubleRays<hiprt::Instanced<hiprt::Policies, 2>>;
#else
using Tracer = hiprt::Instanced<hiprt::DoubleRays<hiprt::Policies>, 2>;
#endif

bool trace(const hiprt::SceneView& scene, const hiprt::RayD& ray) { return hiprt::any_hit<Tracer>(scene, ray).found(); }
