#pragma once
/// The part of validate() that checks leaves and accounts for every primitive. Internal.

#include <hiprt_build/format/check.h>
#include <hiprt_build/format/view.h>

#include <cstdint>

namespace hiprt::format_detail {

struct PrimitiveSummary {
  std::uint64_t leaf_triangles = 0;
  std::uint64_t leaf_customs = 0;
  std::uint64_t dropped = 0;
  std::uint64_t split = 0;
};

/// @pre check_tree() accepted the file.
tl::expected<PrimitiveSummary, FormatIssue> check_primitives(const BufferView& view);

}  // namespace hiprt::format_detail
