#pragma once
/// Where things are in the memory of a build over instances. Internal.

#include <hiprt_build/gpu/instances.h>
#include <hiprt_build/pipeline/gpu_places.h>

namespace hiprt::gpu {

/// Of the output: what the build of the tree writes, and behind it what makes it one over instances.
struct InstancePlaces {
  std::uint64_t records, objects, report, size;

  /// @param tree bytes of the tree's output.
  InstancePlaces(std::uint64_t tree, std::uint64_t instance_count, std::uint64_t object_count) {
    records = align(tree, kDeviceAlignment);
    objects = align(records + instance_count * sizeof(InstanceRecord), kDeviceAlignment);
    report = align(objects + object_count * sizeof(ObjectRecord), kDeviceAlignment);
    size = align(report + sizeof(InstanceReport), kDeviceAlignment);
  }
};

/// The tree's sections: each instance may be a leaf.
inline FilePlaces tree_places(NodeLayout layout, std::uint64_t instances) {
  return {layout, instances, instances, instances, 1};
}

}  // namespace hiprt::gpu
