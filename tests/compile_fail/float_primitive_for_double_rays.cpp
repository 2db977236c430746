// expect: hiprt: PrimitiveList: a primitive has no intersect.. for this query's rays
// A primitive for float rays only, in a query of double rays.

#include <hiprt_device/hiprt_device.h>

#if HIPRT_FAULT
using Ray = hiprt::Ray;
using Number = float;
#else
using Ray = hiprt::RayD;
using Number = double;
#endif

struct Sphere {
  template <class Report> bool intersect(const Ray&, Number, Number, std::uint32_t, Report&& report) const {
    return report(hiprt::BasicCustomHit<Number>{});
  }
};
using Spheres = hiprt::PrimitiveList<Sphere>;

hiprt::HitD trace(const hiprt::SceneView& scene, const hiprt::RayD& ray) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::ClosestHit<hiprt::DoubleRays<>, hiprt::NoFilter, Spheres>(scene, ray, memory).next_hit();
}
