#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

int main() {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {1, 0, 0}, {1, 0.1f, 0}};  // a spoke
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}};
  const std::vector<hiprt::build::TriangleMesh> spoke{{positions, triangles}};
  const auto object = hiprt::build::build(spoke);
  if (!object) return 1;
  // Half a turn about z, counter-clockwise, while it comes along x.
  const hiprt::build::Motion turn{
      .keys = {{.time = 0}, {.time = 1, .translation = {3, 0, 0}, .rotation = {0, 0, 1, 0}}}};
  const std::vector<std::span<const std::byte>> files{object->buffer.bytes()};
  const std::vector<hiprt::build::Instance> wheel{{.object = 0, .motion = &turn}};
  const auto scene = hiprt::build::build_instances(files, wheel);
  if (!scene) return 1;

  using Tracer = hiprt::Moving<hiprt::Instanced<hiprt::Policies>>;
  const hiprt::SceneView view = hiprt::make_scene_view(*hiprt::open_buffer(scene->buffer.bytes()));
  for (const float time : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f}) {
    const hiprt::Ray ray{.origin = {1.46f, 0.9f, 1}, .direction = {0, 0, -1}, .time = time};
    std::printf("time %.2f: %s\n", time, hiprt::closest_hit<Tracer>(view, ray).found() ? "hit" : "miss");
  }
}
