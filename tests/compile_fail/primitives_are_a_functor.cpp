// expect: hiprt: custom primitives must be a PrimitiveList
// A functor in place of a list of functors.

#include <hiprt_device/hiprt_device.h>

struct Sphere {
  template <class Report> bool intersect(const hiprt::Ray&, float, float, std::uint32_t, Report&& report) const {
    return report(hiprt::CustomHit{});
  }
};
#if HIPRT_FAULT
using Shapes = Sphere;
#else
using Shapes = hiprt::PrimitiveList<Sphere>;
#endif

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::AnyHit<hiprt::Policies, hiprt::NoFilter, Shapes>(scene, ray, memory).next_hit();
}
