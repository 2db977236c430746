#pragma once
/// The scenes of the evaluation: files of a folder, and generated ones that need none.

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
  unsigned triangles = 400'000;    ///< Of a generated scene, about; of the island those of its meshes.
  unsigned instances = 100'000;    ///< Of the island's plants, about.

  /// Takes the folder from the environment: HIPRT_SCENES.
  SceneChoice();
  /// --scenes, --scene, --triangles and --instances.
  std::vector<Flag> flags();
};

/// A scene as it is read: objects, and groups of instances of them. A mesh is one object in one instance.
struct SourceScene {
  std::string name;
  std::string source;  ///< The file's name, or "generated".
  tools::SceneDescription description;
  tools::Camera camera;
  std::optional<Vec3> light;  ///< Where shadow rays go; none: into the sky.
};

/// "procedural", "stadium" and "island" (benchmarks/common).
std::vector<std::string> generated_scenes();

/// @return the names of the scenes that are asked for, or kIo with the first one that is not there.
build::Result<std::vector<std::string>> find_source_scenes(const SceneChoice& choice);

/// @return errors of the readers, with the file.
build::Result<std::unique_ptr<SourceScene>> load_source_scene(const SceneChoice& choice, const std::string& name);

}  // namespace hiprt::bench
