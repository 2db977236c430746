#pragma once
/// Files of objects from copies of device memory, where trees lie with gaps, with others, or without a header.
/// Internal.

#include <hiprt_build/buffer.h>
#include <hiprt_build/error.h>
#include <hiprt_device/format/instance.h>
#include <hiprt_device/format/motion.h>
#include <hiprt_device/format/node.h>

#include <cstddef>
#include <span>
#include <unordered_map>
#include <vector>

namespace hiprt::build {

/// The records that a device tree is made of, as a file has them.
struct PackedObject {
  Buffer file;
  ObjectRecord record{};                        ///< Of the file, without its offset.
  std::unordered_map<NodeRef, NodeRef> refs{};  ///< Of box nodes and runs: before and after.
};

/// @param memory a copy of the object's memory; references count from its first byte.
/// @param instances of a scene, by their objects' numbers among @p others.
/// @param there its record, as enqueue_objects() makes it.
/// @param shutter_begin, shutter_rate of the scene, for objects whose boxes move.
/// @param others the objects before it in the file.
/// @return kInvalidInput if the memory holds no such tree.
Result<PackedObject> pack_object(std::span<const std::byte> memory, std::span<const InstanceRecord> instances,
                                 const ObjectRecord& there, NodeLayout layout, float shutter_begin, float shutter_rate,
                                 std::span<const PackedObject> others);

/// The motions of a file, with their segments one after the other.
struct PackedMotions {
  std::vector<MotionRecord> records;  ///< Offsets count from the first segment.
  std::vector<MotionSegment> segments;
};
/// @param segment_at returns the segment at an offset that the records have.
template <class SegmentAt> PackedMotions pack_motions(std::span<const MotionRecord> motions, SegmentAt&& segment_at) {
  PackedMotions packed{{motions.begin(), motions.end()}, {}};
  for (MotionRecord& motion : packed.records) {
    const std::uint64_t from = motion.segments;
    if (motion.count != 0) motion.segments = packed.segments.size() * sizeof(MotionSegment);
    for (std::uint32_t k = 0; k < motion.count; ++k)
      packed.segments.push_back(segment_at(from + k * sizeof(MotionSegment)));
  }
  return packed;
}

}  // namespace hiprt::build
