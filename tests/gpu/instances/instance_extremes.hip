#include <tests/gpu/instances/instance_extremes.h>

#include <hiprt_device/hiprt_device.h>

#include <type_traits>

namespace hiprt::checks {
namespace {

template <class P> using Deep = Moving<Instanced<P, kExtremeLevels>>;

template <class P>
HIPRT_HD ExtremeInstanceHit trace_ray(const SceneView& scene, const BasicRay<typename P::Real>& ray) {
  const auto hit = closest_hit<P>(scene, ray);
  ExtremeInstanceHit result;
  result.t = hit.t;
  result.u = hit.u;
  result.v = hit.v;
  result.error = hit.error;
  result.geometry = hit.geometry;
  result.primitive = hit.primitive;
  result.depth = hit.path.depth;
  for (unsigned i = 0; i < hit.path.depth; ++i) result.instance[i] = hit.path.instance[i];
  if (!hit.found()) return result;
  result.t_error = t_error(scene, ray, hit);
  const auto spawned = spawn_origin(ray, hit, -ray.direction);
  for (int k = 0; k < 3; ++k) {
    result.normal[k] = hit.normal[k];
    result.spawned[k] = spawned[k];
  }
  return result;
}

using Default = Deep<Policies>;
struct ByReference : Policies {
  using Triangle = Reference;
};
using Exact = Deep<ByReference>;
using Double = Deep<DoubleRays<>>;

/// One policy's: a kernel each.
template <class P> HIPRT_HD void trace_one(ExtremeInstanceHits& all, const SceneView& scene, const Ray& ray) {
  if constexpr (std::is_same_v<P, Default>) all.closest = trace_ray<P>(scene, ray);
  if constexpr (std::is_same_v<P, Exact>) all.reference = trace_ray<P>(scene, ray);
  if constexpr (std::is_same_v<P, Double>) all.in_double = trace_ray<P>(scene, convert<double>(ray));
}

template <class P>
__global__ void trace_all(SceneView scene, const Ray* rays, ExtremeInstanceHits* all, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) trace_one<P>(all[i], scene, rays[i]);
}

}  // namespace

std::vector<ExtremeInstanceHits> trace_extreme_instances(const SceneView& scene, std::span<const Ray> rays) {
  std::vector<ExtremeInstanceHits> results;
  for (const Ray& ray : rays) {
    ExtremeInstanceHits& all = results.emplace_back();
    trace_one<Default>(all, scene, ray);
    trace_one<Exact>(all, scene, ray);
    trace_one<Double>(all, scene, ray);
  }
  return results;
}

gpu::Result<std::vector<ExtremeInstanceHits>> trace_extreme_instances_on_device(const SceneView& scene,
                                                                                std::span<const Ray> rays) {
  gpu::DeviceAllocator allocator;
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, nullptr, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto results = gpu::DeviceArray<ExtremeInstanceHits>::make(rays.size(), nullptr, allocator);
  if (!results) return tl::unexpected(results.error());
  const auto count = static_cast<unsigned>(rays.size());
  for (auto* kernel : {trace_all<Default>, trace_all<Exact>, trace_all<Double>})
    if (auto done = gpu::launch(kernel, count, nullptr, {}, scene, device_rays->data(), results->data(), count); !done)
      return tl::unexpected(done.error());
  return results->to_vector(nullptr);
}

}  // namespace hiprt::checks
