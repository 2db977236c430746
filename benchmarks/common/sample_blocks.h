#pragma once
/// Some of many rays, so that neighbours stay together.

#include <cstdint>
#include <vector>

namespace hiprt::bench {

/// About @p wanted of [0, count) in blocks of 64 consecutive numbers, which keep the coherence of neighbours. The
/// blocks are spread evenly, at pseudo-random places so that no column of a picture is preferred. All if wanted >=
/// count.
std::vector<std::uint32_t> sample_blocks(std::uint32_t count, std::uint32_t wanted);

}  // namespace hiprt::bench
