// expect: hiprt: Policies::Schedule needs
// A schedule that does not say which lanes belong together.

#include <hiprt_device/hiprt_device.h>

struct Schedule {
  static constexpr bool kTogether = false;
  static constexpr bool kBatchOnly = false;
#if !HIPRT_FAULT
  static hiprt::LaneMask group() { return 1; }
#endif
};
struct P : hiprt::Policies {
  using Schedule = ::Schedule;
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit<P>(scene, ray); }
