#pragma once
/// Merges levels of instances: replaces instances of groups by the instances in them. Uses more memory and makes rays
/// faster.
///
///     auto merged = hiprt::build::merge_levels({objects, groups});  // into one
///     auto views = merged->views();
///     auto scene = hiprt::build::build_instances({objects, views});
///     std::vector<std::uint32_t> path = merged->path_of(hit.path.instance[0]);  // as the groups had it

#include <hiprt_build/instances.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// Limits of merge_levels().
struct MergeOptions {
  /// Levels of instances above a primitive that may be left, 1 or more.
  unsigned levels = 1;
  /// Instances that all groups may have together. Each takes about 128 bytes in a file, with its part of the tree.
  std::uint64_t most_instances = std::uint64_t{1} << 27;
};

/// Where an instance of the merged scene comes from.
struct MergedPath {
  static constexpr std::uint64_t kBegin = ~std::uint64_t{0};
  std::uint64_t before;  ///< Index of MergedLevels::steps of the path to its group; kBegin: none, the path begins here.
  std::uint32_t instance;  ///< Its number in that group.
};

/// Groups with fewer levels, and where their instances were.
struct MergedLevels {
  /// The groups that are still used, in their order. The last is the scene.
  std::vector<std::vector<Instance>> groups;
  std::vector<std::size_t> group_before;  ///< Which each of them was: index of InstancedScene::groups.
  unsigned levels = 0;  ///< Of the scene now: more than MergeOptions::levels where groups had to stay.
  /// Instances of groups that stayed for a motion, theirs or one in the group, or for masks that no one mask stands
  /// for.
  std::uint64_t kept_moving = 0, kept_masks = 0;
  std::vector<MergedPath> steps;               ///< Beginnings that paths share.
  std::vector<std::vector<MergedPath>> paths;  ///< Of the instances, by group.

  /// For InstancedScene::groups, as long as this lives.
  std::vector<std::span<const Instance>> views() const { return {groups.begin(), groups.end()}; }
  /// The numbers of the instances on the path that instance @p i of merged group @p group stands for, outermost first:
  /// from what was that group to the object.
  HIPRT_BUILD_API std::vector<std::uint32_t> path_of(std::uint32_t i, std::size_t group) const;
  /// The same of the scene's own instances.
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
/// instances that there would be (an empty group counts as one).
HIPRT_BUILD_API Result<MergedLevels> merge_levels(const InstancedScene& scene, const MergeOptions& options = {});

}  // namespace hiprt::build
