#include <tools/scene_io/scene/scene_merge.h>

#include <span>
#include <utility>

namespace hiprt::tools {

build::Result<void> merge_scene(SceneDescription& scene, unsigned levels) {
  // Their number is all that matters.
  const std::vector<std::span<const std::byte>> files(scene.objects.size());
  std::vector<std::span<const build::Instance>> groups;
  for (const SceneGroup& group : scene.groups) groups.emplace_back(group.instances);
  auto merged = build::merge_levels({files, groups}, {.levels = levels});
  if (!merged) return tl::unexpected(build::Error{merged.error().code, scene.path + ": " + merged.error().message});
  std::vector<SceneGroup> left;
  for (std::size_t g = 0; g < merged->groups.size(); ++g)
    left.push_back({std::move(scene.groups[merged->group_before[g]].location), std::move(merged->groups[g])});
  scene.groups = std::move(left);
  scene.merged = std::move(*merged);
  return {};
}

}  // namespace hiprt::tools
