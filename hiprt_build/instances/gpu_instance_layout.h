#pragma once
/// Offsets in the output of a build over instances. Internal.

#include <hiprt_build/format/file_layout.h>
#include <hiprt_build/gpu/instances.h>

namespace hiprt::gpu {

/// Of the output: what the build of the tree writes, and behind it what makes it one over instances.
struct InstanceOutputLayout {
  std::uint64_t records, motions, segments, objects, report, size;

  /// @param tree bytes of the tree's output. @param key_count 0: nothing moves.
  InstanceOutputLayout(std::uint64_t tree, std::uint64_t instance_count, std::uint64_t key_count,
                       std::uint64_t object_count) {
    records = align_up(tree, kDeviceAlignment);
    motions = align_up(records + instance_count * sizeof(InstanceRecord), kDeviceAlignment);
    segments = align_up(motions + (key_count != 0 ? instance_count : 0) * sizeof(MotionRecord), kDeviceAlignment);
    objects = align_up(segments + key_count * sizeof(MotionSegment), kDeviceAlignment);
    report = align_up(objects + object_count * sizeof(ObjectRecord), kDeviceAlignment);
    size = align_up(report + sizeof(InstanceReport), kDeviceAlignment);
  }
};

/// The tree's sections: each instance may be a leaf.
inline FileLayout output_tree_layout(NodeLayout layout, std::uint64_t instances) {
  return tree_layout(layout, {instances, instances, instances, 1});
}

}  // namespace hiprt::gpu
