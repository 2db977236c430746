// A surface that waves: refitted frame by frame, rebuilt when that is advised.

#include <hiprt_build/format/view.h>
#include <hiprt_build/refit.h>
#include <hiprt_device/hiprt_device.h>

#include <cmath>
#include <cstdio>
#include <vector>

int main() {
  std::vector<hiprt::build::Position> positions(65 * 65);
  std::vector<hiprt::build::Triangle> triangles;
  for (unsigned i = 0; i < 64 * 65; ++i)
    if (i % 65 != 64) triangles.insert(triangles.end(), {{i, i + 1, i + 66}, {i, i + 66, i + 65}});
  const hiprt::build::TriangleMesh meshes[] = {{positions, triangles}};
  const hiprt::build::BuildOptions options{.builder = hiprt::build::Builder::kHploc};  // It splits no triangles.
  hiprt::build::Bvh bvh;
  for (int frame = 0; frame < 10; ++frame) {
    for (unsigned i = 0; i < 65 * 65; ++i) {
      const unsigned column = i % 65, row = i / 65;
      const float x = static_cast<float>(column) / 64, y = static_cast<float>(row) / 64;
      positions[i] = {x, y, 0.1f * std::sin(20 * x + static_cast<float>(frame))};
    }
    const auto moved = hiprt::build::refit(bvh.buffer.bytes(), {.meshes = meshes});  // Frame 0: no file to refit yet.
    if (!moved || moved->rebuild_advised) bvh = hiprt::build::build(meshes, options).value_or(hiprt::build::Bvh{});
    const auto view = hiprt::open_buffer(std::as_const(bvh.buffer).bytes());
    if (!view) return 1;
    const hiprt::Ray down{.origin = {0.5f, 0.4f, 1}, .direction = {0, 0, -1}};
    const hiprt::Hit hit = hiprt::closest_hit(hiprt::make_scene_view(*view), down);
    std::printf("frame %d %s: t = %.4f\n", frame, moved ? "refitted" : "built", static_cast<double>(hit.t));
  }
  return 0;
}
