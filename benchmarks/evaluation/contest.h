#pragma once
/// Measures one scene: all competitors build in turn, then trace the same rays in turn.

#include "record.h"

#include <hiprt_build/error.h>

#include <functional>
#include <string>
#include <vector>

namespace hiprt::bench {

struct ContestOptions {
  std::vector<std::string> builders{"lbvh", "ploc", "hploc", "sah", "sbvh", "hq"};  ///< Names of tools::kBuilders.
  std::vector<std::string> peers = embree_modes();           ///< Names of embree_modes(), on a CPU.
  std::vector<std::string> vulkan;                           ///< Names of vulkan_modes().
  std::vector<std::string> hierarchies = hierarchy_names();  ///< deep applies to scenes with several levels.
  Picture picture;
  unsigned build_rounds = 3, rounds = 5;
  unsigned most_triangles =
      16'000'000;  ///< Limit of the flat hierarchy. All its BVHs together take about 700 bytes per triangle.
  /// Rays in a million that may differ, for our tracers in all hierarchies and for Embree's robust mode in the flat
  /// one.
  unsigned most_differing = 300;
};

/// @param progress receives the step (a string literal) and its finished fraction.
/// @return the measurements, the unsupported combinations with reasons (device, peer or memory), and wrong results;
/// or any other error.
build::Result<SceneRecord> run_contest(const SourceScene& scene, const ContestOptions& options, const Machine& machine,
                                       const std::function<void(const char* step, double fraction)>& progress);

}  // namespace hiprt::bench
