#pragma once
/// The file of a group of instances. Internal.

#include <hiprt_build/instances/instance_group.h>

#include <hiprt_build/buffer.h>

#include <optional>
#include <span>

namespace hiprt::build {

/// @param tree the file of a tree over the group's boxes.
/// @param group its motions get the offsets of their segments.
/// @param all_objects of the scene, which are copied into its file; else none.
Buffer write_instance_file(const BufferView& tree, InstanceGroup& group, const std::optional<Shutter>& shutter,
                           std::span<const ObjectParts> all_objects);

}  // namespace hiprt::build
