#include <tools/scene_io/scene/scene_assembly.h>

#include <memory>
#include <utility>

namespace hiprt::tools {

void add_assembly(SceneDescription& scene, MeshAssembly assembly, const std::vector<float>& times) {
  const auto first = static_cast<std::uint32_t>(scene.objects.size());
  for (Mesh& mesh : assembly.meshes) {
    scene.objects.push_back({mesh.name, {scene.meshes.size()}});
    scene.meshes.push_back(std::move(mesh));
  }
  for (const MeshUse& use : assembly.uses) {
    auto& instances = scene.groups[0].instances;
    instances.push_back({.object = first + static_cast<std::uint32_t>(use.mesh),
                         .to_scene = to_float(use.to_world),
                         .id = static_cast<std::uint32_t>(instances.size())});
    if (use.keys.empty()) continue;
    auto& motion = scene.motions.emplace_back(std::make_unique<build::Motion>());
    for (std::size_t i = 0; i < use.keys.size(); ++i) motion->matrices.push_back({times[i], to_float(use.keys[i])});
    instances.back().motion = motion.get();
  }
}

void add_shape_object(SceneDescription& scene, ShapeSet shapes) {
  auto& instances = scene.groups[0].instances;
  instances.push_back(
      {.object = static_cast<std::uint32_t>(scene.objects.size()), .id = static_cast<std::uint32_t>(instances.size())});
  scene.objects.push_back({shapes.name, {}, {scene.shapes.size()}});
  scene.shapes.push_back(std::move(shapes));
}

}  // namespace hiprt::tools
