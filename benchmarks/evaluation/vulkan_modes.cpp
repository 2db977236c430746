#include "vulkan_machine.h"

namespace hiprt::bench {

std::vector<std::string> vulkan_modes() { return {"fast_build", "fast_trace"}; }
std::vector<std::string> vulkan_calls() { return {"pipeline", "query"}; }

}  // namespace hiprt::bench
