// expect: hiprt: policies need kFeatures
// Features that are not a number.

#include <hiprt_device/hiprt_device.h>

struct P : hiprt::Policies {
#if HIPRT_FAULT
  struct Unknown {};
  static constexpr Unknown kFeatures{};
#endif
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::any_hit<P>(scene, ray); }
