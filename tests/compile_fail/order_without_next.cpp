// expect: hiprt: Policies::AnyOrder needs
// An order of any hits without a next node.

#include <hiprt_device/hiprt_device.h>

struct LastFirst {
  using Entry = hiprt::NodeRef;
#if !HIPRT_FAULT
  template <class Hits, class Backtrack>
  static hiprt::NodeRef next(const hiprt::NodeRef (&child)[hiprt::kBranching], const Hits& hits, Backtrack& backtrack) {
    return hiprt::Unordered::next(child, hits, backtrack);
  }
#endif
};
struct P : hiprt::Policies {
  using AnyOrder = LastFirst;
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::any_hit<P>(scene, ray); }
