#include "vulkan_builds.h"

namespace hiprt::bench {

build::Result<VulkanBuilds> measure_vulkan(VulkanMachine& machine, const build::TriangleMesh& mesh,
                                           const std::string& mode, bool compacted, unsigned repeats) {
  const std::vector<std::vector<build::TriangleMesh>> objects{{mesh}};
  const build::Instance whole;
  VulkanBuilds result;
  for (unsigned i = 0; i < repeats + 1; ++i) {
    const auto scene = machine.make_scene({mode, objects, {&whole, 1}, compacted});
    if (!scene) return tl::unexpected(scene.error());
    if (const auto first = (*scene)->build(); !first) return tl::unexpected(first.error());
    const auto built = (*scene)->build();
    if (!built) return tl::unexpected(built.error());
    VulkanSeconds copied;
    if (compacted) {
      const auto seconds = (*scene)->compact();
      if (!seconds) return tl::unexpected(seconds.error());
      copied = *seconds;
    }
    result.bytes = (*scene)->bytes();
    if (i == 0) continue;
    result.bottom_ms.push_back(1e3 * built->objects);
    result.top_ms.push_back(1e3 * built->instances);
    if (compacted) result.compaction_ms.push_back(1e3 * copied.all());
  }
  return result;
}

}  // namespace hiprt::bench
