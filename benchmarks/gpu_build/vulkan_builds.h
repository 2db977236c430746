#pragma once
/// Build times and sizes of Vulkan's acceleration structures.

#include <benchmarks/vulkan/machine.h>

#include <hiprt_build/input.h>

#include <cstdint>
#include <string>
#include <vector>

namespace hiprt::bench {

/// Builds of one mesh. Each vector has a time in milliseconds per repeat.
struct VulkanBuilds {
  std::vector<double> bottom_ms;      ///< The bottom-level structure: the BVH over the triangles.
  std::vector<double> top_ms;         ///< The top-level one, over one instance.
  std::vector<double> compaction_ms;  ///< Copies of both into less memory. Empty without compaction.
  VulkanBytes bytes;                  ///< Of both.
};

/// Each repeat builds twice in new memory, and times the second build. The structures are compacted afterwards, if they
/// are @p compacted. One more repeat comes first and does not count.
/// @param mode of vulkan_modes().
build::Result<VulkanBuilds> measure_vulkan(VulkanMachine& machine, const build::TriangleMesh& mesh,
                                           const std::string& mode, bool compacted, unsigned repeats);

}  // namespace hiprt::bench
