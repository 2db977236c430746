// expect: hiprt: Policies::Schedule needs
// A schedule whose lanes wait for each other, but do not vote.

#include <hiprt_device/hiprt_device.h>

struct Schedule {
  static constexpr bool kTogether = true;
  static constexpr bool kBatchOnly = false;
  static hiprt::LaneMask group() { return hiprt::Postponed::group(); }
  static bool search_on(hiprt::LaneMask group, bool searches) { return hiprt::Postponed::search_on(group, searches); }
#if !HIPRT_FAULT
  static bool leaves(hiprt::LaneMask group, bool busy, bool may_pause) {
    return hiprt::Postponed::leaves(group, busy, may_pause);
  }
#endif
};
struct P : hiprt::Policies {
  using Schedule = ::Schedule;
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit<P>(scene, ray); }
