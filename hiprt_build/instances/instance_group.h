#pragma once
/// Prepares a group of instances for its tree: records and motions. part_boxes.h has the boxes of its leaves. Internal.

#include <hiprt_build/instances.h>

#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/format/instance_bounds.h>
#include <hiprt_build/format/moving_box.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace hiprt::build {

/// An object with its file.
struct ObjectParts {
  BufferView view;
  ObjectRecord record;

  explicit ObjectParts(const BufferView& of) : view(of), record(format_detail::describe(of)) {}
};

/// The part of an object that a leaf refers to.
struct InstancePart {
  std::uint32_t instance;
  NodeRef ref;         ///< Where rays enter the object; kInvalidRef: it is empty.
  unsigned depth = 0;  ///< Of that, below its root.
};

/// The data of a group's file.
struct InstanceGroup {
  std::vector<InstanceRecord> records;
  /// None if no instance moves. Offsets of segments count from the first.
  std::vector<MotionRecord> motions;
  std::vector<MotionSegment> segments;
  std::vector<InstancePart> parts;
  std::vector<Box> boxes;  ///< Of the parts.
  /// Of the parts at the begin and the end of the shutter; none if nothing of the scene moves.
  std::vector<std::pair<Box, Box>> moving_boxes;
  format_detail::InstanceNeeds needs;

  std::span<const MotionSegment> motion_of(std::size_t i) const {
    if (motions.empty()) return {};
    return std::span(segments).subspan(static_cast<std::size_t>(motions[i].segments / sizeof(MotionSegment)),
                                       motions[i].count);
  }
};

using Shutter = format_detail::Shutter;

/// From the first key of all motions to the last; nothing if nothing moves, or for longer or shorter than a float can
/// say.
std::optional<Shutter> shutter_of(std::span<const std::span<const Instance>> groups);

/// Records and motions of a group, without parts.
/// @param objects those with lower numbers than the group.
/// @param number of the group, for messages.
/// @return kInvalidInput with the group and instance, as build_instances().
Result<InstanceGroup> prepare_instances(CpuEngine& engine, std::span<const Instance> instances,
                                        std::span<const ObjectParts> objects, std::size_t number);

}  // namespace hiprt::build
