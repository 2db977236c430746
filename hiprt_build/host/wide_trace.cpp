/// Compiled once per instruction set (HIPRT_ISA_NAME).

#include <hiprt_build/host/wide_trace.h>

#include <hiprt_device/hiprt_device.h>

#define HIPRT_JOIN_EXPANDED(a, b) a##b
#define HIPRT_JOIN(a, b) HIPRT_JOIN_EXPANDED(a, b)

namespace hiprt::format_detail {
namespace {

struct Wide : Policies {
  using Layout = WideLayout;
  using Lanes = WideLanes;
};

}  // namespace

Hit HIPRT_JOIN(wide_closest_hit_, HIPRT_ISA_NAME)(const SceneView& scene, const Ray& ray) {
  return closest_hit<Wide>(scene, ray);
}

Hit HIPRT_JOIN(wide_any_hit_, HIPRT_ISA_NAME)(const SceneView& scene, const Ray& ray) {
  return any_hit<Wide>(scene, ray);
}

}  // namespace hiprt::format_detail
