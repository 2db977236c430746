// Headers of both kinds in one file, this library's first; test_*.cpp have the other order. Compiling is the test.

#include <hiprt_build/build.h>
#include <hiprt_device/hiprt_device.h>

#include <hiprt/hiprt_device.h>
#include <hiprt/hiprt_math.h>

namespace hiprt {

/// A traversal of each kind.
float both(const SceneView& scene, const hiprtRay& ray) {
  const Hit own = closest_hit(
      scene, {compat_detail::to_vec3(ray.origin), ray.minT, compat_detail::to_vec3(ray.direction), ray.maxT});
  return own.t + hiprtGeomTraversalClosest(geometry_handle(&scene), ray).getNextHit().t;
}

}  // namespace hiprt
