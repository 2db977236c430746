// expect: hiprt: Policies::Real must be float or double
// Rays of integers.

#include <hiprt_device/hiprt_device.h>

struct P : hiprt::Policies {
#if HIPRT_FAULT
  using Real = int;
#endif
};

template <class T> auto trace(const hiprt::SceneView& scene, const T& ray) { return hiprt::closest_hit<P>(scene, ray); }
auto hit(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return trace(scene, ray); }
