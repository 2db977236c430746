#pragma once
/// All builders of a scene in turn: ours, Embree's trees imported, and Embree's own scenes.

#include <benchmarks/common/scenes.h>

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace hiprt::bench {

/// What the trees' costs are compared with.
inline constexpr std::string_view kReferenceTree = "embree-medium";

/// One builder with one number of threads.
struct BuildEntry {
  std::string name;         ///< A builder of ours, or a kind of Embree scene (rtc_...): rtcCommitScene.
  double mtri_s = 0;        ///< Median over the rounds, 10^6 triangles of the input per second.
  double output_bytes = 0;  ///< Of the file; Embree: what the device holds after rtcCommitScene, mesh included.
  double peak_bytes = 0;    ///< At most during the build: our arrays and the file; Embree: of the device.
  double sah_cost = std::numeric_limits<double>::quiet_NaN();    ///< build::measure_tree(); NaN: not one of our files.
  double cost_ratio = std::numeric_limits<double>::quiet_NaN();  ///< sah_cost relative to kReferenceTree's.
  std::uint32_t depth = 0;
  double pair_fill = 0;  ///< Triangles per leaf / 2.
};

struct BuildCell {
  std::string scene;
  unsigned threads = 1;
  std::uint64_t triangles = 0;
  std::vector<BuildEntry> entries;
};

/// @param rounds at least 1; before them everybody builds once, untimed, for the other figures.
build::Result<BuildCell> measure_builders(const Scene& scene, unsigned threads, unsigned rounds);

}  // namespace hiprt::bench
