// expect: hiprt: a filter needs FilterResult
// A filter that returns a bool.

#include <hiprt_device/hiprt_device.h>

#if HIPRT_FAULT
using Result = bool;
#else
using Result = hiprt::FilterResult;
#endif

struct Filter {
  Result operator()(const hiprt::Ray&, const hiprt::Hit&) const { return Result{}; }
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::ClosestHit<hiprt::Policies, Filter>(scene, ray, memory).next_hit();
}
