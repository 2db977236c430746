#include <hiprt_build/build.h>
#include <hiprt_build/format/view.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

using namespace hiprt;

__global__ void trace(SceneView scene, Hit* hit) {
  *hit = closest_hit(scene, Ray{.origin = {0.2f, 0.2f, 3}, .direction = {0, 0, -1}});
}

int main() {
  gpu::DeviceAllocator memory;
  const std::vector<build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<build::Triangle> triangles{{0, 1, 2}};
  const std::vector<build::TriangleMesh> meshes{{positions, triangles}};
  const auto tree = build::build(meshes);
  const auto scene = gpu::upload_scene(*open_buffer(tree->buffer.bytes()), nullptr, memory);  // Device 0.
  const auto gpus = gpu::devices();
  std::vector<int> devices;
  if (gpus)
    for (const gpu::Device& device : *gpus) devices.push_back(device.index);
  if (!scene || !gpus || hipStreamSynchronize(nullptr) != hipSuccess) return 1;
  const auto replicas = gpu::replicate(*scene, 0, devices, memory);
  if (!replicas) return std::puts(replicas.error().message.c_str());
  for (const gpu::Replica& replica : *replicas) {
    const auto current = gpu::CurrentDevice::make(replica.device);
    auto hit = gpu::DeviceArray<Hit>::make(1, nullptr, memory);
    if (!current || !hit) return 1;
    const auto traced = gpu::launch(trace, gpu::Grid{}, nullptr, {.block = 1}, replica.scene.view, hit->data());
    const auto hits = hit->to_vector(nullptr);
    if (!traced || !hits) return 1;
    std::printf("device %d: t = %f\n", replica.device, static_cast<double>(hits->front().t));
  }
}
