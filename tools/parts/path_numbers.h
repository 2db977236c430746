#pragma once
/// The numbers that instances of a part have in the whole scene.

#include <tools/parts/part_data.h>

#include <hiprt_build/format/view.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace hiprt::tools {

class PathNumbers {
 public:
  PathNumbers() = default;
  /// @param bvh whose bytes must live as long as this. @param groups PartData::groups that belong to it.
  PathNumbers(const BufferView& bvh, std::vector<std::vector<std::uint32_t>> groups) : numbers_(std::move(groups)) {
    for (const ObjectRecord& object : bvh.objects) {
      const auto view = open_buffer(bvh.object_file(object));
      if (view->has_instances()) groups_.push_back(view->instances);
    }
    files_ = bvh.objects.size() - groups_.size();
    groups_.push_back(bvh.instances);
  }

  /// @param path of a hit in the part, with kInvalidId behind its end. @param to the path in the scene, at least as
  /// long.
  void to_scene(std::span<const std::uint32_t> path, std::span<std::uint32_t> to) const {
    std::fill(to.begin(), to.end(), kInvalidId);
    std::size_t group = groups_.size() - 1;
    for (std::size_t k = 0; k < path.size() && path[k] != kInvalidId; ++k) {
      to[k] = numbers_[group].empty() ? path[k] : numbers_[group][path[k]];
      // Below an object with geometries the path ends.
      const std::uint32_t object = groups_[group][path[k]].object;
      group = object >= files_ ? object - files_ : group;
    }
  }

 private:
  std::vector<std::vector<std::uint32_t>> numbers_;
  std::vector<std::span<const InstanceRecord>> groups_;  ///< As in `numbers_`.
  std::size_t files_ = 0;                                ///< Objects with geometries: the first ones.
};

}  // namespace hiprt::tools
