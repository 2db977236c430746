#pragma once
/// The order in which groups of instances can be built.

#include <hiprt_build/instances.h>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace hiprt::tools {

/// A group's instance that leads back to the group.
struct GroupCycle {
  std::vector<std::size_t> groups;  ///< Each contains an instance of the next one, the last one of the first.
  std::size_t instance;             ///< Of the last group.
};

struct GroupOrder {
  std::vector<std::size_t> groups;  ///< Each after the groups that it has instances of. The top group is the last.
  std::vector<bool> used_objects;   ///< Per object that is no group.
  std::optional<GroupCycle> cycle;  ///< Then the rest is not complete.
};

/// @param groups instances of objects: below @p objects not groups, others group number object - @p objects.
GroupOrder order_groups(std::span<const std::vector<build::Instance>> groups, std::size_t objects, std::size_t top);

}  // namespace hiprt::tools
