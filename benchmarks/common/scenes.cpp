#include "scenes.h"

#include "procedural.h"

#include <tests/oracle/opera_house.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace hiprt::bench {
namespace {

std::filesystem::path mesh_file(const SceneOptions& options, const std::string& scene) {
  return std::filesystem::path(options.folder) / (scene + ".mesh");
}

/// The camera of scenes without ray files.
std::filesystem::path camera_file(const SceneOptions& options, const std::string& scene) {
  return std::filesystem::path(options.folder) / (scene + ".cam");
}

build::Result<tools::Camera> read_camera(const std::filesystem::path& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto camera = tools::parse_camera(text);
  if (!camera)
    return tl::unexpected(build::Error{build::ErrorCode::kInvalidInput, path.string() + ": " + camera.error()});
  return *camera;
}

bool is_there(const SceneOptions& options, const std::string& scene) {
  return is_generated(scene) || (!options.folder.empty() && std::filesystem::exists(mesh_file(options, scene)));
}

/// A camera close to the object, which fills most of the picture.
tools::Camera opera_camera() {
  tools::Camera camera;
  camera.eye = {1.5 * oracle::kOperaObjectHalf, oracle::kOperaObjectHalf, 2.5 * oracle::kOperaObjectHalf};
  camera.at = {0.0, 0.0, 0.0};
  return camera;
}

}  // namespace

SceneOptions::SceneOptions() {
  if (const char* path = std::getenv("HIPRT_SCENES"); path != nullptr) folder = path;
}

std::vector<Flag> SceneOptions::flags() {
  return {
      text_flag("scenes", "DIR",
                "folder of NAME.mesh with NAME.KIND.rays, or with NAME.cam for generated rays (default: $HIPRT_SCENES)",
                folder),
      list_flag("scene", "NAME,...",
                "scenes of the folder, 'procedural' or 'opera_house' (sponza, bistro_ext and bedroom if they exist, "
                "procedural)",
                names),
      number_flag("triangles", "triangles of a generated scene, about", triangles, 100, 100'000'000),
      number_flag("opera-ratio", "size of the opera house's hall relative to the object in it", opera_ratio, 4,
                  1'000'000)};
}

build::Result<std::vector<std::string>> find_scenes(const SceneOptions& options) {
  for (const std::string& name : options.names)
    if (!is_there(options, name))
      return tl::unexpected(
          build::Error{build::ErrorCode::kIo, "--scene: there is no file " + mesh_file(options, name).string()});
  if (!options.names.empty()) return options.names;
  std::vector<std::string> found;
  for (const char* name : {"sponza", "bistro_ext", "bedroom"})
    if (is_there(options, name)) found.emplace_back(name);
  found.emplace_back(kProceduralScene);
  return found;
}

std::vector<std::string> ray_kinds(const SceneOptions& options, const std::string& scene) {
  if (is_generated(scene)) return generated_kinds();
  const std::vector<std::string> stored = stored_kinds(options.folder, scene);
  return stored.empty() && std::filesystem::exists(camera_file(options, scene)) ? generated_kinds() : stored;
}

build::Result<Scene> load_scene(const SceneOptions& options, const std::string& name) {
  if (name == kProceduralScene) return Scene{name, procedural_mesh(options.triangles)};
  if (name == kOperaHouseScene) {
    oracle::Mesh hall = oracle::opera_house(options.triangles, options.opera_ratio);
    Scene scene{name, {}};
    scene.mesh.name = name;
    scene.mesh.positions = std::move(hall.positions);
    scene.mesh.triangles = std::move(hall.triangles);
    return scene;
  }
  auto mesh = tools::load_mesh(mesh_file(options, name));
  if (!mesh) return tl::unexpected(mesh.error());
  return Scene{name, std::move(*mesh)};
}

build::Result<std::vector<RaySet>> load_rays(const SceneOptions& options, const Scene& scene, std::uint32_t wanted) {
  if (scene.name == kProceduralScene) return generate_ray_sets(scene.mesh, procedural_camera(), wanted);
  if (scene.name == kOperaHouseScene) return generate_ray_sets(scene.mesh, opera_camera(), wanted);
  const std::vector<std::string> stored = stored_kinds(options.folder, scene.name);
  if (const auto path = camera_file(options, scene.name); stored.empty() && std::filesystem::exists(path)) {
    const auto camera = read_camera(path);
    if (!camera) return tl::unexpected(camera.error());
    return generate_ray_sets(scene.mesh, *camera, wanted);
  }
  std::vector<RaySet> sets;
  for (const std::string& kind : stored) {
    auto set = read_ray_set(options.folder, scene.name, kind, wanted);
    if (!set) return tl::unexpected(set.error());
    sets.push_back(std::move(*set));
  }
  return sets;
}

}  // namespace hiprt::bench
