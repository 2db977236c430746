#pragma once
/// All builders of a scene in turn: those of hiprt, imported BVHs of Embree, and Embree's own scenes.

#include <benchmarks/common/scenes.h>

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::bench {

/// The builder whose SAH cost is the reference.
inline constexpr std::string_view kReferenceTree = "embree-medium";

/// One builder with one number of threads.
struct BuildEntry {
  std::string name;         ///< A builder of hiprt, or a kind of Embree scene (rtc_..., timed: rtcCommitScene).
  double mtri_s = 0;        ///< Median over the rounds, 10^6 triangles of the input per second.
  double output_bytes = 0;  ///< Size of the file. Embree: memory of the device after rtcCommitScene, with the mesh.
  double peak_bytes = 0;    ///< Most memory during the build: arrays and file. Embree: memory of the device.
  double sah_cost = std::numeric_limits<double>::quiet_NaN();    ///< build::measure_tree(); NaN: Embree's own.
  double cost_ratio = std::numeric_limits<double>::quiet_NaN();  ///< sah_cost relative to kReferenceTree.
  std::uint32_t depth = 0;
  double pair_fill = 0;  ///< Triangles per leaf / 2.
};

struct BuildCell {
  std::string scene;
  unsigned threads = 1;
  std::uint64_t triangles = 0;
  std::vector<BuildEntry> entries;
};

/// @param rounds at least 1. Before them every builder runs once, untimed, for the other figures.
build::Result<BuildCell> measure_builders(const Scene& scene, unsigned threads, unsigned rounds);

}  // namespace hiprt::bench
