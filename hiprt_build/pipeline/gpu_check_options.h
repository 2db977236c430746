#pragma once
/// The options of GPU builds. Internal.

#include <hiprt_build/gpu/build.h>

namespace hiprt::gpu {

/// Of every kind of build on a device.
Result<void> check_options(const BuildOptions& options);

}  // namespace hiprt::gpu
