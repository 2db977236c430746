#include <tests/gpu/instance_extremes.h>

#include <hiprt_device/hiprt_device.h>

#include <type_traits>

namespace hiprt::checks {
namespace {

template <class P> using Deep = Moving<Instanced<P, kAnswerLevels>>;

template <class P> HIPRT_HD InstanceAnswer answer(const SceneView& scene, const BasicRay<typename P::Real>& ray) {
  const auto hit = closest_hit<P>(scene, ray);
  InstanceAnswer result;
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
template <class P> HIPRT_HD void answer_one(InstanceAnswers& all, const SceneView& scene, const Ray& ray) {
  if constexpr (std::is_same_v<P, Default>) all.closest = answer<P>(scene, ray);
  if constexpr (std::is_same_v<P, Exact>) all.reference = answer<P>(scene, ray);
  if constexpr (std::is_same_v<P, Double>) all.in_double = answer<P>(scene, convert<double>(ray));
}

template <class P> __global__ void answer_all(SceneView scene, const Ray* rays, InstanceAnswers* all, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) answer_one<P>(all[i], scene, rays[i]);
}

}  // namespace

std::vector<InstanceAnswers> instance_answers(const SceneView& scene, std::span<const Ray> rays) {
  std::vector<InstanceAnswers> results;
  for (const Ray& ray : rays) {
    InstanceAnswers& all = results.emplace_back();
    answer_one<Default>(all, scene, ray);
    answer_one<Exact>(all, scene, ray);
    answer_one<Double>(all, scene, ray);
  }
  return results;
}

gpu::Result<std::vector<InstanceAnswers>> instance_answers_on_device(const SceneView& scene,
                                                                     std::span<const Ray> rays) {
  gpu::DeviceAllocator allocator;
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, nullptr, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto results = gpu::DeviceArray<InstanceAnswers>::make(rays.size(), nullptr, allocator);
  if (!results) return tl::unexpected(results.error());
  const auto count = static_cast<unsigned>(rays.size());
  for (auto* kernel : {answer_all<Default>, answer_all<Exact>, answer_all<Double>})
    if (auto done = gpu::launch(kernel, count, nullptr, {}, scene, device_rays->data(), results->data(), count); !done)
      return tl::unexpected(done.error());
  return results->to_vector(nullptr);
}

}  // namespace hiprt::checks
