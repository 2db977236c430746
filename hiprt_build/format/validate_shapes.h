#pragma once
/// The part of validate() that checks spheres and curves. Internal.

#include <hiprt_build/format/check.h>
#include <hiprt_build/format/view.h>

namespace hiprt::format_detail {

/// @pre check_tree() and check_primitives() accepted the file.
Check check_shapes(const BufferView& view);

}  // namespace hiprt::format_detail
