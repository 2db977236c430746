#include <tools/cli/build/scene_input.h>

#include <tools/base/interrupt.h>
#include <tools/base/output_file.h>
#include <tools/cli/build/build_command.h>
#include <tools/cli/build/mesh_inputs.h>
#include <tools/cli/build/shape_inputs.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/scene_io/scene/scene_assembly.h>
#include <tools/scene_io/scene/scene_file.h>

#include <utility>

namespace hiprt::tools {
namespace {

/// The objects of a mesh file, and their instances in the scene's only group.
build::Result<void> read_assembly(const Cli& cli, const BuildCommand& command, const std::string& input,
                                  SceneDescription& scene) {
  const std::vector<float> times = command.motion_times();
  auto assembly = load_assembly(input, times);
  if (interrupted()) return cancelled();
  if (!assembly) return tl::unexpected(assembly.error());
  if (auto checked = check_output(command.output, assembly->files); !checked) return checked;
  for (const std::string& warning : assembly->warnings) cli.warn(input + ": " + warning);
  if (assembly->meshes.empty()) cli.warn(input + ": no triangles in it");
  for (const Mesh& mesh : assembly->meshes) {
    if (auto checked = check_output(command.output, mesh.files); !checked) return checked;
    warn_of(cli, input, mesh);
  }
  add_assembly(scene, std::move(*assembly), times);
  return {};
}

/// An object of a file of shapes, and its instance.
build::Result<void> add_shapes(const Cli& cli, const BuildCommand& command, const std::string& input, ProgressBar& bar,
                               SceneDescription& scene) {
  auto shapes = read_shapes(cli, {&input, 1}, command.output, bar);
  if (!shapes) return tl::unexpected(shapes.error());
  add_shape_object(scene, std::move(shapes->front()));
  return {};
}

/// Reads what the description has the paths of.
build::Result<void> read_described_shapes(const Cli& cli, const BuildCommand& command, ProgressBar& bar,
                                          SceneDescription& scene) {
  for (ShapeSet& set : scene.shapes) {
    if (set.path.empty()) continue;
    auto shapes = read_shapes(cli, {&set.path, 1}, command.output, bar);
    if (!shapes) return tl::unexpected(shapes.error());
    set = std::move(shapes->front());
  }
  return {};
}

build::Result<SceneDescription> read_assemblies(const Cli& cli, const BuildCommand& command, ProgressBar& bar) {
  SceneDescription scene;
  scene.groups.push_back({"instances", {}});
  for (const std::string& input : command.inputs) {
    scene.path += (scene.path.empty() ? "" : ", ") + input;
    bar.update("read", 0);
    auto added =
        is_shape_file(input) ? add_shapes(cli, command, input, bar, scene) : read_assembly(cli, command, input, scene);
    if (!added) return tl::unexpected(added.error());
    bar.clear();
  }
  return scene;
}

}  // namespace

build::Result<SceneDescription> read_scene(const Cli& cli, const BuildCommand& command, ProgressBar& bar) {
  const std::string& input = command.inputs[0];
  if (!is_scene_file(input)) return read_assemblies(cli, command, bar);
  bar.update("read", 0);
  auto scene = read_scene_file(input);
  bar.clear();
  if (interrupted()) return cancelled();
  if (!scene) return scene;
  for (const std::string& warning : scene->warnings) cli.warn(input + ": " + warning);
  if (auto read = read_described_shapes(cli, command, bar, *scene); !read) return tl::unexpected(read.error());
  if (scene->files.empty()) return scene;
  if (auto checked = check_output(command.output, scene->files); !checked) return tl::unexpected(checked.error());
  auto meshes = read_meshes(cli, scene->files, command.output, bar);
  if (!meshes) return tl::unexpected(meshes.error());
  scene->meshes = std::move(*meshes);
  return scene;
}

}  // namespace hiprt::tools
