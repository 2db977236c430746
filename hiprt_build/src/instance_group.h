#pragma once
/// What a group of instances becomes before its tree is built: records, motions, and the boxes that leaves are for.

#include <hiprt_build/instances.h>

#include <hiprt_build/exec/cpu.h>
#include <hiprt_device/format/instance_bounds.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hiprt::build {

/// An object whose file stands.
struct ObjectParts {
  BufferView view;
  ObjectRecord record;

  explicit ObjectParts(const BufferView& of) : view(of), record(format_detail::describe(of)) {}
};

/// What a leaf is for.
struct InstancePart {
  std::uint32_t instance;
  NodeRef ref;         ///< Where rays enter the object; kInvalidRef: it is empty.
  unsigned depth = 0;  ///< Of that, below its root.
};

/// A group's instances on the way into its file.
struct InstanceGroup {
  std::vector<InstanceRecord> records;
  /// None if no instance moves. Offsets of segments count from the first.
  std::vector<MotionRecord> motions;
  std::vector<MotionSegment> segments;
  std::vector<InstancePart> parts;
  std::vector<Box> boxes;  ///< Of the parts.
  format_detail::InstanceNeeds needs;

  std::span<const MotionSegment> motion_of(std::size_t i) const {
    if (motions.empty()) return {};
    return std::span(segments).subspan(static_cast<std::size_t>(motions[i].segments / sizeof(MotionSegment)),
                                       motions[i].count);
  }
};

/// @param objects those with lower numbers than the group.
/// @param number of the group, for messages.
/// @return kInvalidInput with the group and instance, as build_instances().
Result<InstanceGroup> prepare_instances(CpuEngine& engine, std::span<const Instance> instances,
                                        std::span<const ObjectParts> objects, const InstanceOptions& options,
                                        std::size_t number);

}  // namespace hiprt::build
