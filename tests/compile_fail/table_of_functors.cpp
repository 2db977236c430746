// expect: hiprt: PrimitiveTable: a row must be a PrimitiveList
// A functor in a table, in place of a list of functors.

#include <hiprt_device/hiprt_device.h>

struct Sphere {
  template <class Report> bool intersect(const hiprt::Ray&, float, float, std::uint32_t, Report&& report) const {
    return report(hiprt::CustomHit{});
  }
};
#if HIPRT_FAULT
using Row = Sphere;
#else
using Row = hiprt::PrimitiveList<Sphere>;
#endif
using Seen = hiprt::TableRow<hiprt::PrimitiveTable<Row>>;

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::AnyHit<hiprt::Policies, hiprt::NoFilter, Seen>(scene, ray, memory).next_hit();
}
