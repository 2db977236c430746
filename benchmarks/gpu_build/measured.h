#pragma once
/// Builds of one scene by one builder, ours or Vulkan's, as a row of a table and as JSON.

#include "vulkan_builds.h"

#include <hiprt_build/gpu/build.h>

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::bench {

struct Measured {
  std::string scene, builder;
  std::uint64_t triangles = 0;
  std::uint64_t output_bytes = 0;  ///< Memory for the build's output. Vulkan: both levels, before compaction.
  std::uint64_t scratch_bytes = 0;
  std::uint64_t file_bytes = 0;  ///< Of the BVH. Vulkan: both levels, after compaction if there is one.
  double min_ms = 0, median_ms = 0, max_ms = 0;
  // Ours only.
  double sah_cost = 0, refit_ms = 0;
  double steps_ms = 0;            ///< Median time of the device for the same build by gpu::BuildSteps.
  double scene_ms = 0;            ///< Median time of the host for gpu::build_scene(), with its memory.
  double callback_gap_ms = 0;     ///< Median of the longest time between two progress callbacks of build_scene().
  std::uint64_t steps_bytes = 0;  ///< The most that the steps hold at once.
  gpu::BuildReport report{};
  // Vulkan's only.
  bool vulkan = false;
  double compaction_ms = 0;  ///< Median; part of the times above. 0: without compaction.
  double top_level_ms = 0;   ///< Median, of the structure over one instance; not part of the times above.
};

/// Vulkan's builds as a row. The builder is named "Vulkan, fast trace" or "Vulkan, fast trace, compacted".
Measured row_of(const std::string& scene, std::uint64_t triangles, const std::string& mode, const VulkanBuilds& builds);

nlohmann::json to_json(const Measured& measured);

/// A table with one line per row. Vulkan's rows have no figures of trees and refits.
std::string table(const std::vector<Measured>& all);

}  // namespace hiprt::bench
