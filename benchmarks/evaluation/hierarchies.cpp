#include "hierarchies.h"

#include <tools/scene_io/transform.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace hiprt::bench {
namespace {

constexpr std::uint64_t kMostInstances = std::uint64_t{1} << 22;

/// Triangles of each object.
std::vector<std::uint64_t> triangle_counts(const tools::SceneDescription& scene) {
  std::vector<std::uint64_t> counts(scene.objects.size());
  for (std::size_t i = 0; i < counts.size(); ++i)
    for (const std::size_t mesh : scene.objects[i].meshes) counts[i] += scene.meshes[mesh].triangles.size();
  return counts;
}

/// Sum of @p count over all instance paths from the scene to objects. It stops growing far above the limits.
std::uint64_t over_all_paths(const tools::SceneDescription& scene, std::vector<std::uint64_t> counts) {
  constexpr std::uint64_t kEnough = std::uint64_t{1} << 62;
  for (const tools::SceneGroup& group : scene.groups) {
    std::uint64_t sum = 0;
    for (const build::Instance& instance : group.instances) sum = std::min(kEnough, sum + counts[instance.object]);
    counts.push_back(sum);
  }
  return counts.back();
}

/// Transformations and attributes on an instance path.
struct Step {
  std::size_t object;
  tools::Transform to_scene;
};

/// One group with the instances of all paths, in the order of the scene. Matrices are multiplied in double and rounded
/// once.
tools::SceneGroup joined_groups(const tools::SceneDescription& scene) {
  tools::SceneGroup result{"scene", {}};
  std::vector<Step> stack{{scene.objects.size() + scene.groups.size() - 1, {}}};
  while (!stack.empty()) {
    const Step step = stack.back();
    stack.pop_back();
    if (step.object < scene.objects.size()) {
      const auto number = static_cast<std::uint32_t>(result.instances.size());
      result.instances.push_back({.object = static_cast<std::uint32_t>(step.object),
                                  .to_scene = tools::to_float(step.to_scene),
                                  .id = number});
      continue;
    }
    const auto& instances = scene.groups[step.object - scene.objects.size()].instances;
    for (std::size_t i = instances.size(); i-- > 0;)
      stack.push_back({instances[i].object, step.to_scene * tools::to_double(instances[i].to_scene)});
  }
  return result;
}

tl::unexpected<build::Error> refused(build::ErrorCode code, std::string message) {
  return tl::unexpected(build::Error{code, std::move(message)});
}

build::Result<Hierarchy> flat(const SourceScene& scene, std::uint64_t most_triangles) {
  const std::uint64_t triangles = over_all_paths(scene.description, triangle_counts(scene.description));
  if (triangles > most_triangles)
    return refused(build::ErrorCode::kTooLarge, "flattened it has " + std::to_string(triangles) +
                                                    " triangles, the limit is " + std::to_string(most_triangles));
  Hierarchy hierarchy{.name = "flat", .levels = 0, .geometries = {}, .source = &scene.description, .groups = {}};
  auto geometries = tools::flatten_scene(scene.description);
  if (!geometries) return tl::unexpected(geometries.error());
  hierarchy.geometries = std::move(*geometries);
  hierarchy.triangles = triangles;
  return hierarchy;
}

build::Result<Hierarchy> two_level(const SourceScene& scene) {
  const std::vector<std::uint64_t> once(scene.description.objects.size(), 1);
  const std::uint64_t paths = over_all_paths(scene.description, once);
  if (paths > kMostInstances)
    return refused(build::ErrorCode::kTooLarge, "as one level it has " + std::to_string(paths) +
                                                    " instances, the limit is " + std::to_string(kMostInstances));
  Hierarchy hierarchy{.name = "two_level", .levels = 1, .geometries = {}, .source = &scene.description, .groups = {}};
  hierarchy.groups.push_back(joined_groups(scene.description));
  return hierarchy;
}

build::Result<Hierarchy> deep(const SourceScene& scene) {
  const unsigned levels = levels_of(scene.description);
  if (levels < 2) return refused(build::ErrorCode::kInvalidInput, "the scene has one level of instances, as two_level");
  return Hierarchy{.name = "deep",
                   .levels = levels,
                   .geometries = {},
                   .source = &scene.description,
                   .groups = scene.description.groups};
}

}  // namespace

std::vector<std::string> hierarchy_names() { return {"flat", "two_level", "deep"}; }

std::vector<build::TriangleMesh> Hierarchy::object(std::size_t number) const {
  std::vector<build::TriangleMesh> result;
  for (const std::size_t i : source->objects[number].meshes) {
    const tools::Mesh& mesh = source->meshes[i];
    result.push_back({.positions = mesh.positions, .triangles = mesh.triangles, .name = mesh.name});
  }
  return result;
}

unsigned levels_of(const tools::SceneDescription& scene) {
  std::vector<unsigned> levels(scene.objects.size(), 0);
  for (const tools::SceneGroup& group : scene.groups) {
    unsigned most = 0;
    for (const build::Instance& instance : group.instances) most = std::max(most, levels[instance.object]);
    levels.push_back(most + 1);
  }
  return levels.back();
}

build::Result<Hierarchy> make_hierarchy(const SourceScene& scene, const std::string& name,
                                        std::uint64_t most_triangles) {
  auto hierarchy = name == "flat" ? flat(scene, most_triangles) : name == "two_level" ? two_level(scene) : deep(scene);
  if (!hierarchy || hierarchy->levels == 0) return hierarchy;
  for (const std::uint64_t count : triangle_counts(scene.description)) hierarchy->triangles += count;
  for (const tools::SceneGroup& group : hierarchy->groups) hierarchy->instances += group.instances.size();
  return hierarchy;
}

}  // namespace hiprt::bench
