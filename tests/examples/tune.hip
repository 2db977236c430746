#include <hip/hip_runtime.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>

struct Together : hiprt::Policies {
  using Schedule = hiprt::Postponed;
};

template <class P>
__global__ void trace_tuned(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit<P>(scene, rays[i]);
}

/// @param kind "primary", "reflections", ...: rays of a kind are alike.
hiprt::gpu::Result<void> trace_fastest(hiprt::gpu::Tuner& tuner, const char* kind, const hiprt::SceneView& scene,
                                       const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count, hipStream_t stream) {
  void (*const kernels[])(hiprt::SceneView, const hiprt::Ray*, hiprt::Hit*, unsigned) = {trace_tuned<hiprt::Policies>,
                                                                                         trace_tuned<Together>};
  const auto start = [&](unsigned candidate) {
    return hiprt::gpu::launch(kernels[candidate], count, stream, {.block = 64}, scene, rays, hits, count);
  };
  const auto fastest = tuner.choose(kind, 2, stream, start);
  return fastest ? start(*fastest) : tl::unexpected(fastest.error());
}
