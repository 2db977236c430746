#include <hiprt_build/format/view.h>
#include <hiprt_build/instances.h>
#include <hiprt_device/hiprt_device.h>

#include <cstdio>
#include <vector>

int main() {
  const std::vector<hiprt::build::Position> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<hiprt::build::Triangle> triangles{{0, 1, 2}};
  const std::vector<hiprt::build::TriangleMesh> leaf{{positions, triangles}};
  const auto object = hiprt::build::build(leaf);
  if (!object) return 1;
  const std::vector<std::span<const std::byte>> files{object->buffer.bytes()};  // object 0
  std::vector<hiprt::build::Instance> twig(3), tree(1000);                      // group 0 is object 1
  for (unsigned i = 0; i < 3; ++i) twig[i].to_scene.row[2][3] = 0.1f * static_cast<float>(i);
  for (unsigned i = 0; i < 1000; ++i) tree[i] = {.object = 1, .id = i};  // group 1 is the scene
  for (unsigned i = 0; i < 1000; ++i) tree[i].to_scene.row[0][3] = 2 * static_cast<float>(i);
  const std::vector<std::span<const hiprt::build::Instance>> groups{twig, tree};
  const auto scene = hiprt::build::build_instances(hiprt::build::InstancedScene{files, groups});
  if (!scene) return 1;

  using Tracer = hiprt::Instanced<hiprt::Policies, 2>;  // two levels of instances
  const hiprt::SceneView view = hiprt::make_scene_view(*hiprt::open_buffer(scene->buffer.bytes()));
  const auto hit = hiprt::closest_hit<Tracer>(view, hiprt::Ray{{84.2f, 0.2f, 1}, 0, {0, 0, -1}});
  std::printf("t %.1f: leaf %u of tree %u\n", hit.t, hit.path.instance[1], view.instances[hit.path.instance[0]].id);
}
