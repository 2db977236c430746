#include <tests/gpu/mutants.h>

#include <hiprt_device/hiprt_device.h>

namespace hiprt::checks {
namespace {

struct Flat : Policies {
  using Stack = PrivateStack<kMutantStack>;
};
struct InLevels : Moving<Instanced<Flat, kMutantLevels>> {};

template <class P> HIPRT_HD MutantHit trace_with(const SceneView& scene, const Ray& ray) {
  typename P::Stack::Memory stack;
  MutantHit result;
  const auto closest = ClosestHit<P>(scene, ray, stack).next_hit();
  result.hit = closest;
  if constexpr (P::kLevels != 0)
    if (closest.found()) result.instance = closest.path.instance[0];
  return result;
}

HIPRT_HD MutantHit trace_ray(const SceneView& scene, const Ray& ray) {
  return scene.levels == 0 ? trace_with<Flat>(scene, ray) : trace_with<InLevels>(scene, ray);
}

__global__ void trace_all(const SceneView* scenes, const Ray* rays, MutantHit* results, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = trace_ray(scenes[i / kMutantRays], rays[i]);
}

}  // namespace

std::vector<MutantHit> trace_mutants(std::span<const SceneView> scenes, std::span<const Ray> rays) {
  std::vector<MutantHit> results;
  for (std::size_t i = 0; i < rays.size(); ++i) results.push_back(trace_ray(scenes[i / kMutantRays], rays[i]));
  return results;
}

gpu::Result<std::vector<MutantHit>> trace_mutants_on_device(std::span<const SceneView> scenes,
                                                            std::span<const Ray> rays) {
  gpu::DeviceAllocator allocator;
  const auto device_scenes = gpu::DeviceArray<SceneView>::from(scenes, nullptr, allocator);
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, nullptr, allocator);
  auto results = gpu::DeviceArray<MutantHit>::make(rays.size(), nullptr, allocator);
  if (!device_scenes) return tl::unexpected(device_scenes.error());
  if (!device_rays) return tl::unexpected(device_rays.error());
  if (!results) return tl::unexpected(results.error());
  const auto count = static_cast<unsigned>(rays.size());
  auto done =
      gpu::launch(trace_all, count, nullptr, {}, device_scenes->data(), device_rays->data(), results->data(), count);
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(nullptr);
}

}  // namespace hiprt::checks
