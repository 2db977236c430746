#include <hiprt_build/gpu/build.h>
#include <hiprt_build/gpu/launch.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>

using namespace hiprt;

__global__ void trace(SceneView scene, Hit* hit) {
  *hit = closest_hit(scene, Ray{.origin = {0.2f, 0.2f, 3}, .direction = {0, 0, -1}});
}

int main() {
  gpu::DeviceAllocator memory;
  const build::Position corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const build::Triangle indices[] = {{0, 1, 2}, {1, 3, 2}};
  const auto positions = gpu::DeviceArray<build::Position>::from(corners, nullptr, memory);
  const auto triangles = gpu::DeviceArray<build::Triangle>::from(indices, nullptr, memory);
  auto hit = gpu::DeviceArray<Hit>::make(1, nullptr, memory);
  if (!positions || !triangles || !hit) return 1;
  const gpu::DeviceGeometry mesh{
      .positions = positions->data(), .triangles = triangles->data(), .position_count = 4, .primitive_count = 2};
  const auto scene = gpu::build_scene({&mesh, 1}, {}, nullptr, memory);
  if (!scene) return std::puts(scene.error().message.c_str());
  const auto traced = gpu::launch(trace, gpu::Grid{}, nullptr, {.block = 1}, scene->view, hit->data());
  const auto hits = hit->to_vector(nullptr);
  if (traced && hits) std::printf("t = %f\n", static_cast<double>(hits->front().t));
  return traced && hits ? 0 : 1;
}
