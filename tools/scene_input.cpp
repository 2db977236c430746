#include "scene_input.h"

#include "mesh_inputs.h"
#include "scene_binary.h"
#include "scene_json.h"

#include <iterator>
#include <utility>

namespace hiprt::tools {
namespace {

/// The objects of a mesh file, and their instances in the scene's only group.
build::Result<void> add_assembly(const Cli& cli, const BuildCommand& command, const std::string& input,
                                 SceneDescription& scene) {
  const std::vector<float> times = command.motion_times();
  auto assembly = load_assembly(input, times);
  if (interrupted()) return tl::unexpected(cancelled());
  if (!assembly) return tl::unexpected(assembly.error());
  if (auto checked = check_output(command.output, assembly->files); !checked) return checked;
  const auto first = static_cast<std::uint32_t>(scene.objects.size());
  if (assembly->meshes.empty()) cli.warn(input + ": no triangles in it");
  for (Mesh& mesh : assembly->meshes) {
    if (auto checked = check_output(command.output, mesh.files); !checked) return checked;
    warn_of(cli, input, mesh);
    scene.objects.push_back({mesh.name, {scene.meshes.size()}});
    scene.meshes.push_back(std::move(mesh));
  }
  for (const MeshUse& use : assembly->uses) {
    auto& instances = scene.groups[0].instances;
    instances.push_back({.object = first + static_cast<std::uint32_t>(use.mesh),
                         .to_scene = to_float(use.to_world),
                         .id = static_cast<std::uint32_t>(instances.size())});
    if (use.keys.empty()) continue;
    auto& motion = scene.motions.emplace_back(std::make_unique<build::Motion>());
    for (std::size_t i = 0; i < use.keys.size(); ++i) motion->matrices.push_back({times[i], to_float(use.keys[i])});
    instances.back().motion = motion.get();
  }
  return {};
}

build::Result<SceneDescription> read_assemblies(const Cli& cli, const BuildCommand& command, ProgressBar& bar) {
  SceneDescription scene;
  scene.groups.push_back({"instances", {}});
  for (const std::string& input : command.inputs) {
    scene.path += (scene.path.empty() ? "" : ", ") + input;
    bar.update("read", 0);
    if (auto added = add_assembly(cli, command, input, scene); !added) return tl::unexpected(added.error());
    bar.clear();
  }
  return scene;
}

}  // namespace

build::Result<SceneDescription> read_scene(const Cli& cli, const BuildCommand& command, ProgressBar& bar) {
  const std::string& input = command.inputs[0];
  if (!is_scene_file(input)) return read_assemblies(cli, command, bar);
  bar.update("read", 0);
  auto scene = is_scene_json(input) ? read_scene_json(input) : read_scene_binary(input);
  bar.clear();
  if (interrupted()) return tl::unexpected(cancelled());
  if (!scene || scene->files.empty()) return scene;
  if (auto checked = check_output(command.output, scene->files); !checked) return tl::unexpected(checked.error());
  auto meshes = read_meshes(cli, scene->files, command.output, bar);
  if (!meshes) return tl::unexpected(meshes.error());
  scene->meshes = std::move(*meshes);
  return scene;
}

}  // namespace hiprt::tools
