// trace_file FILE: a BVH file from disk to the GPU, one ray per thread, and the hits back.

#include <hip/hip_runtime.h>
#include <hiprt_build/file.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <span>
#include <vector>

namespace gpu = hiprt::gpu;
using hiprt::Hit, hiprt::Ray;

__global__ void trace(hiprt::SceneView scene, const Ray* rays, Hit* hits, unsigned count) {
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) hits[i] = hiprt::closest_hit(scene, rays[i]);
}

gpu::Result<std::vector<Hit>> trace_file(const char* path, std::span<const Ray> rays) {
  const hipStream_t stream = nullptr;  // The default stream; any other will do.
  gpu::DeviceAllocator allocator;      // hipMalloc; or one of your own.
  const auto file = hiprt::build::map_file(path);
  if (!file) return tl::unexpected(file.error());
  const auto scene = gpu::upload_scene(file->bytes(), stream, allocator);
  if (!scene) return tl::unexpected(scene.error());
  const auto device_rays = gpu::DeviceArray<Ray>::from(rays, stream, allocator);
  if (!device_rays) return tl::unexpected(device_rays.error());
  auto hits = gpu::DeviceArray<Hit>::make(rays.size(), stream, allocator);
  if (!hits) return tl::unexpected(hits.error());
  const auto count = static_cast<unsigned>(rays.size());
  const auto done = gpu::launch(trace, count, stream, {}, scene->view, device_rays->data(), hits->data(), count);
  if (!done) return tl::unexpected(done.error());
  return hits->to_vector(stream);
}

int main(int argc, char** argv) {
  const std::vector<Ray> rays(64, Ray{.origin = {0.3f, 0.3f, 9.0f}, .direction = {0.0f, 0.0f, -1.0f}});
  const auto hits = trace_file(argc > 1 ? argv[1] : "scene.bvh", rays);
  if (!hits) {
    std::fprintf(stderr, "%s\n", hits.error().message.c_str());
    return 1;
  }
  const Hit& hit = hits->front();
  std::printf("t = %g, geometry %u, primitive %u\n", static_cast<double>(hit.t), hit.geometry, hit.primitive);
  return 0;
}
