#pragma once
/// Generated meshes whose triangles overlap, on which builders may take much longer than on others.

#include <tests/oracle/odd_meshes.h>

#include <array>
#include <string_view>

namespace hiprt::bench {

inline constexpr std::array kOverlapping{"soup", "concentric", "cables", "fan"};

/// @param name of kOverlapping, or "scattered": small triangles that seldom overlap. The same mesh in every call.
inline oracle::Mesh make_overlapping(std::string_view name, unsigned triangles) {
  constexpr std::uint64_t kSeed = 1;
  // Small enough that few boxes of a million overlap.
  constexpr double kScatteredSize = 0.01;
  if (name == "soup") return oracle::soup(triangles, 1.0, kSeed);
  if (name == "concentric") return oracle::concentric(triangles, kSeed);
  if (name == "cables") return oracle::cables(triangles, kSeed);
  if (name == "fan") return oracle::fan(triangles);
  return oracle::soup(triangles, kScatteredSize, kSeed);
}

}  // namespace hiprt::bench
