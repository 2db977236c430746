#include <hiprt_build/build.h>
#include <hiprt_build/gpu/gpu.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

void launch(hiprt::SceneView scene, const hiprt::Ray* rays, hiprt::Hit* hits, unsigned count);

int main() {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}};
  const std::vector<hiprt::build::TriangleMesh> meshes{{positions, triangles}};
  const auto bvh = hiprt::build::build(meshes);
  if (!bvh) return std::puts(bvh.error().message.c_str());
  const auto device = hiprt::gpu::current_device();
  std::puts(device ? device->name.c_str() : device.error().message.c_str());
  if (device) launch(bvh->scene(), nullptr, nullptr, 0);
}
