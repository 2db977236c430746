#include "machine.h"

namespace hiprt::bench {

std::vector<std::string> vulkan_modes() { return {"fast_build", "fast_trace"}; }
std::vector<std::string> vulkan_calls() { return {"auto", "pipeline", "query"}; }

std::vector<Flag> VulkanOptions::flags() {
  return {
      words_flag("vulkan", "Vulkan's modes; all on a GPU, none on a CPU", modes, vulkan_modes(), "none"),
      text_flag("vulkan-device", "TEXT", "a part of the name of Vulkan's device (the first GPU)", device),
      word_flag("vulkan-calls",
                "how shaders trace; another way if the device lacks this one. auto: pipeline, on a CPU query (auto)",
                calls, vulkan_calls())};
}

build::Result<std::shared_ptr<VulkanMachine>> open_chosen(VulkanOptions& options, bool gpu) {
  if (options.modes == VulkanOptions{}.modes) options.modes = gpu ? vulkan_modes() : std::vector<std::string>{};
  if (options.modes.empty()) return nullptr;
  options.software = !gpu;
  return open_vulkan(options);
}

}  // namespace hiprt::bench
