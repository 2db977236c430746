// expect: hiprt: PrimitiveList: a primitive has no CustomPoint closest
// A functor for rays only, in a point query.

#include <hiprt_device/hiprt_device.h>

struct Marks {
  template <class Report> bool intersect(const hiprt::Ray&, float, float, std::uint32_t, Report&&) const {
    return true;
  }
#if !HIPRT_FAULT
  hiprt::CustomPoint closest(const hiprt::PointInObject&, std::uint32_t) const { return {}; }
#endif
};

hiprt::ClosestPoint near(const hiprt::SceneView& scene, const hiprt::PointQuery& query) {
  hiprt::PrivateStack<>::Memory memory;
  return hiprt::closest_point<hiprt::Policies>(scene, query, memory, hiprt::PrimitiveList<Marks>{});
}
