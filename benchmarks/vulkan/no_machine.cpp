#include "machine.h"

namespace hiprt::bench {

build::Result<std::shared_ptr<VulkanMachine>> open_vulkan(const VulkanOptions&) {
  return tl::unexpected(build::Error{build::ErrorCode::kNoDevice,
                                     "this program was built without Vulkan's headers or without glslangValidator"});
}

}  // namespace hiprt::bench
