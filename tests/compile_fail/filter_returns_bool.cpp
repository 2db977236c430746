// expect: hiprt: a filter needs FilterAnswer
// A filter that answers with a bool.

#include <hiprt_device/hiprt_device.h>

#if HIPRT_FAULT
using Answer = bool;
#else
using Answer = hiprt::FilterAnswer;
#endif

struct Filter {
  Answer operator()(const hiprt::Ray&, const hiprt::Hit&) const { return Answer{}; }
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::ClosestHit<hiprt::Policies, Filter>(scene, ray, memory).next_hit();
}
