#include <tests/gpu/trace_instances.h>

#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>

namespace hiprt::checks {
namespace {

using Tracer = Instanced<Policies<>, 2>;

HIPRT_HD InstanceAnswer answer(const SceneView& view, const Ray& ray) {
  const auto hit = closest_hit<Tracer>(view, ray);
  if (!hit.found()) return {};
  InstanceAnswer result{hit.t, hit.u, {}, hit.primitive};
  for (unsigned i = 0; i < 2; ++i) result.instance[i] = i < hit.path.depth ? hit.path.instance[i] : kInvalidId;
  return result;
}

__global__ void trace(const gpu::InstanceReport* report, const Ray* rays, InstanceAnswer* answers, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) answers[i] = answer(report->view, rays[i]);
}

}  // namespace

gpu::Result<std::vector<InstanceAnswer>> trace_instances(const gpu::InstanceReport* report, std::span<const Ray> rays,
                                                         hipStream_t stream, gpu::Allocator& allocator) {
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, stream, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto answers = gpu::DeviceArray<InstanceAnswer>::make(rays.size(), stream, allocator);
  if (!answers) return tl::unexpected(answers.error());
  const auto count = static_cast<unsigned>(rays.size());
  auto done = gpu::launch(trace, count, stream, {}, report, device_rays->data(), answers->data(), count);
  if (!done) return tl::unexpected(done.error());
  return answers->to_vector(stream);
}

std::vector<InstanceAnswer> trace_instances(const SceneView& view, std::span<const Ray> rays) {
  std::vector<InstanceAnswer> answers;
  for (const Ray& ray : rays) answers.push_back(answer(view, ray));
  return answers;
}

}  // namespace hiprt::checks
