#pragma once
/// The kernels of gpu_path_kernels.hip, for C++ sources that start them.

#include <tools/render/path/path_stages.h>

namespace hiprt::tools {

/// Threads of a block of the stages' kernels.
inline constexpr unsigned kPathBlock = 128;

/// The stage's step i for all i below count.
using PathKernel = void (*)(PathJob job, std::uint32_t count);

PathKernel path_kernel(PathStage stage);

}  // namespace hiprt::tools
