// expect: hiprt: Policies::Counter needs on_boxes
// A counter without a member that the traversal calls.

#include <hiprt_device/hiprt_device.h>

struct Counter {
  void on_boxes() {}
#if !HIPRT_FAULT
  void on_leaf(unsigned) {}
#endif
};
struct P : hiprt::Policies {
  using Counter = ::Counter;
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit<P>(scene, ray); }
