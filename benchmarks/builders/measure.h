#pragma once
/// BVHs of all builders over one scene: build time, size, quality and traversal speed.

#include <benchmarks/common/scenes.h>

#include <hiprt_build/build.h>

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::bench {

/// The builder that is the reference.
inline constexpr std::string_view kYardstick = "ploc";

/// Rays of one kind through one BVH, by one thread with the default policies.
struct TracedKind {
  std::string kind;
  double mrays_s = 0;     ///< Median over the rounds, 10^6 rays per second.
  double time_ratio = 0;  ///< Median over the rounds of the time relative to kYardstick in the same round.
  double box_tests = 0;   ///< Four-box tests per ray.
  double leaf_tests = 0;  ///< Tests of a leaf (one or two triangles) per ray.
};

struct BuilderEntry {
  std::string name;
  double seconds = 0;                     ///< Median over the rounds, from a mesh in memory to a file in memory.
  double seconds_ratio = 0;               ///< Median over the rounds, relative to kYardstick in the same round.
  double mtri_s = 0;                      ///< 10^6 triangles of the input per second.
  double sah_cost = 0;                    ///< build::measure_tree().
  double cost_ratio = 0;                  ///< Relative to kYardstick.
  double nodes = 0;                       ///< Box nodes in the file.
  double bytes_per_triangle = 0;          ///< Size of the file.
  double scratch_bytes_per_triangle = 0;  ///< Most memory at a time, with the file.
  /// For kOperaHouseScene: oracle::cost_within() the object. NaN for other scenes.
  double object_cost = std::numeric_limits<double>::quiet_NaN();
  std::vector<TracedKind> traced;
  double trace_time_ratio = 0;  ///< Geometric mean over the kinds.
};

struct BuilderCell {
  std::string scene;
  unsigned threads = 1;  ///< Of the builds.
  std::uint64_t triangles = 0;
  std::vector<BuilderEntry> entries;
};

/// @param kinds of rays that are traced. @param wanted_rays approximate number per kind.
/// @param builds options of all builders.
/// @param rounds at least 1. All builders run in turn, then all BVHs are traced in turn.
/// @return the first error. Different hits of two BVHs are an error.
build::Result<BuilderCell> measure_trees(const SceneOptions& options, const std::string& scene,
                                         const std::vector<std::string>& kinds, std::uint32_t wanted_rays,
                                         const build::BuildOptions& builds, unsigned rounds);

}  // namespace hiprt::bench
