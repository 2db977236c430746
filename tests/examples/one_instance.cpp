// A scene that is one instance, traced by policies that know nothing of instances.

#include <hiprt_build/format/only_instance.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

int main() {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}};
  const std::vector<hiprt::build::TriangleMesh> meshes{{positions, triangles}};
  const auto object = hiprt::build::build(meshes);
  if (!object) return 1;
  const std::vector<std::span<const std::byte>> files{object->buffer.bytes()};
  std::vector<hiprt::build::Instance> instances{{.object = 0, .id = 42}};
  instances[0].to_scene.row[2][3] = -3.0f;
  const auto scene = hiprt::build::build_instances(files, instances);
  if (!scene) return 1;

  // Nothing for other scenes: those take Instanced<Policies>. For a copy on a GPU say where it is.
  const auto placed = hiprt::only_instance(*hiprt::open_buffer(scene->buffer.bytes()));
  if (!placed) return 1;
  const hiprt::Ray ray{{0.2f, 0.2f, 1}, 0, {0, 0, -1}};
  const hiprt::Hit inside = hiprt::closest_hit<hiprt::Policies>(placed->object, placed->to_object(ray));
  const auto hit = placed->to_scene(inside, ray);
  std::printf("t %.1f: instance %u\n", hit.t, placed->scene.instances[hit.path.instance[0]].id);
}
