// A user's first program: one triangle, its BVH, one ray. Exit status 0 when the ray hits at the right point.

#include <hiprt_build/build.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_device/hiprt_device.h>

#include <array>
#include <cstdio>

int main() {
  const std::array<hiprt::build::Position, 3> positions{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const std::array<hiprt::build::Triangle, 1> triangles{{{0, 1, 2}}};
  const std::array<hiprt::build::TriangleMesh, 1> meshes{{{.positions = positions, .triangles = triangles}}};
  const auto bvh = hiprt::build::build(meshes);
  if (!bvh) {
    std::fprintf(stderr, "%s\n", bvh.error().message.c_str());
    return 1;
  }
  if (!hiprt::validate(bvh->buffer.bytes())) return 2;
  const auto view = hiprt::open_buffer(bvh->buffer.bytes());
  if (!view) return 2;
  const hiprt::SceneView scene = hiprt::make_scene_view(*view);
  const hiprt::Hit hit = hiprt::closest_hit(scene, {.origin = {0.25f, 0.5f, 2.0f}, .direction = {0.0f, 0.0f, -1.0f}});
  std::printf("hiprt %s: t = %g, geometry %u, primitive %u\n", hiprt::build::version(), static_cast<double>(hit.t),
              hit.geometry, hit.primitive);
  return hit.t == 2.0f && hit.geometry == 0 && hit.primitive == 0 ? 0 : 3;
}
