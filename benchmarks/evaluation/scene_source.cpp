#include "scene_source.h"

#include <benchmarks/common/island.h>
#include <benchmarks/common/procedural.h>
#include <benchmarks/common/stadium.h>

#include <tools/scene_io/mesh/mesh_import.h>
#include <tools/scene_io/scene/scene_binary.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace hiprt::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 2> kExtensions{".scene", ".mesh"};

fs::path file_of(const SceneChoice& choice, const std::string& name, const char* extension) {
  return fs::path(choice.folder) / (name + extension);
}

bool is_generated_scene(const std::string& name) {
  const auto generated = generated_scenes();
  return std::find(generated.begin(), generated.end(), name) != generated.end();
}

/// The scene's file: instances are preferred. @return an empty path if there is none.
fs::path scene_file(const SceneChoice& choice, const std::string& name) {
  for (const char* extension : kExtensions)
    if (fs::path path = file_of(choice, name, extension); !choice.folder.empty() && fs::exists(path)) return path;
  return {};
}

/// Every NAME.cam that has a scene file.
std::vector<std::string> scenes_of_folder(const SceneChoice& choice) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(choice.folder, ignored))
    if (entry.path().extension() == ".cam" && !scene_file(choice, entry.path().stem().string()).empty())
      names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

/// One object in one instance.
tools::SceneDescription scene_of(tools::Mesh mesh) {
  tools::SceneDescription scene;
  scene.path = mesh.name;
  scene.objects.push_back({mesh.name, {0}});
  scene.meshes.push_back(std::move(mesh));
  scene.groups.push_back({"scene", {build::Instance{}}});
  return scene;
}

/// About the chosen number of plants in the proportions of the default island. Fewer triangles make coarser plants.
tools::SceneDescription sized_island(const SceneChoice& choice) {
  constexpr double kTriangles = 1.1e6;
  IslandOptions options;
  const double all = 1.0 * options.districts * options.groves * options.plants;
  const double part = std::cbrt(choice.instances / all);
  for (std::uint32_t* count : {&options.districts, &options.groves, &options.plants})
    *count = std::max(1u, static_cast<std::uint32_t>(std::lround(part * *count)));
  options.detail = std::min(1.0, choice.triangles / kTriangles);
  tools::SceneDescription scene = island(options);
  scene.path = "island";
  return scene;
}

std::unique_ptr<SourceScene> generate(const SceneChoice& choice, const std::string& name) {
  auto scene = std::make_unique<SourceScene>();
  scene->name = name;
  scene->source = "generated";
  if (name == "procedural") {
    scene->description = scene_of(procedural_mesh(choice.triangles));
    scene->camera = procedural_camera();
  } else if (name == "stadium") {
    scene->description = scene_of(stadium(std::max(1000u, choice.triangles / 2)));
    scene->camera = stadium_camera();
  } else {
    scene->description = sized_island(choice);
    scene->camera = island_camera();
  }
  return scene;
}

build::Result<void> read_view(const fs::path& path, SourceScene& scene) {
  const auto fail = [&](build::ErrorCode code, const std::string& what) {
    return tl::unexpected(build::Error{code, path.string() + ": " + what});
  };
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.good() && text.empty()) return fail(build::ErrorCode::kIo, "the scene's camera cannot be read");
  const auto camera = tools::parse_camera(text);
  if (!camera) return fail(build::ErrorCode::kInvalidInput, camera.error());
  const auto light = tools::parse_light(text);
  if (!light) return fail(build::ErrorCode::kInvalidInput, light.error());
  scene.camera = *camera;
  if (*light) scene.light = Vec3(**light);
  return {};
}

}  // namespace

SceneChoice::SceneChoice() {
  if (const char* path = std::getenv("HIPRT_SCENES"); path != nullptr) folder = path;
}

std::vector<Flag> SceneChoice::flags() {
  return {
      text_flag("scenes", "DIR", "folder of NAME.scene or NAME.mesh with NAME.cam (default: $HIPRT_SCENES)", folder),
      list_flag(
          "scene", "NAME,...",
          "scenes of that folder, or procedural, stadium, island (all of the folder; without a folder these three)",
          names),
      number_flag("triangles", "triangles of a generated scene, about; for the island, of its meshes", triangles, 1000,
                  100'000'000),
      number_flag("instances", "plants of the island, about", instances, 1, 4'000'000)};
}

std::vector<std::string> generated_scenes() { return {"procedural", "stadium", "island"}; }

build::Result<std::vector<std::string>> find_source_scenes(const SceneChoice& choice) {
  const auto missing = [&](const std::string& what) {
    return tl::unexpected(build::Error{build::ErrorCode::kIo, what});
  };
  for (const std::string& name : choice.names)
    if (!is_generated_scene(name) && scene_file(choice, name).empty())
      return missing("--scene: found neither " + file_of(choice, name, ".scene").string() + " nor " +
                     file_of(choice, name, ".mesh").string());
  if (!choice.names.empty()) return choice.names;
  if (choice.folder.empty()) return generated_scenes();
  const std::vector<std::string> names = scenes_of_folder(choice);
  if (names.empty()) return missing("--scenes=" + choice.folder + ": no NAME.cam with NAME.scene or NAME.mesh in it");
  return names;
}

build::Result<std::unique_ptr<SourceScene>> load_source_scene(const SceneChoice& choice, const std::string& name) {
  if (is_generated_scene(name)) return generate(choice, name);
  const fs::path path = scene_file(choice, name);
  auto scene = std::make_unique<SourceScene>();
  scene->name = name;
  scene->source = path.filename().string();
  if (path.extension() == ".scene") {
    auto description = tools::read_scene_binary(path);
    if (!description) return tl::unexpected(description.error());
    scene->description = std::move(*description);
  } else {
    auto mesh = tools::load_mesh(path);
    if (!mesh) return tl::unexpected(mesh.error());
    scene->description = scene_of(std::move(*mesh));
  }
  if (auto read = read_view(file_of(choice, name, ".cam"), *scene); !read) return tl::unexpected(read.error());
  return scene;
}

}  // namespace hiprt::bench
