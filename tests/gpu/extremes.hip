#include <tests/gpu/extremes.h>

#include <hiprt_device/hiprt_device.h>

namespace hiprt::checks {
namespace {

struct Exact : Policies {
  using Triangle = Reference;
};

HIPRT_HD ExtremeHits trace_ray(const SceneView& scene, const Ray& ray) {
  return {closest_hit<Policies>(scene, ray), closest_hit<Exact>(scene, ray),
          any_hit<Policies>(scene, ray).found() ? 1u : 0u};
}

__global__ void trace_all(SceneView scene, const Ray* rays, ExtremeHits* results, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = trace_ray(scene, rays[i]);
}

}  // namespace

std::vector<ExtremeHits> trace_extremes(const SceneView& scene, std::span<const Ray> rays) {
  std::vector<ExtremeHits> results;
  for (const Ray& ray : rays) results.push_back(trace_ray(scene, ray));
  return results;
}

gpu::Result<std::vector<ExtremeHits>> trace_extremes_on_device(const SceneView& scene, std::span<const Ray> rays) {
  gpu::DeviceAllocator allocator;
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, nullptr, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto results = gpu::DeviceArray<ExtremeHits>::make(rays.size(), nullptr, allocator);
  if (!results) return tl::unexpected(results.error());
  const auto count = static_cast<unsigned>(rays.size());
  auto done = gpu::launch(trace_all, count, nullptr, {}, scene, device_rays->data(), results->data(), count);
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(nullptr);
}

}  // namespace hiprt::checks
