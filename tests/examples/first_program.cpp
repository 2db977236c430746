// The first program of README.md: one triangle, one ray.

#include <hiprt_build/build.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

int main() {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}};
  const std::vector<hiprt::build::TriangleMesh> meshes{{positions, triangles}};
  const auto bvh = hiprt::build::build(meshes);
  if (!bvh) return std::puts(bvh.error().message.c_str());
  const hiprt::Hit hit = hiprt::closest_hit(bvh->scene(), {.origin = {0.2f, 0.3f, 2}, .direction = {0, 0, -1}});
  std::printf("t = %g, primitive %u\n", static_cast<double>(hit.t), hit.primitive);
}
