#pragma once
/// Merges levels of instances: replaces instances of groups by the instances in them. Uses more memory and makes
/// traversal faster.
///
///     auto merged = hiprt::build::merge_levels({objects, groups});  // into one
///     auto views = merged->views();
///     auto scene = hiprt::build::build_instances({objects, views});
///     std::vector<std::uint32_t> path = merged->path_of(hit.path.instance[0]);  // in the original groups

#include <hiprt_build/instances.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// Limits of merge_levels().
struct MergeOptions {
  /// The most levels of instances that may remain above a primitive, 1 or more.
  unsigned levels = 1;
  /// The most instances that all groups may have together. Each takes about 128 bytes in a file, including its part of
  /// the tree.
  std::uint64_t most_instances = std::uint64_t{1} << 27;
};

/// The last step of the path that an instance of the merged scene represents.
struct MergedPath {
  static constexpr std::uint64_t kBegin = ~std::uint64_t{0};
  std::uint64_t before;    ///< Index in MergedLevels::steps: the path to its group; kBegin: the path begins here.
  std::uint32_t instance;  ///< Its number in that group.
};

/// Groups with fewer levels, and the original paths of their instances.
struct MergedLevels {
  /// The groups that are still used, in their order. The last is the scene.
  std::vector<std::vector<Instance>> groups;
  std::vector<std::size_t> group_before;  ///< Index in InstancedScene::groups of each group.
  unsigned levels = 0;  ///< Of the merged scene: more than MergeOptions::levels if groups had to stay.
  /// Instances of groups that were not replaced. kept_moving: they move, or an instance in the group moves. kept_masks:
  /// no single mask can replace the masks on a path.
  std::uint64_t kept_moving = 0, kept_masks = 0;
  std::vector<MergedPath> steps;               ///< Beginnings that several paths share.
  std::vector<std::vector<MergedPath>> paths;  ///< The last step of each instance, by group.

  /// The groups for InstancedScene::groups. Valid as long as this object lives.
  std::vector<std::span<const Instance>> views() const { return {groups.begin(), groups.end()}; }
  /// @return the path that instance @p i of merged group @p group represents: the numbers of the instances from the
  /// original group to the object, outermost first.
  HIPRT_BUILD_API std::vector<std::uint32_t> path_of(std::uint32_t i, std::size_t group) const;
  /// The same for the instances of the scene itself.
  std::vector<std::uint32_t> path_of(std::uint32_t i) const { return path_of(i, groups.size() - 1); }
};

/// Replaces instances of groups by the group's own instances, from the scene downwards, until at most
/// MergeOptions::levels are left. A merged instance represents a path of instances:
/// - its matrix is the product of their matrices, computed in double and rounded once;
/// - a ray sees it if it saw all of them; filters are called if all of them allowed it;
/// - its id is that of the outermost one.
/// The t of hits differs by the rounding of the transforms. Moving instances stay as they are.
/// @param scene its files are not read: instances of objects below @p scene.files.size() stay as they are. Matrices are
/// not checked: build_instances() does that.
/// @return kInvalidInput for options out of range and for an object that does not exist. kTooLarge with the number of
/// instances that the result would have (an empty group counts as one).
HIPRT_BUILD_API Result<MergedLevels> merge_levels(const InstancedScene& scene, const MergeOptions& options = {});

}  // namespace hiprt::build
