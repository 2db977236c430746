// The program of hiprt_device/docs/QUERIES.md: many rays on a host.

#include <hiprt_build/build.h>
#include <hiprt_build/trace_rays.h>

#include <cstdio>
#include <vector>

int main() {
  std::vector<hiprt::build::Position> positions;
  std::vector<hiprt::build::Triangle> triangles;
  for (unsigned i = 0; i < 100; ++i) {
    const float x = 2.0f * static_cast<float>(i);
    positions.insert(positions.end(), {{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}});
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const std::vector<hiprt::build::TriangleMesh> meshes{{positions, triangles}};
  const auto bvh = hiprt::build::build(meshes);
  if (!bvh) return std::puts(bvh.error().message.c_str());
  const hiprt::SceneView scene = bvh->scene();
  std::vector<hiprt::Ray> rays;
  for (unsigned i = 0; i < 200; ++i)
    rays.push_back({.origin = {static_cast<float>(i) + 0.25f, 0.25f, 1}, .direction = {0, 0, -1}});
  std::vector<hiprt::Hit> hits(rays.size());
  if (const auto traced = hiprt::closest_hits(scene, rays, hits); !traced)
    return std::puts(traced.error().message.c_str());
  unsigned found = 0;
  for (const hiprt::Hit& hit : hits) found += hit.found() ? 1 : 0;
  std::printf("%u of %zu rays hit\n", found, rays.size());
}
