#pragma once
/// The part of validate() that checks node references and boxes. Internal.

#include <hiprt_build/format/check.h>
#include <hiprt_build/format/view.h>

#include <cstdint>

namespace hiprt::format_detail {

struct TreeSummary {
  std::uint64_t leaf_runs = 0;
  std::uint32_t depth = 0;
  std::uint32_t stack_need = 0;
};

/// Checks every node reference and box.
///
/// After a success, every node and leaf is reached exactly once, along references that lead forward. So walks over the
/// tree are short loops without further checks.
tl::expected<TreeSummary, FormatIssue> check_tree(const BufferView& view);

}  // namespace hiprt::format_detail
