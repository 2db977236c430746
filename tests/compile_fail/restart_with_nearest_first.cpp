// expect: hiprt: NearestFirst: a restart trail needs
// A restart trail under an order that it cannot follow.

#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/traverse/stacks/restart.h>

struct P : hiprt::Policies {
  using Stack = hiprt::RestartStack<4>;
#if HIPRT_FAULT
  using ClosestOrder = hiprt::NearestFirst;
#endif
};

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) {
  return hiprt::ClosestHit<P>(scene, ray, {}).next_hit();
}
