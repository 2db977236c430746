// Policies of one's own: all choices in a struct, and the smallest set of features that covers a scene.

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

struct Lean : hiprt::Policies {  // What is not said is the default.
  using Layout = hiprt::QuantizedLayout;
  using Stack = hiprt::PrivateStack<64>;
  static constexpr hiprt::FeatureMask kFeatures = hiprt::feature_bit(hiprt::Feature::kTriangles);
};
struct Full : Lean {
  static constexpr hiprt::FeatureMask kFeatures = hiprt::kKnownFeatures;
};

template <class P>
__global__ void trace_with(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<P>(scene, rays[i]);
}

/// Returns false if neither covers the scene, for example because of its layout.
bool launch_smallest(const hiprt::SceneView& scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const auto kernel = hiprt::covers<Lean>(scene)   ? trace_with<Lean>
                      : hiprt::covers<Full>(scene) ? trace_with<Full>
                                                   : nullptr;
  if (kernel == nullptr) return false;
  hipLaunchKernelGGL(kernel, dim3((count + 63) / 64), dim3(64), 0, nullptr, scene, rays, hits, count);
  return hipGetLastError() == hipSuccess;
}
