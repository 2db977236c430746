#include <tests/gpu/instances/trace_instances.h>

#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>
#include <hiprt_device/traverse/stacks/rolling.h>

namespace hiprt::checks {
namespace {

using Tracer = Moving<Instanced<Policies, 2>>;

struct Rolling : Policies {
  using Stack = RollingStack<8>;
};
using RollingTracer = Instanced<Rolling, 2>;

constexpr unsigned kBlock = 64;
/// Of global memory, for a ray: more than any tree of these tests needs.
constexpr std::uint32_t kSpillEntries = 192;

HIPRT_HD InstanceHit to_instance_hit(const PathHit<2>& hit) {
  if (!hit.found()) return {};
  InstanceHit result{hit.t, hit.u, {}, hit.primitive};
  for (unsigned i = 0; i < 2; ++i) result.instance[i] = i < hit.path.depth ? hit.path.instance[i] : kInvalidId;
  return result;
}

__global__ void trace(const gpu::InstanceReport* report, const Ray* rays, InstanceHit* results, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) results[i] = to_instance_hit(closest_hit<Tracer>(report->view, rays[i]));
}

/// A ring and the instance paths in shared memory.
__global__ void trace_on_chip(const gpu::InstanceReport* report, const Ray* rays, InstanceHit* results, unsigned count,
                              StackEntry* spill) {
  __shared__ StackEntry ring[kBlock * Rolling::Stack::kEntriesPerThread];
  __shared__ PathMemory<2> path_memory[kBlock];
  const unsigned i = blockIdx.x * kBlock + threadIdx.x;
  if (i >= count) return;
  const RollingTracer::Stack::Storage storage({ring, threadIdx.x, kBlock, grid_spill(spill, count, kSpillEntries, i)},
                                              path_memory[threadIdx.x]);
  results[i] = to_instance_hit(closest_hit<RollingTracer>(report->view, rays[i], storage));
}

}  // namespace

gpu::Result<std::vector<InstanceHit>> trace_instances(const gpu::InstanceReport* report, std::span<const Ray> rays,
                                                      MemoryOfStacks memory, hipStream_t stream,
                                                      gpu::Allocator& allocator) {
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, stream, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto results = gpu::DeviceArray<InstanceHit>::make(rays.size(), stream, allocator);
  if (!results) return tl::unexpected(results.error());
  auto spill = gpu::DeviceArray<StackEntry>::make(rays.size() * kSpillEntries, stream, allocator);
  if (!spill) return tl::unexpected(spill.error());
  const auto count = static_cast<unsigned>(rays.size());
  auto done = memory == MemoryOfStacks::kThread
                  ? gpu::launch(trace, count, stream, {}, report, device_rays->data(), results->data(), count)
                  : gpu::launch(trace_on_chip, count, stream, {.block = kBlock}, report, device_rays->data(),
                                results->data(), count, spill->data());
  if (!done) return tl::unexpected(done.error());
  return results->to_vector(stream);
}

std::vector<InstanceHit> trace_instances(const SceneView& view, std::span<const Ray> rays) {
  std::vector<InstanceHit> results;
  for (const Ray& ray : rays) results.push_back(to_instance_hit(closest_hit<Tracer>(view, ray)));
  return results;
}

}  // namespace hiprt::checks
