// expect: hiprt needs C..20
// with: -std=c++17
// An older language: one error line, and the compiler stops.

#include <hiprt_device/hiprt_device.h>

hiprt::Hit trace(const hiprt::SceneView& scene, const hiprt::Ray& ray) { return hiprt::closest_hit(scene, ray); }
