// Kernels with this library's own queries.

#include "trace_job.h"

#include <hip/hip_runtime.h>
#include <hiprt_device/hiprt_device.h>

namespace hiprt::bench {
namespace {

/// Waves process leaves together, and hits have no normals: HIPRT's classes are made of the same.
struct Alone : Policies {
  using Schedule = Postponed;
  static constexpr bool kSurface = false;
};
/// What one level of instances requires.
struct InScene : Instanced<Alone, 1> {};

__device__ Ray load_ray(const NamesJob& job, std::uint32_t i) {
  const hiprtRay ray = job.rays[i];
  return {{ray.origin.x, ray.origin.y, ray.origin.z},
          ray.minT,
          {ray.direction.x, ray.direction.y, ray.direction.z},
          ray.maxT};
}

template <class P, bool kScene, bool kAny> __global__ void query_kernel(NamesJob job) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= job.count) return;
  const SceneView& scene = kScene ? job.scene_view : job.geometry_view;
  const Hit hit = kAny ? any_hit<P>(scene, load_ray(job, i)) : closest_hit<P>(scene, load_ray(job, i));
  job.results[i] = {hit.found() ? hit.t : -1.0f, hit.primitive};
}

__global__ void hits_kernel(NamesJob job, Hit* hits) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= job.count) return;
  hits[i] = closest_hit<Policies>(job.geometry_view, load_ray(job, i));
}

template <class P, bool kScene, bool kAny> const void* address() {
  return reinterpret_cast<const void*>(query_kernel<P, kScene, kAny>);
}

}  // namespace

std::span<const NamesKernel> own_kernels() {
  static const NamesKernel kernels[] = {
      {"closest_hit", false, false, address<Alone, false, false>()},
      {"any_hit", false, true, address<Alone, false, true>()},
      {"closest_hit, one level", true, false, address<InScene, true, false>()},
      {"any_hit, one level", true, true, address<InScene, true, true>()},
  };
  return kernels;
}

const void* spawn_kernel() { return reinterpret_cast<const void*>(hits_kernel); }

}  // namespace hiprt::bench
