#pragma once
/// The part of validate() that checks instances and their objects. Internal.

#include <hiprt_build/format/check.h>
#include <hiprt_build/format/validate.h>
#include <hiprt_build/format/view.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace hiprt::format_detail {

/// Checks that every leaf of a file of instances is alone in its run.
Check check_instance_leaves(const BufferView& view);

/// Checks the instances of a file.
/// @pre check_tree() and check_primitives() accepted the file.
/// @param objects that the instances may name, all of them valid.
/// @param records of the objects.
/// @param stack_need entries of the file's own tree.
/// @return stack entries of a traversal that includes all objects.
tl::expected<std::uint32_t, FormatIssue> check_instances(const BufferView& view, std::span<const BufferView> objects,
                                                         std::span<const ObjectRecord> records,
                                                         std::uint32_t stack_need, const ParallelLoop& loop);

/// Checks that the record of object @p i matches its file, and that the scene has the offset of its shapes. Only zeros
/// may lie between the object files.
Check check_object_record(const BufferView& scene, std::size_t i, const BufferView& object);

}  // namespace hiprt::format_detail
