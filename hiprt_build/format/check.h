#pragma once
/// What the checks of a file return. Internal.

#include <hiprt_build/format/error.h>

#include <tl/expected.hpp>

#include <cstdint>

namespace hiprt::format_detail {

/// Nothing, or the first thing that is wrong.
using Check = tl::expected<void, FormatIssue>;

inline tl::unexpected<FormatIssue> fail(FormatError error, std::uint64_t offset, std::uint64_t value,
                                        std::uint64_t limit) {
  return tl::unexpected<FormatIssue>(FormatIssue{error, offset, value, limit});
}

}  // namespace hiprt::format_detail
