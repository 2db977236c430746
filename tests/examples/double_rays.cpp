#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

int main() {
  // A slope z = x, placed at the radius of the Earth in metres.
  const std::vector<hiprt::build::Position> corners{{-1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, -1}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  const std::vector<hiprt::build::TriangleMesh> mesh{{corners, triangles}};
  const auto slope = hiprt::build::build(mesh);
  if (!slope) return 1;
  hiprt::build::Instance instance;
  instance.to_scene.row[0][3] = 6378137;
  const std::vector<std::span<const std::byte>> files{slope->buffer.bytes()};
  const std::vector<hiprt::build::Instance> instances{instance};
  const std::vector<std::span<const hiprt::build::Instance>> groups{instances};
  const auto world = hiprt::build::build_instances(hiprt::build::InstancedScene{files, groups});
  if (!world) return 1;
  const hiprt::SceneView scene = hiprt::make_scene_view(*hiprt::open_buffer(world->buffer.bytes()));

  // 123 millimetres beside the middle, from 5 metres above.
  const hiprt::RayD ray{.origin = {6378137.123, 0, 5}, .direction = {0, 0, -1}};
  const auto hit = hiprt::closest_hit<hiprt::Instanced<hiprt::DoubleRays<>>>(scene, ray);
  const auto rough = hiprt::closest_hit<hiprt::Instanced<hiprt::Policies>>(scene, hiprt::convert<float>(ray));
  std::printf("double: t = %.9f, within %.1g\n", hit.t, static_cast<double>(hit.error));
  std::printf("float:  t = %.9f, within %.1g\n", static_cast<double>(rough.t), static_cast<double>(rough.error));
}
