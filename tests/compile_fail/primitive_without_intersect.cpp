// expect: CustomPrimitive
// A functor of custom primitives that cannot be intersected.

#include <hiprt_device/hiprt_device.h>

struct Sphere {
#if !HIPRT_FAULT
  template <class Report> bool intersect(const hiprt::Ray&, float, float, std::uint32_t, Report&& report) const {
    return report(hiprt::CustomHit{});
  }
#endif
};
using Spheres = hiprt::PrimitiveList<Sphere>;

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::ClosestHit<hiprt::Policies, hiprt::NoFilter, Spheres>(scene, ray, memory).next_hit();
}
