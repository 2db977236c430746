#pragma once
/// The GPU that the tools use. For sources of builds with GPU code.

#include <hiprt_build/gpu/device.h>

namespace hiprt::tools {

/// The current device. @return kNoDevice without one, or if this build has no code for its architecture.
build::Result<gpu::Device> usable_device();

}  // namespace hiprt::tools
