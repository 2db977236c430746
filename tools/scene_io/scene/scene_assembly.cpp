#include <tools/scene_io/scene/scene_assembly.h>

#include <cstddef>
#include <memory>
#include <utility>

namespace hiprt::tools {

namespace {

/// The vertices with their times, as build::Shapes has them.
ShapeSet moving_triangles(Mesh&& mesh, const std::vector<float>& times) {
  ShapeSet result;
  result.name = std::move(mesh.name);
  result.kind = ShapeKind::kMovingTriangles;
  result.keys = mesh.keys;
  result.surface = std::move(mesh.surface);
  const std::size_t vertices = mesh.positions.size() / mesh.keys;
  result.points.reserve(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const build::Position& p = mesh.positions[i];
    result.points.push_back({{p[0], p[1], p[2]}, times[i / vertices]});
  }
  result.segments.reserve(3 * mesh.triangles.size());
  for (const build::Triangle& t : mesh.triangles) result.segments.insert(result.segments.end(), t.begin(), t.end());
  return result;
}

}  // namespace

void add_assembly(SceneDescription& scene, MeshAssembly assembly, const std::vector<float>& times) {
  const auto first = static_cast<std::uint32_t>(scene.objects.size());
  for (Mesh& mesh : assembly.meshes) {
    if (mesh.keys > 1) {
      scene.objects.push_back({mesh.name, {}, {scene.shapes.size()}});
      scene.shapes.push_back(moving_triangles(std::move(mesh), times));
      mesh = {};
    } else {
      scene.objects.push_back({mesh.name, {scene.meshes.size()}});
      scene.meshes.push_back(std::move(mesh));
    }
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
