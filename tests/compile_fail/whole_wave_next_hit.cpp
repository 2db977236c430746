// expect: WholeWave schedule is for trace_batch
// A schedule of whole waves for a single ray.

#include <hiprt_device/hiprt_device.h>

struct P : hiprt::Policies {
#if HIPRT_FAULT
  using Schedule = hiprt::WholeWave<16>;
#else
  using Schedule = hiprt::Postponed;
#endif
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::AllHits<P>(scene, ray, memory).next_hit();
}
