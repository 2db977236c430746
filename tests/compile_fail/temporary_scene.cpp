// expect: deleted
// A query of a temporary scene, which ends before the query runs.

#include <hiprt_device/hiprt_device.h>

hiprt::SceneView make_scene() { return {}; }

hiprt::Hit trace(const hiprt::Ray& ray) {
  hiprt::PrivateStack<>::Memory memory;
#if HIPRT_FAULT
  hiprt::ClosestHit<> query(make_scene(), ray, memory);
#else
  const hiprt::SceneView scene = make_scene();
  hiprt::ClosestHit<> query(scene, ray, memory);
#endif
  return query.next_hit();
}
