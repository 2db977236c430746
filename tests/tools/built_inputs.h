#pragma once
/// BVHs of files, built by bvhbuild's own code, and the surfaces of the same files.

#include <tests/tools/importers/gltf_builder.h>

#include <tools/build/build_meshes.h>
#include <tools/build/build_scene.h>
#include <tools/build/shape_geometries.h>
#include <tools/cli/build/build_command.h>
#include <tools/cli/build/mesh_inputs.h>
#include <tools/cli/build/scene_input.h>
#include <tools/cli/build/shape_inputs.h>
#include <tools/cli/cli.h>
#include <tools/cli/progress.h>
#include <tools/scene_io/scene/scene_flatten.h>
#include <tools/scene_io/scene/surface_load.h>

#include <hiprt_build/format/view.h>

#include <tests/catch.h>

#include <string>
#include <utility>
#include <vector>

namespace hiprt::test {

inline constexpr tools::ToolInfo kTestTool{"test", "", ""};

/// The value of a Result; without one the test case fails.
template <class T> T value_of(build::Result<T> result) {
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

inline build::Buffer build_geometries(const build::SceneInput& scene, const tools::BuildCommand& command) {
  return std::move(value_of(tools::build_meshes(scene, tools::make_request(command, "test"))).bvh.buffer);
}

/// As bvhbuild builds them; no file is written.
inline build::Buffer build_inputs(tools::BuildCommand command) {
  command.output = (std::filesystem::temp_directory_path() / "hiprt-not-written.bvh").string();
  const tools::Cli cli(kTestTool);
  tools::ProgressBar bar(false);
  if (!command.is_scene()) {
    std::vector<std::string> of_meshes, of_shapes;
    for (const std::string& input : command.inputs)
      (tools::is_shape_file(input) ? of_shapes : of_meshes).push_back(input);
    const auto meshes = value_of(tools::read_meshes(cli, of_meshes, command.output, bar));
    const auto sets = value_of(tools::read_shapes(cli, of_shapes, command.output, bar));
    const auto shapes = value_of(tools::ShapeGeometries::make(tools::pointers(sets), 1));
    const auto views = tools::views(meshes);
    return build_geometries({views, shapes.customs()}, command);
  }
  auto scene = value_of(tools::read_scene(cli, command, bar));
  if (!command.flatten)
    return std::move(value_of(tools::build_scene(scene, tools::make_request(command, "test"), bar.sink())).file);
  const auto geometries = value_of(tools::flatten_scene(scene));
  const auto views = tools::views(geometries);
  return build_geometries({views, {}}, command);
}

inline BufferView view_of(const build::Buffer& file) {
  const auto view = open_buffer(file.bytes());
  if (!view) FAIL(to_string(view.error()));
  return *view;
}

/// Surfaces of the files that a BVH was just built of.
inline tools::SceneSurfaces surfaces_of(const tools::BuildCommand& command) {
  const build::Buffer file = build_inputs(command);
  return value_of(tools::load_surfaces(command.inputs, view_of(file)));
}

/// The same of one glTF file without instances.
inline tools::SceneSurfaces surfaces_of(const TempFolder& folder, const GltfBuilder& b) {
  tools::BuildCommand command;
  command.inputs = {folder.write("a.glb", b.glb()).string()};
  return surfaces_of(command);
}

/// The error for a file without the data that a BVH needs.
inline std::string surface_fault(const TempFolder& folder, const GltfBuilder& b) {
  tools::BuildCommand command;
  command.inputs = {folder.write("a.glb", b.glb()).string()};
  const build::Buffer file = build_inputs(command);
  const auto surfaces = tools::load_surfaces(command.inputs, view_of(file));
  if (surfaces) FAIL("accepted");
  INFO(surfaces.error().message);
  CHECK(surfaces.error().message.find('\n') == std::string::npos);
  CHECK(surfaces.error().message.find("a.glb: ") != std::string::npos);
  return surfaces.error().message;
}

}  // namespace hiprt::test
