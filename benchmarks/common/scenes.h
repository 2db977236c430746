#pragma once
/// The scenes of a benchmark: files of a folder, and generated scenes.

#include "flags.h"
#include "ray_sets.h"

#include <hiprt_build/error.h>
#include <hiprt_build/input.h>
#include <tools/scene_io/mesh/mesh_import.h>

#include <string>
#include <string_view>
#include <vector>

namespace hiprt::bench {

inline constexpr std::string_view kProceduralScene = "procedural";
/// tests/oracle/opera_house.h. Most programs measure it only on request.
inline constexpr std::string_view kOperaHouseScene = "opera_house";

inline bool is_generated(std::string_view scene) { return scene == kProceduralScene || scene == kOperaHouseScene; }

/// Which scenes, and how large.
struct SceneOptions {
  std::string folder;              ///< With NAME.mesh and NAME.KIND.rays or NAME.cam; empty: no files.
  std::vector<std::string> names;  ///< Empty: the defaults that exist, and kProceduralScene.
  unsigned triangles = 200'000;    ///< Of a generated scene, about.
  unsigned opera_ratio = 20'000;   ///< Edge of the hall relative to the object, for kOperaHouseScene.

  /// The folder is initialised from the environment variable HIPRT_SCENES.
  SceneOptions();
  /// --scenes, --scene, --triangles and --opera-ratio.
  std::vector<Flag> flags();
};

/// The chosen scenes. By default sponza, bistro_ext and bedroom if their meshes are in the folder, and
/// kProceduralScene.
/// @return an error with the first scene that is missing.
build::Result<std::vector<std::string>> find_scenes(const SceneOptions& options);

/// The kinds of rays that a scene has, without loading it.
std::vector<std::string> ray_kinds(const SceneOptions& options, const std::string& scene);

struct Scene {
  std::string name;
  tools::Mesh mesh;

  build::TriangleMesh input() const { return {.positions = mesh.positions, .triangles = mesh.triangles, .name = name}; }
};

build::Result<Scene> load_scene(const SceneOptions& options, const std::string& name);

/// All kinds of rays of a scene, about @p wanted of each kind.
build::Result<std::vector<RaySet>> load_rays(const SceneOptions& options, const Scene& scene, std::uint32_t wanted);

}  // namespace hiprt::bench
