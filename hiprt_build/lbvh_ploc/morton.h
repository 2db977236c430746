#pragma once
/// Morton codes: positions in space as numbers whose order keeps neighbours close (Morton 1966). Internal.

#include <hiprt_build/tree/box.h>
#include <hiprt_device/math/wave.h>

#include <cstdint>

namespace hiprt::build {

/// Bits per axis of a code.
inline constexpr unsigned kMortonBits63 = 21;
/// The same for codes with 30 bits, which fast builders use: too few for small detail in large scenes.
inline constexpr unsigned kMortonBits30 = 10;

/// Every third bit from 0 on is one of the low 21 bits of @p x.
HIPRT_HD constexpr std::uint64_t spread_bits(std::uint32_t x) {
  std::uint64_t v = x & 0x1fffffu;
  v = (v | v << 32) & 0x001f00000000ffffu;
  v = (v | v << 16) & 0x001f0000ff0000ffu;
  v = (v | v << 8) & 0x100f00f00f00f00fu;
  v = (v | v << 4) & 0x10c30c30c30c30c3u;
  v = (v | v << 2) & 0x1249249249249249u;
  return v;
}

/// Maps the centres of boxes to the cells of a grid of 2^bits cells per axis. The cells are cubes. In a flat scene the
/// bits of the flat axis are therefore 0, and no split of that axis comes before the useful splits.
struct MortonGrid {
  float low[3];
  float cells_per_unit;
  std::uint32_t last;

  /// @param centers holds every split_position().
  HIPRT_HD static constexpr MortonGrid over(const Box& centers, unsigned bits) {
    MortonGrid grid{{centers.min[0], centers.min[1], centers.min[2]}, 0.0f, (1u << bits) - 1u};
    float extent = 0.0f;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const float length = centers.max[axis] - centers.min[axis];
      extent = length > extent ? length : extent;
    }
    // For smaller extents the quotient would overflow; a grid over denormal numbers is of no use.
    if (extent > 0x1p-100f) grid.cells_per_unit = static_cast<float>(1u << bits) / extent;
    return grid;
  }

  HIPRT_HD constexpr std::uint32_t cell(const Box& box, unsigned axis) const {
    const float position = (build::split_position(box, axis) - low[axis]) * cells_per_unit;
    const auto whole = static_cast<std::uint32_t>(position);
    return whole < last ? whole : last;
  }

  /// The Morton code of a box: x is the highest bit of each three.
  HIPRT_HD constexpr std::uint64_t code(const Box& box) const {
    return spread_bits(cell(box, 0)) << 2 | spread_bits(cell(box, 1)) << 1 | spread_bits(cell(box, 2));
  }
};

/// How far apart two neighbours in a sorted list of codes are: 32 + the number of the highest bit that differs. For
/// equal codes it is 0 to 31 and depends on their positions, which keeps runs of equal codes balanced. Exactly one
/// boundary inside a node's range has the largest value: the node is split there (Karras 2012; Apetrei 2014).
HIPRT_HD HIPRT_FORCE_INLINE std::uint8_t boundary_level(std::uint64_t code, std::uint64_t next, std::uint32_t index) {
  const unsigned level = code == next ? highest_bit(index ^ (index + 1)) : 32 + highest_bit(code ^ next);
  return static_cast<std::uint8_t>(level);
}

}  // namespace hiprt::build
