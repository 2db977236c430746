#pragma once
/// The result of the checks of a file. Internal.

#include <hiprt_build/format/error.h>

#include <tl/expected.hpp>

#include <bit>
#include <cstdint>

namespace hiprt::format_detail {

/// Nothing, or the first fault.
using Check = tl::expected<void, FormatIssue>;

inline tl::unexpected<FormatIssue> fail(FormatError error, std::uint64_t offset, std::uint64_t value,
                                        std::uint64_t limit) {
  return tl::unexpected<FormatIssue>(FormatIssue{error, offset, value, limit});
}
inline tl::unexpected<FormatIssue> fail_float(FormatError error, std::uint64_t offset, float value, float limit) {
  return tl::unexpected<FormatIssue>(FormatIssue{error, offset, std::bit_cast<std::uint32_t>(value),
                                                 std::bit_cast<std::uint32_t>(limit), NumberKind::kFloat});
}
inline tl::unexpected<FormatIssue> fail_double(FormatError error, std::uint64_t offset, double value, double limit) {
  return tl::unexpected<FormatIssue>(FormatIssue{error, offset, std::bit_cast<std::uint64_t>(value),
                                                 std::bit_cast<std::uint64_t>(limit), NumberKind::kDouble});
}

}  // namespace hiprt::format_detail
