#pragma once
/// Samples rays in blocks of neighbours.

#include <cstdint>
#include <vector>

namespace hiprt::bench {

/// About @p wanted numbers of [0, count) in blocks of 64 consecutive numbers, which keep the coherence of neighbours.
/// The blocks are spread evenly, with pseudo-random offsets so that no column of a picture is preferred. All numbers if
/// wanted >= count.
std::vector<std::uint32_t> sample_blocks(std::uint32_t count, std::uint32_t wanted);

}  // namespace hiprt::bench
