#include <tests/gpu/extremes.h>

#include <hiprt_device/hiprt_device.h>

namespace hiprt::checks {
namespace {

struct Exact : Policies {
  using Triangle = Reference;
};

HIPRT_HD ExtremeAnswer answer(const SceneView& scene, const Ray& ray) {
  return {closest_hit<Policies>(scene, ray), closest_hit<Exact>(scene, ray),
          any_hit<Policies>(scene, ray).found() ? 1u : 0u};
}

__global__ void answer_all(SceneView scene, const Ray* rays, ExtremeAnswer* answers, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) answers[i] = answer(scene, rays[i]);
}

}  // namespace

std::vector<ExtremeAnswer> extreme_answers(const SceneView& scene, std::span<const Ray> rays) {
  std::vector<ExtremeAnswer> answers;
  for (const Ray& ray : rays) answers.push_back(answer(scene, ray));
  return answers;
}

gpu::Result<std::vector<ExtremeAnswer>> extreme_answers_on_device(const SceneView& scene, std::span<const Ray> rays) {
  gpu::DeviceAllocator allocator;
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, nullptr, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto answers = gpu::DeviceArray<ExtremeAnswer>::make(rays.size(), nullptr, allocator);
  if (!answers) return tl::unexpected(answers.error());
  const auto count = static_cast<unsigned>(rays.size());
  auto done = gpu::launch(answer_all, count, nullptr, {}, scene, device_rays->data(), answers->data(), count);
  if (!done) return tl::unexpected(done.error());
  return answers->to_vector(nullptr);
}

}  // namespace hiprt::checks
