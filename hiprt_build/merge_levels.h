#pragma once
/// Merges levels of instances: replaces instances of groups by the instances in them. Uses more memory and makes rays
/// faster.
///
///     auto merged = hiprt::build::merge_levels({objects, groups});  // into one
///     auto views = merged->views();
///     auto scene = hiprt::build::build_instances({objects, views});
///     std::vector<std::uint32_t> way = merged->way_of(hit.path.instance[0]);  // as the groups had it

#include <hiprt_build/instances.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// How far merge_levels() goes.
struct MergeOptions {
  /// Levels of instances on the way to a primitive that may be left, 1 or more.
  unsigned levels = 1;
  /// Instances that all groups may have together: 64 bytes each in a file, and as much again for their tree.
  std::uint64_t most_instances = std::uint64_t{1} << 27;
};

/// Where an instance of the merged scene comes from.
struct MergedWay {
  static constexpr std::uint64_t kBegin = ~std::uint64_t{0};
  std::uint64_t before;    ///< Index of MergedLevels::steps of the way to its group; kBegin: none, the way begins here.
  std::uint32_t instance;  ///< Its number in that group.
};

/// Groups with fewer levels, and where their instances were.
struct MergedLevels {
  /// Those that are still used, in the order that they had; the last is the scene.
  std::vector<std::vector<Instance>> groups;
  std::vector<std::size_t> group_before;  ///< Which each of them was: index of InstancedScene::groups.
  unsigned levels = 0;  ///< Of the scene now: more than MergeOptions::levels where groups had to stay.
  /// Instances of groups that stayed for a motion, theirs or one in the group, or for masks that no one mask stands
  /// for.
  std::uint64_t kept_moving = 0, kept_masks = 0;
  std::vector<MergedWay> steps;              ///< Beginnings that ways share.
  std::vector<std::vector<MergedWay>> ways;  ///< Of the instances, by group.

  /// For InstancedScene::groups, as long as this lives.
  std::vector<std::span<const Instance>> views() const { return {groups.begin(), groups.end()}; }
  /// The numbers of the instances on the way that instance @p i of merged group @p group stands for, outermost first:
  /// from what was that group to the object.
  HIPRT_BUILD_API std::vector<std::uint32_t> way_of(std::uint32_t i, std::size_t group) const;
  /// The same of the scene's own instances.
  std::vector<std::uint32_t> way_of(std::uint32_t i) const { return way_of(i, groups.size() - 1); }
};

/// Replaces instances of groups by the group's own instances, from the scene downwards, until no more than
/// MergeOptions::levels are left. An instance stands for a whole way then: its matrix is the product of the matrices,
/// in double and rounded once; a ray sees it if it saw all on the way; filters are asked if they were by all; its id is
/// that of the outermost (instances in one group share theirs). t of hits differs by roundings of the transforms. What
/// moves stays as it is.
/// @param scene its files are not read: instances of objects below @p scene.files.size() stay as they are.
/// Matrices are not looked at: build_instances() refuses those that cannot be.
/// @return kInvalidInput for options out of range and an object that does not exist; kTooLarge with the number of
/// instances that there would be (a group with nothing in it counts as one).
HIPRT_BUILD_API Result<MergedLevels> merge_levels(const InstancedScene& scene, const MergeOptions& options = {});

}  // namespace hiprt::build
