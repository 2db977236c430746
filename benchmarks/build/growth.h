#pragma once
/// How the time of a build grows with the number of triangles where very many of them overlap.

#include <benchmarks/common/overlapping_meshes.h>
#include <hiprt_build/error.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::bench {

/// One builder on one mesh, one thread.
struct GrowthEntry {
  std::string name;
  double seconds = 0;       ///< Median over the rounds, of all triangles.
  double growth = 0;        ///< Median over the rounds: the time relative to that of a quarter of the triangles.
  double to_scattered = 0;  ///< The same, relative to the time of as many small triangles that seldom overlap.
};

struct GrowthCell {
  std::string mesh;
  std::uint64_t triangles = 0;
  std::vector<GrowthEntry> entries;
};

/// @param mesh of kOverlapping. @param rounds at least 1.
build::Result<GrowthCell> measure_growth(const std::string& mesh, unsigned triangles, unsigned rounds);

}  // namespace hiprt::bench
