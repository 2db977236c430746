#pragma once
/// The scenes of the evaluation: files of a folder, or generated scenes.

#include <benchmarks/common/flags.h>

#include <hiprt_build/error.h>
#include <hiprt_device/math/vec.h>
#include <tools/render/scene/camera.h>
#include <tools/scene_io/scene/scene_description.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hiprt::bench {

/// Which scenes, and how large.
struct SceneChoice {
  std::string folder;              ///< With NAME.scene or NAME.mesh, and NAME.cam. Empty: no files.
  std::vector<std::string> names;  ///< Empty: all of the folder, or without a folder the generated ones.
  unsigned triangles = 400'000;    ///< Of a generated scene, about. For the island, of its meshes.
  unsigned instances = 100'000;    ///< Plants of the island, about.

  /// The folder is initialised from the environment variable HIPRT_SCENES.
  SceneChoice();
  /// --scenes, --scene, --triangles and --instances.
  std::vector<Flag> flags();
};

/// Objects and groups of instances. A mesh is one object in one instance.
struct SourceScene {
  std::string name;
  std::string source;  ///< The file's name, or "generated".
  tools::SceneDescription description;
  tools::Camera camera;
  std::optional<Vec3> light;  ///< Target of shadow rays. None: they go into the sky.
};

/// "procedural", "stadium" and "island" (benchmarks/common).
std::vector<std::string> generated_scenes();

/// @return the names of the chosen scenes, or kIo with the first one that is missing.
build::Result<std::vector<std::string>> find_source_scenes(const SceneChoice& choice);

/// @return errors of the readers with the name of the file.
build::Result<std::unique_ptr<SourceScene>> load_source_scene(const SceneChoice& choice, const std::string& name);

}  // namespace hiprt::bench
